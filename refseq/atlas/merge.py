"""Merging maps: what their paths share is kept in one of them (4.4.2, Algorithm 2; card M5, M8)."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.consistency import CandidateJoin, JoinGraph, Verdict
from refseq.atlas.decision import Confirm, Decision, leave_it, wished
from refseq.atlas.found import FoundOverlap
from refseq.atlas.look_alikes import look_alikes
from refseq.atlas.loops import LoopSearch
from refseq.atlas.overlap import SPACING, LaidViews, Overlap, OverlapSettings, PairSearch
from refseq.atlas.scan_check import ScanCheck, lie
from refseq.atlas.sharing import Joint, SharedPlaces, held_joins, joint_through, nearest, views_of
from refseq.errors import MapError
from refseq.map.map import Map, beside, check_is_map


@dataclass(frozen=True)
class Merged:
    """A map and how it came about."""

    map: Map
    decisions: tuple[Decision, ...]
    found: tuple[FoundOverlap, ...] = ()
    """Stretches that the decisions are about, one each."""
    strained: tuple[Decision, ...] = ()
    """Joins that a person made, and that odometry and all other joins contradict, ``overruled`` ones among these."""
    overruled: tuple[Decision, ...] = ()
    """Joins that would be made without those of a person, and are refused as they contradict these."""
    unsupported: tuple[Decision, ...] = ()
    """Stretches that are refused for want of evidence alone: nothing speaks against them, and nobody decided."""
    contested: tuple[Decision, ...] = ()
    """Stretches that are refused as others that contradict them would agree nearly as well, and nobody decided."""


def merge(maps: Iterable[Map], settings: OverlapSettings | None = None) -> Map:
    """Merge maps into one: what their paths share is kept in one sequence, and all of them run through it.

    The first may be of several paths, all others are of one. Raises ``MapError`` for no map, for paths of equal names,
    and for maps of other features or settings.
    """
    return merge_maps(maps, settings).map


def merge_maps(
    maps: Iterable[Map],
    settings: OverlapSettings | None = None,
    confirm: Confirm = leave_it,
    wishes: Sequence[Decision] = (),
) -> Merged:
    """Merge maps as ``merge`` does, and tell what was decided; the order of the maps does not matter.

    All pairs of paths are searched for stretches that they share. Those are joined that agree with each other and with
    the paths' odometry (``refseq.atlas.consistency``). A shared stretch is kept by the path that had the fewest places
    when it was learnt. ``wishes`` are decisions of a person that hold whatever is found: joins made or refused, and
    joins that nobody would have proposed. All other joins have to agree with those that are wished, and those that are
    refused speak for and against nothing. ``confirm`` is asked about each decision, and again where another answer has
    turned it; its answers are wishes. Raises ``MapError`` as ``merge`` does, and for wishes about views that there are
    not.
    """
    maps = [maps] if isinstance(maps, Map) else list(maps)
    for one in maps:
        check_is_map(one)
    for new in maps[1:]:
        new.sequence  # noqa: B018 - raises for a map of several paths
    merged_before = maps and not maps[0].has_one_path
    merging = _Merging(beside(maps), maps[0].names if merged_before else (), settings or OverlapSettings())
    found = merging.found()
    merged, answered = _merged(merging, found, wishes), list[Decision]()
    # An answer is a wish: others have to agree with it, and what comes of that is asked about in turn.
    while unasked := [one for one in merged.decisions if not any(_is_settled(one, known) for known in answered)]:
        answers = [confirm(one) for one in unasked]
        answered += answers
        turned = [answer for answer, one in zip(answers, unasked, strict=True) if answer.joined != one.joined]
        if not turned:
            break
        wishes = [*turned, *wishes]
        merged = _merged(merging, found, wishes)
    return merged


def _is_settled(decision: Decision, answer: Decision) -> bool:
    return answer.joined == decision.joined and answer.about(decision)


def _merged(merging: "_Merging", found: Sequence[FoundOverlap], wishes: Sequence[Decision]) -> Merged:
    """The map, with all stretches that were found judged under some wishes."""
    added = merging.unasked(wishes, [merging.decision(one, None) for one in found])
    own = [merging.wish(wish) for wish in added]
    found, verdicts = merging.found_beside(*merging.judged(found, wishes, own), wishes, own)
    proposed = [merging.decision(one, verdict) for one, verdict in zip(found, verdicts, strict=True)]
    told = [_Told.of(one, its, wishes) for one, its in zip(found, proposed, strict=True)]
    refused = [
        (its, verdict)
        for one, its, verdict in zip(told, proposed, verdicts, strict=True)
        if one.decision is its and not its.joined and not one.found.overlap.objection
    ]
    contested = tuple(its for its, verdict in refused if verdict is Verdict.CONTESTED)
    unsupported = tuple(its for its, verdict in refused if verdict in (Verdict.UNSUPPORTED, None))
    told += [
        _Told(one, replace(wish, lengths=merging.lengths(wish)), by_person=True)
        for one, wish in zip(own, added, strict=True)
    ]
    joined = [one.found for one in told if one.decision.joined]
    overruled = merging.overruled(found, verdicts, wishes)
    strained = {id(one) for one in merging.strained([*joined, *overruled])}
    against = tuple(one.decision for one in told if one.by_person and id(one.found) in strained)
    decisions, stretches = tuple(one.decision for one in told), tuple(one.found for one in told)
    yielding = tuple(one.decision for one in told if any(one.found is other for other in overruled))
    return Merged(merging.map(joined), decisions, stretches, against, yielding, unsupported, contested)


@dataclass(frozen=True, slots=True)
class _Told:
    """A stretch and the decision about it; ``by_person`` where a person makes it a join."""

    found: FoundOverlap
    decision: Decision
    by_person: bool

    @classmethod
    def of(cls, found: FoundOverlap, proposed: Decision, wishes: Sequence[Decision]) -> "_Told":
        """A person's wish goes before what is proposed."""
        decision = wished(proposed, wishes)
        return cls(found, decision, decision.joined and decision is not proposed)


def _in_order(found: FoundOverlap) -> tuple[object, ...]:
    """An order of stretches by their paths, as the maps were given, then by views; not by how they were searched."""
    return (*sorted([found.one, found.other]), found.views.tolist())


class _Merging:
    """Maps beside each other, of which the first may hold joins already, those between its sequences ``known``."""

    def __init__(self, map_: Map, known: Sequence[str], settings: OverlapSettings) -> None:
        self._map = map_
        self._known = frozenset(known)
        self._settings = settings
        self._number = {path.name: number for number, path in enumerate(map_.paths)}
        self._tracks = list(map(map_.track, map_.paths))
        self._held = held_joins(map_)
        self._scans = ScanCheck(map_, self._tracks, settings)

    @property
    def _pairs(self) -> Iterable[tuple[str, str, PairSearch]]:
        """All searches, made one by one: each holds tables of all its pairs of places, for rounds that ask again."""
        return self._kept_pairs if self._settings.rounds else self._each_pair()

    @cached_property
    def _kept_pairs(self) -> list[tuple[str, str, PairSearch]]:
        return list(self._each_pair())

    def _each_pair(self) -> Iterator[tuple[str, str, PairSearch]]:
        """All pairs of sequences, and each with itself, but those of the map that were compared before."""
        held = sorted(zip(self._map.names, self._map.sequences, strict=True), key=lambda pair: self._rank(pair[0]))
        for (one, first), (other, second) in combinations(held, 2):
            if not {one, other} <= self._known:
                yield one, other, PairSearch(first, second, self._settings)
        looked_at = {path.name for path in self._map.paths if len(path.loops)} | self._known
        for name, own in held:
            if name not in looked_at:
                yield name, name, LoopSearch.of(own, self._settings)

    def found(self) -> list[FoundOverlap]:
        """All stretches that two sequences seem to share."""
        return sorted((each for pair in self._pairs for each in self._searched(*pair)), key=_in_order)

    def _searched(self, one: str, other: str, search: PairSearch) -> list[FoundOverlap]:
        """All that a search finds: it looks on as long as some of its last look stands by the scans."""
        found = list[FoundOverlap]()
        for look in search.looks():
            new = [self._found(one, other, each) for each in look]
            found += new
            if all(each.overlap.objection for each in new):
                break
        return found

    def _found(self, one: str, other: str, overlap: Overlap) -> FoundOverlap:
        return self._scans.checked(self._in_views(one, other, overlap))

    def _in_views(self, one: str, other: str, overlap: Overlap) -> FoundOverlap:
        """An overlap of two sequences' places as one of the views of their paths."""
        ours, theirs = views_of(self._map, one), views_of(self._map, other)
        views = np.column_stack([ours[overlap.pairs[:, 0]], theirs[overlap.pairs[:, 1]]])
        return FoundOverlap(self._number[one], self._number[other], views, overlap)

    def found_beside(
        self,
        found: Sequence[FoundOverlap],
        verdicts: Sequence[Verdict | None],
        wishes: Sequence[Decision],
        own: Sequence[FoundOverlap],
    ) -> tuple[list[FoundOverlap], list[Verdict | None]]:
        """Look again where the joins that agree or are given lay paths beside each other, while that finds more.

        What ``wishes`` refuse there takes no part, and is told once.
        """
        found, verdicts = list(found), list(verdicts)
        given = self._wished_for(found, wishes, own)
        for _ in range(self._settings.rounds):
            agreed = [one for one, verdict in zip(found, verdicts, strict=True) if verdict is Verdict.AGREES] + given
            more = []
            for one in self._beside(agreed):
                word = self._word_on(one, wishes)
                if word is None or word.joined:
                    more.append(one)
                elif not any(self._word_on(known, [word]) for known in found):
                    found.append(one)
                    verdicts.append(None)
            graph = self._graph([one.join for one in [*agreed, *more]])
            begin = len(graph.candidates) - len(more)
            added = graph.extended(range(begin), range(begin, len(graph.candidates)))
            new = [more[n - begin] for n in sorted(added) if n >= begin]
            if not new:
                break
            found += new
            verdicts += [Verdict.AGREES] * len(new)
        return found, verdicts

    def _beside(self, agreed: Sequence[FoundOverlap]) -> list[FoundOverlap]:
        """Stretches of paths that the frame of some joins lays beside each other, and that are not joined there."""
        graph = self._graph([one.join for one in agreed])
        layout = graph.layout(range(len(graph.candidates)))
        more = []
        for one, other, search in self._pairs:
            numbers = self._number[one], self._number[other]
            if one == other or layout.groups[numbers[0]] != layout.groups[numbers[1]]:
                continue  # of a path itself the frame tells nothing that its odometry does not
            laid, its = (
                LaidViews(layout.poses[number][views], layout.sigmas[number][views])
                for number, views in zip(numbers, (views_of(self._map, one), views_of(self._map, other)), strict=True)
            )
            joined = [each.overlap.pairs for each in agreed if (each.one, each.other) == numbers]
            more += [self._found(one, other, each) for each in search.beside(laid, its, joined)]
        return sorted(more, key=_in_order)

    def judged(
        self, found: Sequence[FoundOverlap], wishes: Sequence[Decision], own: Sequence[FoundOverlap]
    ) -> tuple[Sequence[FoundOverlap], list[Verdict | None]]:
        """The overlaps and the word of all joins on each; once more where that tells of look-alikes along a path."""
        verdicts = self.verdicts(found, wishes, own)
        known = look_alikes(found, verdicts, self._settings.same)
        if not known:
            return found, verdicts
        doubted = [self._scans.doubted(one, known) for one in found]
        return doubted, self.verdicts(doubted, wishes, own)

    def verdicts(
        self, found: Sequence[FoundOverlap], wishes: Sequence[Decision] = (), own: Sequence[FoundOverlap] = ()
    ) -> list[Verdict | None]:
        """The word of all joins on each; None of those that are objected to, or that no odometry goes with.

        Those that ``wishes`` join, and a person's ``own``, are given; those that wishes refuse take no part.
        """
        judged = [
            n
            for n, one in enumerate(found)
            if not self._word_on(one, wishes) and not one.overlap.objection and self._tracked(one.join)
        ]
        held = [replace(one.join, held=True, alone=True) for one in self._wished_for(found, wishes, own)]
        graph = self._graph([*held, *(found[n].join for n in judged)])
        verdicts = dict(zip(judged, graph.verdicts()[len(graph.candidates) - len(judged) :], strict=True))
        return [verdicts.get(n) for n in range(len(found))]

    def _word_on(self, found: FoundOverlap, wishes: Sequence[Decision]) -> Decision | None:
        """The first of some wishes that is about an overlap."""
        return next((wish for wish in wishes if wish.about(self.decision(found, None))), None)

    def _wished_for(
        self, found: Sequence[FoundOverlap], wishes: Sequence[Decision], own: Sequence[FoundOverlap]
    ) -> list[FoundOverlap]:
        """Overlaps that a person joins, found or ``own``, as far as odometry goes with them."""
        words = [(one, self._word_on(one, wishes)) for one in found]
        given = [*(one for one, word in words if word and word.joined), *own]
        return [one for one in given if self._tracked(one.join)]

    def strained(self, joined: Sequence[FoundOverlap]) -> list[FoundOverlap]:
        """Those of some joins that add more to the squared errors of all than right ones do."""
        tracked = [one for one in joined if self._tracked(one.join)]
        graph = self._graph([one.join for one in tracked])
        begin = len(graph.candidates) - len(tracked)
        every = range(len(graph.candidates))
        return [one for n, one in enumerate(tracked, begin) if graph.is_strained(n, every)]

    def overruled(
        self, found: Sequence[FoundOverlap], verdicts: Sequence[Verdict | None], wishes: Sequence[Decision]
    ) -> list[FoundOverlap]:
        """Stretches that are contradicted, and agree where nothing is given but what ``wishes`` refuse."""
        refusals = [wish for wish in wishes if not wish.joined]
        if len(refusals) == len(wishes) or Verdict.CONTRADICTED not in verdicts:
            return []
        alone = self.verdicts(found, refusals)
        changed = (Verdict.CONTRADICTED, Verdict.AGREES)
        return [one for one, *both in zip(found, verdicts, alone, strict=True) if tuple(both) == changed]

    def _tracked(self, join: CandidateJoin) -> bool:
        return all(len(self._tracks[path]) for path in (join.one, join.other))

    def _graph(self, joins: Sequence[CandidateJoin]) -> JoinGraph:
        """The joins that the map has, and some more."""
        held = [join for join in self._held if self._tracked(join)]
        return JoinGraph(self._tracks, [*held, *joins])

    def decision(self, found: FoundOverlap, verdict: Verdict | None) -> Decision:
        """The decision about an overlap, with the reasons for and against it."""
        overlap = found.overlap
        told = ", ".join(f"{sensor} tells {nats:.2f}" for sensor, nats in overlap.told.items())
        evidence = f"{len(overlap.pairs)} views lead to each other; {told} nats a view"
        if overlap.alike is not None:
            evidence += f"; scans {lie(overlap.alike)}"
        against = overlap.objection
        if verdict is Verdict.CONTRADICTED:
            against = f"other joins and the odometry contradict it; {evidence}"
        elif verdict is Verdict.CONTESTED:
            against = f"others that contradict it would agree nearly as well; {evidence}"
        elif verdict is Verdict.UNSUPPORTED or (verdict is None and overlap.doubt):
            nobody = (
                "the odometry on its way round does not support it" if found.is_loop else "no other join supports it"
            )
            against = against or f"{nobody}, and it is {overlap.doubt}"
        sides = [
            (number, (int(first), int(last)), length)
            for number, (first, last), length in zip(
                (found.one, found.other), found.views[[0, -1]].T, overlap.lengths, strict=True
            )
        ]
        (one, first, length), (other, second, its) = sorted(sides)
        names = self._map.paths[one].name, self._map.paths[other].name
        return Decision(*names, first, second, (length, its), not against, against or evidence)

    def unasked(self, wishes: Sequence[Decision], told: Sequence[Decision]) -> list[Decision]:
        """Wishes to join two paths of which one is new where nothing was found."""
        ours = [wish for wish in wishes if wish.joined and not {wish.one, wish.other} <= self._known]
        return [wish for wish in ours if not any(wish.about(decision) for decision in told)]

    def wish(self, wish: Decision) -> FoundOverlap:
        """The stretches of a wish as an overlap: of equal lengths, as far as nobody can say better."""
        sides = []
        for (first, last), name in wish.sides:
            held = views_of(self._map, name) if name in self._map.names else np.zeros(0, np.intp)
            places = np.flatnonzero((held >= first) & (held <= last))
            if not len(places):
                raise MapError(f"views {first} to {last} of {name!r} are not there, or joined already")
            sides.append((self._rank(name), places, self._map.paths[self._number[name]].along[held[places]]))
        self._check_lengths(wish, sides[0][2], sides[1][2])
        (keeps, ours, at), (gives, theirs, along) = sorted(sides, key=lambda side: side[0])
        share = (at - at[0]) / max(float(np.ptp(at)), 1e-9)
        pairs = np.column_stack([ours, theirs[nearest(along, along[0] + share * np.ptp(along))]])
        overlap = Overlap(pairs, (float(np.ptp(at)), float(np.ptp(along))), {})
        return self._in_views(keeps[1], gives[1], overlap)

    def lengths(self, wish: Decision) -> tuple[float, float]:
        """Lengths of the stretches of a wish along their paths [m], whoever holds the places."""
        one, other = (
            float(np.ptp(self._map.paths[self._number[name]].along[first : last + 1]))
            for (first, last), name in wish.sides
        )
        return one, other

    def _check_lengths(self, wish: Decision, at: NDArray[np.float64], along: NDArray[np.float64]) -> None:
        """Raise ``MapError`` for a wish whose one side is far longer than the other, as the search would object to."""
        length, its = float(np.ptp(at)), float(np.ptp(along))
        if max(length, its) - SPACING > self._settings.stretched * min(length, its):
            one, other = (f"{first} to {last} of {name!r}" for (first, last), name in wish.sides)
            raise MapError(
                f"views {one} are {length:.1f} m, views {other} {its:.1f} m; valid to join are stretches of about one "
                "length"
            )

    def map(self, joined: Sequence[FoundOverlap]) -> Map:
        """The map with some overlaps joined, and the poses that all its joins give to its paths."""
        shared = SharedPlaces(self._map)
        for giving, joints in self._joints(joined).items():
            shared.take(self._number[giving], joints)
        return shared.map(self._tracks, self._poses([one.join for one in joined]), self._loops(joined))

    def _loops(self, joined: Sequence[FoundOverlap]) -> list[NDArray[np.intp]]:
        """Pairs of views of each path that are one place, those that the map had among them, (n, 2)."""
        found = [path.loops for path in self._map.paths]
        for one in joined:
            if one.is_loop:
                found[one.one] = np.unique(np.concatenate([found[one.one], one.views]), axis=0)
        return found

    def _poses(self, joins: Sequence[CandidateJoin]) -> list[NDArray[np.float64]]:
        """Poses of the largest group of paths that joins lead between, (0, 3) for others: theirs are other frames."""
        tracked = [join for join in joins if self._tracked(join)]
        graph = self._graph(tracked)
        layout = graph.layout(range(len(graph.candidates)))
        joined, sizes = {layout.groups[join.one] for join in graph.candidates}, Counter[int]()
        for path, group in zip(self._map.paths, layout.groups, strict=True):
            sizes[group] += len(path) if group in joined else 0
        largest = max(sizes, key=lambda group: sizes[group]) if joined else None
        found = zip(layout.poses, layout.groups, strict=True)
        return [poses if group == largest else np.zeros((0, 3)) for poses, group in found]

    def _rank(self, name: str) -> tuple[int, str]:
        """Order of paths by the places that were learnt along them; a path's places go to those before it."""
        return len(self._map.paths[self._number[name]]), name

    def _joints(self, joined: Sequence[FoundOverlap]) -> dict[str, list[Joint]]:
        """Stretches that each path gives to others, by their ranks; where it gives one to two, these share it as well.

        So a place is kept once where the join of the two was not found, or was refused for what it is beside.
        """
        order, paths = sorted(self._number, key=self._rank), self._map.paths
        ranks = [self._rank(path.name) for path in paths]
        found = {giving: [Joint(one.one, one.views) for one in self._given(joined, giving)] for giving in order}
        for giving in reversed(order):
            # Which of two keeps what they share is by their ranks: what was found here comes behind, whosever it is.
            for one, other in combinations(sorted(found[giving], key=lambda joint: ranks[joint.keeper]), 2):
                if one.keeper == other.keeper:
                    continue
                first, second = (paths[joint.keeper] for joint in (one, other))
                shared = joint_through(paths[self._number[giving]], (first, one), (second, other))
                if shared is not None:
                    found[second.name].append(shared)
        return found

    def _given(self, joined: Sequence[FoundOverlap], giving: str) -> list[FoundOverlap]:
        """Overlaps that a path gives away, by the paths that keep them."""
        ours = [one for one in joined if one.other == self._number[giving] and not one.is_loop]
        return sorted(ours, key=lambda one: (self._rank(self._map.paths[one.one].name), one.views.tolist()))
