"""Merging maps: what two of their paths share is kept in one of them (4.4.2, Algorithm 2; card M5, M8)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.overlap import Overlap, OverlapSettings, overlaps
from refseq.errors import MapError
from refseq.map.map import Map, beside
from refseq.map.path import MapPath
from refseq.map.reduction import reduced
from refseq.map.sequence import ReferenceSequence, check_comparable


@dataclass(frozen=True, slots=True)
class Decision:
    """A stretch that two sequences seem to share, by the places' numbers in the sequences as they were learnt.

    ``one`` is the sequence that was in the map, ``other`` the one that is added; ``first`` and ``second`` are the
    stretches, first and last place. ``joined`` says whether they were made one, and ``why`` why or why not.
    """

    one: str
    other: str
    first: tuple[int, int]
    second: tuple[int, int]
    lengths: tuple[float, float]
    joined: bool
    why: str

    def about(self, other: "Decision") -> bool:
        """True if two decisions are about stretches of the same sequences that have views in common."""
        pairs = (self.first, other.first), (self.second, other.second)
        return (self.one, self.other) == (other.one, other.other) and all(
            mine[0] <= its[1] and its[0] <= mine[1] for mine, its in pairs
        )


Confirm = Callable[[Decision], Decision]
"""A person's word on a decision: the same, or one turned round (M8)."""


def leave_it(decision: Decision) -> Decision:
    """Nobody is asked."""
    return decision


@dataclass(frozen=True)
class Merged:
    """A map and how it came about."""

    map: Map
    decisions: tuple[Decision, ...]


def merge(maps: Sequence[Map], settings: OverlapSettings | None = None) -> Map:
    """Merge maps into one: what two of their paths share is kept in one sequence, and both run through it.

    The first may be of several paths, all others are of one. Raises ``MapError`` for no map, for paths of equal names,
    and for maps of other features or settings.
    """
    return merge_maps(maps, settings).map


def merge_maps(
    maps: Sequence[Map],
    settings: OverlapSettings | None = None,
    confirm: Confirm = leave_it,
    wishes: Sequence[Decision] = (),
) -> Merged:
    """Add maps to one another in their order, as ``merge`` does; the last may be added later, to the same effect.

    ``wishes`` are decisions of a person that hold whatever is found: joins made or refused, and joins that nobody would
    have proposed. Raises ``MapError`` as ``merge`` does, and for wishes about views that there are not.
    """
    beside(maps)  # what is wrong with the last is told before the first is merged
    map_, decisions = maps[0], list[Decision]()
    for new in maps[1:]:
        grown = added(map_, new, settings, confirm, wishes)
        map_ = grown.map
        decisions.extend(grown.decisions)
    return Merged(map_, tuple(decisions))


def added(
    map_: Map,
    new: Map,
    settings: OverlapSettings | None = None,
    confirm: Confirm = leave_it,
    wishes: Sequence[Decision] = (),
) -> Merged:
    """A map with one more path, the ``new`` map's, compared with each sequence that is there, in their order.

    What it shares with one of them is taken out of the longer of the two, counted in places as they were learnt. Raises
    ``MapError`` as ``merge_maps`` does, and for a new map of several paths.
    """
    check_comparable(map_.sequences[0], new.sequence)
    merging, decisions = _Merging(beside([map_, new])), list[Decision]()
    for number in range(len(map_.sequences)):
        if not (pair := merging.pair(number)):
            continue
        found = overlaps(*pair, settings)
        told = [confirm(wished(merging.decision(number, overlap), wishes)) for overlap in found]
        for wish in merging.unasked(number, wishes, told):
            found.append(merging.overlap(number, wish))
            told.append(wish)
        merging.join(number, [overlap for overlap, decision in zip(found, told, strict=True) if decision.joined])
        decisions.extend(told)
    return Merged(merging.map(), tuple(decisions))


def wished(decision: Decision, wishes: Sequence[Decision]) -> Decision:
    """A decision as the first wish about the same stretch has it."""
    wish = next((wish for wish in wishes if wish.about(decision)), None)
    return decision if wish is None else replace(decision, joined=wish.joined, why=wish.why)


class _Merging:
    """A map while places are taken out of one sequence or another; the last is the new one."""

    def __init__(self, map_: Map) -> None:
        self._names = map_.names
        self._held: list[ReferenceSequence | None] = list(map_.sequences)
        self._paths = list(map_.paths)

    def pair(self, number: int) -> tuple[ReferenceSequence, ReferenceSequence] | None:
        """The places that a sequence and the new one still hold; None if either holds nothing."""
        one, new = self._held[number], self._held[-1]
        return (one, new) if one and new else None

    def decision(self, number: int, overlap: Overlap) -> Decision:
        """The decision about an overlap, with the reasons for and against it."""
        ends = overlap.pairs[[0, -1]]
        first, second = self._views(number)[ends[:, 0]], self._views(len(self._held) - 1)[ends[:, 1]]
        told = ", ".join(f"{sensor} tells {nats:.2f}" for sensor, nats in overlap.told.items())
        why = overlap.objection or f"{len(overlap.pairs)} views lead to each other; {told} nats a view"
        spans = (int(first[0]), int(first[1])), (int(second[0]), int(second[1]))
        return Decision(self._names[number], self._names[-1], *spans, overlap.lengths, not overlap.objection, why)

    def unasked(self, number: int, wishes: Sequence[Decision], told: Sequence[Decision]) -> list[Decision]:
        """Wishes to join a sequence and the new one where nothing was found."""
        names = self._names[number], self._names[-1]
        ours = [wish for wish in wishes if (wish.one, wish.other) == names and wish.joined]
        return [wish for wish in ours if not any(wish.about(decision) for decision in told)]

    def overlap(self, number: int, wish: Decision) -> Overlap:
        """The stretches of a wish as an overlap: of equal lengths, as far as nobody can say better."""
        sides = []
        for sequence, (first, last) in ((number, wish.first), (len(self._held) - 1, wish.second)):
            held, views = self._held[sequence], self._views(sequence)
            places = np.flatnonzero((views >= first) & (views <= last))
            if held is None or not len(places):
                raise MapError(f"views {first} to {last} of {self._names[sequence]!r} are not there, or joined already")
            sides.append((places, held.along[places]))
        (ours, at), (theirs, along) = sides
        share = (at - at[0]) / max(float(np.ptp(at)), 1e-9)
        pairs = np.stack([ours, theirs[_nearest(along, along[0] + share * np.ptp(along))]], axis=1)
        return Overlap(pairs, (float(np.ptp(at)), float(np.ptp(along))), {})

    def join(self, number: int, overlaps: Sequence[Overlap]) -> None:
        """Take the overlaps of a sequence with the new one out of the longer of the two; of equal ones, the new one."""
        last = len(self._held) - 1
        shorter, longer, column = (number, last, 0) if self._length(last) >= self._length(number) else (last, number, 1)
        self._take(longer, shorter, [overlap.pairs if column == 0 else overlap.pairs[:, ::-1] for overlap in overlaps])

    def _take(self, longer: int, shorter: int, joints: Sequence[NDArray[np.intp]]) -> None:
        """Places of the longer sequence become those of the shorter; ``joints`` are pairs (shorter's, longer's)."""
        giving, keeping = self._held[longer], self._held[shorter]
        if not joints or giving is None or keeping is None:
            return
        stands_for = np.full(len(giving), -1)
        for pairs in joints:
            taken = np.arange(pairs[0, 1], pairs[-1, 1] + 1)
            at = np.interp(giving.along[taken], giving.along[pairs[:, 1]], keeping.along[pairs[:, 0]])
            stands_for[taken] = _nearest(keeping.along, at)
        kept = np.flatnonzero(stands_for < 0)
        self._held[longer] = reduced(giving, kept) if len(kept) else None
        number = np.full(len(giving), -1)
        number[kept] = np.arange(len(kept))
        self._paths = [_moved(path, longer, shorter, stands_for, number) for path in self._paths]

    def map(self) -> Map:
        """The map as it is now; sequences that hold nothing any more are left out."""
        left = [number for number, held in enumerate(self._held) if held]
        number = np.full(len(self._held), -1)
        number[left] = np.arange(len(left))
        return Map(
            names=tuple(self._names[n] for n in left),
            sequences=tuple(held for held in self._held if held),
            paths=tuple(replace(path, sequences=number[path.sequences]) for path in self._paths),
        )

    def _path(self, number: int) -> MapPath:
        return next(path for path in self._paths if path.name == self._names[number])

    def _length(self, number: int) -> int:
        return len(self._path(number))

    def _views(self, number: int) -> NDArray[np.intp]:
        """The number that each place which a sequence still holds had when it was learnt."""
        return np.flatnonzero(self._path(number).sequences == number)


def _nearest(along: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.intp]:
    """The places nearest to some distances, the first of equals."""
    return np.asarray(np.abs(along[None, :] - at[:, None]).argmin(axis=1))


def _moved(path: MapPath, giver: int, keeper: int, stands_for: NDArray[np.intp], number: NDArray[np.intp]) -> MapPath:
    """A path after some of the giver's places became the keeper's, and its others got new numbers."""
    there = path.sequences == giver
    old = path.places[there]
    gone = stands_for[old] >= 0
    sequences, places = path.sequences.copy(), path.places.copy()
    sequences[there] = np.where(gone, keeper, giver)
    places[there] = np.where(gone, stands_for[old], number[old])
    return replace(path, sequences=sequences, places=places)
