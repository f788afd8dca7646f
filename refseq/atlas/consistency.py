"""Joins that must agree: which of many candidate joins, with the paths' own odometry, tell of one building.

A join says where two paths are to each other. Joins that close a loop can contradict each other; odometry says by how
much a loop may fail to close. Truncated least squares decide: a set of joins costs the squared errors of the pose graph
that it makes, and the evidence of each join that it leaves out. The set of the least cost does not depend on the order
in which paths or joins are named.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from refseq.planar import wrapped
from refseq.pose_graph import PoseFit, Relations, best_fit, motions_between, moved, ways_along


@dataclass(frozen=True, slots=True)
class ConsistencySettings:
    """Noise of odometry and of joins, and the price of a join.

    An odometer's scale is off by ``scale`` (a standard deviation), its heading drifts by ``drift`` [rad/√m] on its way
    and by ``turning`` [√rad] in turns, its way by ``slip`` [m/√m]. Two places that are one are ``apart`` [m] and
    ``askew`` [rad]: views are not taken at the same spots, and an alignment may slide by a place. A join counts as one
    relative pose every ``every`` [m]. Neighbouring views tell the same, so that its evidence is new every ``news`` [m]:
    leaving a join out costs twice that, as squared errors are twice a log-likelihood. A doubtful join may add errors of
    ``doubt`` times its price at most. One without which others could stand that make up for so much of its price needs
    ``odds`` against these. Joins whose stretches on one path are ``near`` each other [m] tell of one spot.
    A join that was looked for where others lay it adds squared errors of ``likely`` a relative pose at most, as 95 % of
    the right ones do (χ², three degrees of freedom).
    A doubtful loop, a join of a path with itself, needs odometry that tells where the path comes back within ``back``
    [m], a standard deviation: over the whole way round, or since a loop at another spot. More lets more loops stand.

    The noise is that of wheels on real logs (docs/atlas.md); where it is taken for greater, fewer false joins are
    contradicted.
    """

    scale: float = 0.05
    drift: float = 0.02
    turning: float = 0.05
    slip: float = 0.1
    apart: float = 0.8
    askew: float = 0.15
    every: float = 5.0
    news: float = 2.0
    doubt: float = 0.5
    odds: float = 20.0
    near: float = 10.0
    likely: float = 7.8
    back: float = 3.0


@dataclass(frozen=True, slots=True)
class LaidPairs:
    """Pairs of ``views`` (m, 2), and the ``motions`` (m, 3) from the one to the other by their scans."""

    views: NDArray[np.intp]
    motions: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CandidateJoin:
    """Places of path ``one`` that may be those of path ``other``: ``pairs`` (n, 2) of their views, rising in both.

    Both may be the same path, which then comes back to itself: a loop, its earlier view first.

    ``evidence`` is what its places tell for it: log-likelihood ratio times length [nats·m]. ``alone`` says that it
    needs no other join that supports it, ``held`` that it is given, and may not be left out. ``laid`` are relative
    poses by scans, where they are known; else views of a pair are taken to be at one spot.
    """

    one: int
    other: int
    pairs: NDArray[np.intp]
    evidence: float = 0.0
    alone: bool = True
    held: bool = False
    laid: LaidPairs | None = None

    @property
    def is_loop(self) -> bool:
        """True where a path comes back to itself."""
        return self.one == self.other


class Verdict(StrEnum):
    """Result of the search for one join."""

    AGREES = "agrees"
    CONTESTED = "contested"
    CONTRADICTED = "contradicted"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True)
class Layout:
    """Paths where joins put them: ``poses`` (V, 3) of each path's views, ``sigmas`` (V,) [m] how uncertain each is.

    Each group of paths that joins lead between has a frame of its own; ``groups`` number them, path for path. The
    uncertainty is that of odometry since the nearest join; 0 on a path that none leads to.
    """

    poses: tuple[NDArray[np.float64], ...]
    groups: tuple[int, ...]
    sigmas: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True)
class JoinGraph:
    """Paths by the odometry of their views, ``tracks`` (V, 3) each, and ``candidates`` to join them."""

    tracks: Sequence[NDArray[np.float64]]
    candidates: Sequence[CandidateJoin]
    settings: ConsistencySettings = field(default_factory=ConsistencySettings)

    @cached_property
    def _links(self) -> list["_Link"]:
        return [_link(one, self.tracks, self.settings) for one in self.candidates]

    def price(self, join: int) -> float:
        """Cost of leaving a join out: its evidence, that of a view every so many metres being new."""
        return 2 * self.candidates[join].evidence / self.settings.news

    def strain(self, join: int, joins: Iterable[int]) -> float:
        """Squared errors that a join of a set adds to it, as a share of its price."""
        return self._errors(join, joins) / max(self.price(join), 1e-9)

    def _errors(self, join: int, joins: Iterable[int]) -> float:
        """Squared errors that a join of a set adds to it."""
        every = frozenset(joins)
        return self.cost(every) - (self.cost(every - {join}) - self.price(join))

    def supported(self, joins: Iterable[int]) -> frozenset[int]:
        """Those of some joins that may stand alone, and those whose paths are joined without them all the same.

        Joins that meet at one stretch of a path tell of one spot, and support each other as little as one witness does
        who is asked twice: where a corridor is taken for its way back, all are wrong together. So support comes from
        joins at other spots, and from those that may stand alone. A loop begins and ends on one path, which any join
        would link to itself: its support is the odometry between its ends.
        """
        left = frozenset(joins)
        while True:
            spots = self._spots(left)
            kept = frozenset(n for n in left if self.candidates[n].alone or self._linked(n, left, spots))
            if kept == left:
                return left
            left = kept

    def _linked(self, join: int, joins: Iterable[int], spots: Mapping[int, int]) -> bool:
        """True where others than the doubtful joins of its spot lead from the one path of a join to the other."""
        others = [n for n in joins if n != join and (self.candidates[n].alone or spots[n] != spots[join])]
        if self.candidates[join].is_loop:
            return self._comes_back(join, others)
        graph = nx.Graph([self._ends(n) for n in others])
        one, other = self._ends(join)
        return one in graph and other in graph and nx.has_path(graph, one, other)

    def _comes_back(self, join: int, others: Iterable[int]) -> bool:
        """True where odometry tells where a loop ends: over its way, or from the ends of other loops of its path."""
        path = self.candidates[join].one
        first, second = self._middle(join)
        loops = [self._middle(n) for n in others if self._ends(n) == (path, path)]
        way = min([second - first, *(abs(first - one) + abs(second - other) for one, other in loops)])
        return float(self._drift(path, np.array([way]))[0]) <= self.settings.back

    def _middle(self, join: int) -> tuple[float, float]:
        """Ways along its paths to the middle of a join [m]."""
        middle = self.candidates[join].pairs[len(self.candidates[join].pairs) // 2]
        one, other = (float(self._ways[path][view]) for path, view in zip(self._ends(join), middle, strict=True))
        return one, other

    def _ends(self, join: int) -> tuple[int, int]:
        return self.candidates[join].one, self.candidates[join].other

    def _spots(self, joins: Iterable[int]) -> dict[int, int]:
        """Number of the spot that each join tells of: joins whose stretches on one path are ``near`` each other."""
        graph = nx.Graph()
        by_path: dict[int, list[tuple[float, float, int]]] = {}
        for n in sorted(joins):
            graph.add_node(n)
            for path, column in zip(self._ends(n), (0, 1), strict=True):
                ways = self._ways[path][self.candidates[n].pairs[:, column]]
                by_path.setdefault(path, []).append((float(ways.min()), float(ways.max()), n))
        for stretches in by_path.values():
            last, reach = None, -np.inf
            for start, end, n in sorted(stretches):
                if last is not None and start - reach < self.settings.near:
                    graph.add_edge(last, n)
                last, reach = n, max(reach, end)
        return {n: number for number, part in enumerate(nx.connected_components(graph)) for n in part}

    @cached_property
    def _ways(self) -> list[NDArray[np.float64]]:
        return [ways_along(track) for track in self.tracks]

    def verdicts(self) -> tuple[Verdict, ...]:
        """Which candidates agree, are contested or contradicted by others, or lack support."""
        agreed = self.agreeing()
        doubtful = [n for n in agreed if not self.candidates[n].alone]
        strained = [n for n in doubtful if self.strain(n, agreed) > self.settings.doubt]
        contested = [n for n in agreed.difference(strained) if self.is_contested(n, agreed)]
        supported = self.supported(agreed.difference(strained, contested))
        found = [Verdict.CONTRADICTED] * len(self.candidates)
        for n in contested:
            found[n] = Verdict.CONTESTED
        for n in agreed.difference(strained, contested):
            found[n] = Verdict.AGREES if n in supported else Verdict.UNSUPPORTED
        return tuple(found)

    def is_contested(self, join: int, joins: frozenset[int]) -> bool:
        """True for a join of the best set that another set, without it, comes near to.

        Of two wings that are alike a path fits both. Which of the two a few views' words prefer is chance; what stands
        by it would be wrong with it.
        """
        if join in self._held or len(joins) == len(self.candidates):
            return False
        behind = self._without(join).cost - self.cost(joins)
        return behind < min(self.settings.doubt * self.price(join), 2 * math.log(self.settings.odds))

    def agreeing(self) -> frozenset[int]:
        """Numbers of the joins that cost least together.

        From those that are given, each join is added that lowers the cost, long ones first. Such a search may take a
        wrong join, and then refuse right ones one by one; so each join that was added is forbidden in turn, and what
        comes then is kept where it costs less.
        """
        best, tried = self._grown(frozenset()), set[int]()
        while suspects := [n for n in self._order() if n in best.joins - self._held - tried]:
            if len(best.joins) == len(self.candidates):
                break
            suspect = suspects[0]
            tried.add(suspect)
            other = self._grown(frozenset(), self._without(suspect))
            if _ranked(other) < _ranked(best):
                best, tried = other, set()
        return best.joins

    def _without(self, join: int) -> "_State":
        """The set that is grown where one join is forbidden."""
        if join not in self._forbidden:
            self._forbidden[join] = self._grown(frozenset([join]))
        return self._forbidden[join]

    @cached_property
    def _forbidden(self) -> dict[int, "_State"]:
        return {}

    @cached_property
    def _held(self) -> frozenset[int]:
        return frozenset(n for n, one in enumerate(self.candidates) if one.held)

    def _order(self) -> list[int]:
        return sorted(range(len(self.candidates)), key=lambda n: (-self.price(n), self._links[n].key))

    def _grown(self, banned: frozenset[int], begin: "_State | None" = None) -> "_State":
        """A set of joins with each more that lowers the cost, but those that are banned."""
        state = begin or self._state(self._held)
        for join in self._order():
            if join in banned or join in state.joins:
                continue
            grown = self._state(state.joins | {join})
            if grown.cost < state.cost:
                state = grown
        return state

    def _state(self, joins: frozenset[int]) -> "_State":
        return _State(joins, self.cost(joins))

    def cost(self, joins: frozenset[int]) -> float:
        """Squared errors of some joins, and the evidence of all others."""
        left_out = sum(self.price(n) for n in range(len(self.candidates)) if n not in joins)
        return left_out + sum(self._component(part).cost for part in self._components(joins))

    def _components(self, joins: Iterable[int]) -> list[frozenset[int]]:
        graph = nx.Graph()
        for number in joins:
            link = self._links[number]
            graph.add_edges_from([(("path", link.one), ("join", number)), (("path", link.other), ("join", number))])
        return [frozenset(n for kind, n in part if kind == "join") for part in nx.connected_components(graph)]

    @cached_property
    def _known(self) -> dict[frozenset[int], "_Component"]:
        return {}

    def _component(self, joins: frozenset[int]) -> "_Component":
        if joins not in self._known:
            self._known[joins] = self._solved(joins)
        return self._known[joins]

    def _solved(self, joins: frozenset[int]) -> "_Component":
        """Least squares over the knots that some joins have on their paths."""
        links = [self._links[n] for n in sorted(joins, key=lambda n: self._links[n].key)]
        knots = _Knots(self.tracks, links)
        relations = knots.odometry(self.settings).beside(knots.joints(links, self.settings))
        fit = best_fit(relations, knots.start(links), held=[0], scale_sigma=self.settings.scale)
        cost = float(fit.squares.sum() + np.square(fit.scales / self.settings.scale).sum())
        return _Component(cost, fit, knots)

    def layout(self, joins: Iterable[int]) -> Layout:
        """Where some joins put the paths; a path that none leads to stays where its odometry begins."""
        some, poses = frozenset(joins), list(self.tracks)
        sigmas = [np.zeros(len(track)) for track in self.tracks]
        for part in self._components(some):
            whole = self._component(part)
            for path in whole.knots.paths:
                poses[path] = whole.path(path, self.tracks[path])
                sigmas[path] = self._drifted(path, whole.knots.views[path])
        groups = _groups(len(self.tracks), [self._links[n] for n in some])
        return Layout(tuple(poses), groups, tuple(sigmas))

    def _drifted(self, path: int, knots: NDArray[np.intp]) -> NDArray[np.float64]:
        """Standard deviation of each view's position [m] by odometry from the knots beside it, (V,).

        A way that is held at either end drifts as one of the product of both ways over their sum (Brownian bridge).
        """
        ways = self._ways[path]
        at = ways[knots]
        before = np.clip(np.searchsorted(at, ways, side="right") - 1, 0, len(at) - 1)
        behind, ahead = np.abs(ways - at[before]), np.abs(at[np.minimum(before + 1, len(at) - 1)] - ways)
        bridged = behind * ahead / np.maximum(behind + ahead, 1e-9)
        way = np.where((ways > at[0]) & (ways < at[-1]), bridged, np.minimum(behind, ahead))
        return self._drift(path, way)

    def _drift(self, path: int, way: NDArray[np.float64]) -> NDArray[np.float64]:
        """Standard deviation of a position [m] by a path's odometry after some ways [m], by its turns on average."""
        settings = self.settings
        turned = np.abs(wrapped(np.diff(self.tracks[path][:, 2]))).sum() / max(self._ways[path][-1], 1e-9)
        heading = np.hypot(settings.drift, settings.turning * np.sqrt(turned)) * np.sqrt(way)
        return np.asarray(np.hypot(settings.slip * np.sqrt(way), heading * way / np.sqrt(3)))

    def extended(self, agreed: Iterable[int], more: Iterable[int]) -> frozenset[int]:
        """Joins that agree, and those of some more that strain them little, each with all before it.

        The one that costs most to leave out comes first. It is for joins that were looked for where these lay them.
        What they tell is told against places beside them, so that their errors are judged by themselves.
        """
        joins, left = frozenset(agreed), frozenset(more)
        for join in (n for n in self._order() if n in left):
            if not self.is_strained(join, joins | {join}):
                joins |= {join}
        return joins

    def is_strained(self, join: int, joins: Iterable[int]) -> bool:
        """True for a join of a set that adds more squared errors to it than right ones do."""
        return self._errors(join, joins) > self.settings.likely * len(self._links[join].views)


@dataclass(frozen=True, slots=True)
class _State:
    joins: frozenset[int]
    cost: float


def _ranked(state: _State) -> tuple[float, list[int]]:
    return round(state.cost, 6), sorted(state.joins)


@dataclass(frozen=True, slots=True)
class _Link:
    """A join as relative poses: views of one path and of the other, and the ``motions`` between them."""

    one: int
    other: int
    views: NDArray[np.intp]
    motions: NDArray[np.float64]

    @property
    def key(self) -> tuple[float, ...]:
        """An order of joins that is the same however paths are numbered, but for paths that are equal."""
        return tuple(np.round(self.motions, 9).ravel().tolist())


def _link(join: CandidateJoin, tracks: Sequence[NDArray[np.float64]], settings: ConsistencySettings) -> _Link:
    """One relative pose every few metres: by scans, or the mean of the pairs around it, carried there by odometry."""
    if join.laid is not None:
        return _Link(join.one, join.other, join.laid.views, join.laid.motions)
    one, other = (tracks[path][join.pairs[:, column]] for column, path in ((0, join.one), (1, join.other)))
    way = float(np.hypot(*np.diff(one[:, :2], axis=0).T).sum())
    count = min(len(join.pairs), max(1, round(way / settings.every)))
    middles, motions = [], []
    for part in np.array_split(np.arange(len(join.pairs)), count):
        middle = part[len(part) // 2]
        at_middle = moved(motions_between(one[middle], one[part]), motions_between(other[part], other[middle]))
        turn = wrapped(at_middle[:, 2])
        mean = np.arctan2(np.sin(turn).mean(), np.cos(turn).mean())
        middles.append(middle)
        motions.append([*at_middle[:, :2].mean(axis=0), mean])
    return _Link(join.one, join.other, join.pairs[middles], np.array(motions))


class _Knots:
    """The views of paths that some joins meet, numbered through."""

    def __init__(self, tracks: Sequence[NDArray[np.float64]], links: Sequence[_Link]) -> None:
        self.tracks = tracks
        found: dict[int, set[int]] = {}
        for link in links:
            for column, path in ((0, link.one), (1, link.other)):
                found.setdefault(path, set()).update(link.views[:, column].tolist())
        self.paths = list(found)
        self.views = {path: np.array(sorted(found[path])) for path in self.paths}
        ends = np.cumsum([0, *(len(self.views[path]) for path in self.paths)])
        self.first = dict(zip(self.paths, ends[:-1].tolist(), strict=True))
        self.count = int(ends[-1])

    def number(self, path: int, views: NDArray[np.intp]) -> NDArray[np.intp]:
        """Numbers of the knots at views of a path."""
        return np.asarray(self.first[path] + np.searchsorted(self.views[path], views), np.intp)

    def odometry(self, settings: ConsistencySettings) -> Relations:
        """Ways by odometry from knot to knot."""
        every = Relations.of([], [], 1.0)
        for number, path in enumerate(self.paths):
            views, track = self.views[path], self.tracks[path]
            at, knots = track[views], self.number(path, views)
            steps = ways_along(track)
            turns = np.cumsum([0.0, *np.abs(wrapped(np.diff(track[:, 2])))])
            way, turn = np.maximum(np.diff(steps[views]), 0.1), np.diff(turns[views])
            heading = np.hypot(settings.drift * np.sqrt(way), settings.turning * np.sqrt(turn))
            # Heading that drifts along the way carries its end aside.
            aside = np.hypot(settings.slip * np.sqrt(way), heading * way / np.sqrt(3))
            sigmas = np.column_stack([settings.slip * np.sqrt(way), aside, heading])
            motions = motions_between(at[:-1], at[1:])
            every = every.beside(Relations.of(np.column_stack([knots[:-1], knots[1:]]), motions, sigmas, number))
        return every

    def joints(self, links: Sequence[_Link], settings: ConsistencySettings) -> Relations:
        """Ways by the joins."""
        pairs = [
            np.column_stack([self.number(link.one, link.views[:, 0]), self.number(link.other, link.views[:, 1])])
            for link in links
        ]
        sigmas = (settings.apart, settings.apart, settings.askew)
        return Relations.of(np.concatenate(pairs), np.concatenate([link.motions for link in links]), sigmas)

    def start(self, links: Sequence[_Link]) -> NDArray[np.float64]:
        """Poses to begin with: paths as odometry has them, each laid where the first join that leads to it says."""
        frames = {self.paths[0]: np.zeros(3)}  # where each path's origin is
        while len(frames) < len(self.paths):
            for link in links:
                for (path, column), (other, its), forward in (
                    ((link.one, 0), (link.other, 1), True),
                    ((link.other, 1), (link.one, 0), False),
                ):
                    if path in frames and other not in frames:
                        middle = len(link.views) // 2
                        motion = link.motions[middle]
                        across = motion if forward else motions_between(motion, np.zeros(3))
                        there = moved(moved(frames[path], self.tracks[path][link.views[middle, column]]), across)
                        own = self.tracks[other][link.views[middle, its]]
                        frames[other] = moved(there, motions_between(own, np.zeros(3)))
        return np.concatenate([moved(frames[path], self.tracks[path][self.views[path]]) for path in self.paths])


@dataclass(frozen=True, slots=True)
class _Component:
    """Paths that joins lead between, and where least squares put their knots."""

    cost: float
    fit: PoseFit
    knots: _Knots

    def path(self, path: int, track: NDArray[np.float64]) -> NDArray[np.float64]:
        """Poses of all views of a path: odometry from knot to knot, and what does not close spread over the way."""
        views = self.knots.views[path]
        at = self.fit.poses[self.knots.number(path, views)]
        steps = ways_along(track)
        every = np.arange(len(track))
        before = np.clip(np.searchsorted(views, every, side="right") - 1, 0, len(views) - 1)
        after = np.clip(before + 1, 0, len(views) - 1)
        one = moved(at[before], motions_between(track[views[before]], track[every]))
        other = moved(at[after], motions_between(track[views[after]], track[every]))
        gap = np.maximum(steps[views[after]] - steps[views[before]], 1e-9)
        share = np.clip((steps[every] - steps[views[before]]) / gap, 0.0, 1.0)[:, None]
        difference = other - one
        difference[:, 2] = wrapped(difference[:, 2])
        return np.asarray(one + share * difference)


def _groups(paths: int, links: Iterable[_Link]) -> tuple[int, ...]:
    graph = nx.Graph()
    graph.add_nodes_from(range(paths))
    graph.add_edges_from((link.one, link.other) for link in links)
    number = {path: n for n, part in enumerate(nx.connected_components(graph)) for path in part}
    return tuple(number[path] for path in range(paths))
