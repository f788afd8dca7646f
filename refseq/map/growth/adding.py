"""Adding a drive to a map: what was not recognised well becomes a further experience of its place."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import way_along
from refseq.errors import MapError
from refseq.fault import CLOCK, ODOMETRY
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.intake import check_motions, each_view, usable
from refseq.map.extractors import make_extractor
from refseq.map.growth.astray import Astray, AstraySettings, astray
from refseq.map.growth.experiences import FIRST, Experiences
from refseq.map.growth.record import AddedDrive, digest_of
from refseq.map.growth.seen import SeenView, lost_in_hindsight, seen_drive
from refseq.map.map import Map, check_is_map
from refseq.map.matcher import Features
from refseq.map.poses_beside import ALIKE, PosesBeside
from refseq.map.reduction import without_unseen
from refseq.map.sequence import ReferenceSequence
from refseq.view import View

ROBOT = "robot"
"""Key of a drive's metadata that names its robot."""
FEWEST = 4
"""Fewer scans tell nothing of a drive's walls."""
LONG, STEP = 15.0, 3.0
"""An odometer's scale is told by so many metres of a path at least, in steps of at most so many each [m]."""


@dataclass(frozen=True, slots=True)
class GrowthSettings:
    """Rules of what is kept of a drive.

    A view is *placed* where the probability in hindsight of being within ``near`` [m] of its best place is at least
    ``sure``. It was recognised well where it found that by itself with at least ``well``, and the views up to it
    together with at least ``sure``. A drive of less than ``least`` [m], or of which less than the share ``placed`` of
    the views is placed, is refused; so is one of which less than the share ``walls`` of the placed views shows the
    walls of their places, where the map keeps scans. A place has at most ``most`` further experiences.
    """

    near: float = 1.5
    sure: float = 0.9
    well: float = 0.5
    placed: float = 0.25
    walls: float = 0.6
    least: float = 3.0
    most: int = 3

    def __post_init__(self) -> None:
        """Raise ``MapError`` for shares and ways that are none, and for less than one experience a place."""
        for name in ("sure", "well", "placed", "walls"):
            if not 0 <= (share := getattr(self, name)) <= 1:
                raise MapError(f"{name} is {share}; valid is a share from 0 to 1")
        for name in ("near", "least"):
            if not 0 <= (way := getattr(self, name)) < math.inf:
                raise MapError(f"{name} is {way}; valid are metres, 0 or more")
        if not isinstance(self.most, Integral) or self.most < 1:
            raise MapError(f"{self.most} experiences of a place are to be kept; valid is a whole number from 1")


@dataclass(frozen=True)
class Grown:
    """A map after a drive was added: how many of its ``views`` were ``placed``, and which were ``kept``.

    ``kept`` are pairs of a view and its place, counted through all sequences. Of the experiences before, ``forgotten``
    made room. ``known`` is True where the drive had been added before: the map is then the one that it was. The drive's
    odometer showed ``stretch`` metres for each of the map's, nan where it came too little along a path to tell.
    """

    map: Map
    drive: AddedDrive
    placed: int = 0
    kept: tuple[tuple[int, int], ...] = ()
    forgotten: int = 0
    known: bool = False
    stretch: float = np.nan
    astray: tuple[Astray, ...] = ()


def add_drive(
    map_: Map,
    views: Iterable[View],
    *,
    name: str = "",
    metadata: Mapping[str, str] | None = None,
    settings: GrowthSettings | None = None,
    seed: int = 0,
) -> Grown:
    """Let a map grow by a later drive along its paths; the map given stays as it is.

    Views that were not recognised well become further experiences of the places that they were taken at, as far as the
    whole drive tells. ``metadata`` are the drive's: where they name another robot than the map's, it is refused. A
    drive that was added before changes nothing.

    Raises ``MapError`` for a map whose matching is not by log ratios, for a drive of another robot, one that lacks a
    sensor of the map, is too short, or is hardly recognised anywhere, and ``ViewError`` for views that are not usable.
    """
    rules, drive = settings or GrowthSettings(), list(each_view(views))
    check_map(map_)
    check_drive(map_, drive, metadata or {}, rules)
    digest = digest_of(drive)
    if (known := map_.grown.drive(digest)) is not None:
        return Grown(map_, known, known=True)
    seen = seen_drive(map_, drive, seed)
    placed = _placed(map_, seen, rules)
    if len(placed) < rules.placed * len(drive):
        raise MapError(
            f"the drive has {len(drive)} views, of which {len(placed)} are found on the map; valid is a drive along "
            f"its paths of which at least {rules.placed:.0%} are, in light that is not too far from what it knows"
        )
    _check_walls(map_, drive, placed, rules)
    kept = _worth_keeping(placed)
    growth = [
        _grown(sequence, first, drive, placed, kept, rules.most)
        for sequence, first in zip(map_.sequences, map_.first[:-1].tolist(), strict=True)
    ]
    added = AddedDrive(name, digest, len(drive), len(kept))
    record = replace(map_.grown, drives=(*map_.grown.drives, added))
    larger = replace(map_, sequences=tuple(one.sequence for one in growth), grown=record)
    pairs = tuple((view.number, view.place) for view in kept)
    forgotten = sum(one.forgotten for one in growth)
    off = astray(drive, lost_in_hindsight(seen), AstraySettings())
    return Grown(larger, added, len(placed), pairs, forgotten, False, _stretch(map_, drive, placed), tuple(off))


def check_map(map_: Map) -> None:
    """Raise ``MapError`` for a map that cannot have further experiences, or is none."""
    check_is_map(map_)
    if not map_.profile.by_log_ratios:
        matching = map_.profile.method.matching
        raise MapError(f"its matching is {matching}, which takes no further experiences; valid is a map learnt as best")


def check_drive(map_: Map, views: Sequence[View], metadata: Mapping[str, str], rules: GrowthSettings) -> None:
    """Raise ``MapError`` for a drive that no place of the map can learn from."""
    ours, theirs = map_.metadata.get(ROBOT, ""), str(metadata.get(ROBOT, ""))
    if ours and theirs and theirs not in ours.split(", "):
        raise MapError(f"the drive is of robot {theirs}; valid is that of the map, {ours}")
    there = frozenset[str]().union(*(view.sensors for view in views))
    if missing := sorted(map_.sensors - there):
        raise MapError(
            f"the drive has no {missing[0]}; valid are drives with all sensors of the map, "
            f"{', '.join(sorted(map_.sensors))}"
        )
    check_motions(views)
    length = float(way_along(views)[-1])
    if length < rules.least:
        count = f"{len(views)} view{'s' * (len(views) != 1)}"
        raise MapError(f"the drive has {count} over {length:.1f} m; valid is a way of {rules.least:g} m")


def _check_walls(map_: Map, drive: Sequence[View], placed: Sequence["_PlacedView"], rules: GrowthSettings) -> None:
    """Raise ``MapError`` for a drive between other walls: to words a corridor looks like one of another building."""
    poses = PosesBeside(map_)
    lying = []
    for view in placed:
        poses.take(drive[view.number].scan)
        if poses.sees and poses.shown(view.place):
            [fit] = poses.fits([view.place])
            lying.append(fit is not None and fit.share >= ALIKE)
    if len(lying) >= FEWEST and np.mean(lying) < rules.walls:
        raise MapError(
            f"the drive has {len(drive)} views, of which {len(placed)} look like places of it, but {sum(lying)} of "
            f"{len(lying)} lie on their walls; valid is a drive along its paths of which {rules.walls:.0%} do at least"
        )


@dataclass(frozen=True, slots=True)
class _PlacedView:
    """A view of the drive by its number, and its place, counted through; ``sure`` [0, 1] of being there."""

    number: int
    place: int
    sure: float
    well: bool


def _placed(map_: Map, seen: Sequence[SeenView], rules: GrowthSettings) -> list[_PlacedView]:
    """Views whose place is known in hindsight; those with a faulty sensor of the map's teach nothing."""
    near, asked = _Nearness(map_, rules.near), {*map_.sensors, ODOMETRY, CLOCK}
    found = []
    for number, view in enumerate(seen):
        place = int(np.argmax(view.hindsight))
        around = near.places(place)
        sure = float(view.hindsight[around].sum())
        if sure >= rules.sure and not any(fault.sensor in asked for fault in view.faults):
            alone, online = float(view.alone[around].sum()), float(view.online[around].sum())
            well = alone >= rules.well and online >= rules.sure
            found.append(_PlacedView(number, place, float(view.hindsight[place]), well))
    return found


def _stretch(map_: Map, drive: Sequence[View], placed: Sequence[_PlacedView]) -> float:
    """Metres of the drive's odometer for each of the map's, from placed view to placed view along one path.

    It is the median over pieces of ``LONG`` metres without steps on which the odometer jumps: that is no scale.
    """
    ways = way_along(drive)
    along = [dict(zip(map_.numbered(path).tolist(), path.along.tolist(), strict=True)) for path in map_.paths]
    scales, ours, theirs = list[float](), 0.0, 0.0
    for one, other in pairwise(placed):
        on = next((at for at in along if one.place in at and other.place in at), None)
        if on is not None and 0 <= (step := on[other.place] - on[one.place]) <= STEP:
            way = float(ways[other.number] - ways[one.number])
            if way > 2 * STEP:
                continue
            ours, theirs = ours + step, theirs + way
            if ours >= LONG:
                scales.append(theirs / ours)
                ours, theirs = 0.0, 0.0
    return float(np.median(scales)) if scales else np.nan


@dataclass
class _Nearness:
    """Places of a map that lie within some metres of each other along any path, and those that are one with them."""

    map: Map
    metres: float
    _found: dict[int, NDArray[np.intp]] = field(default_factory=dict)

    def places(self, place: int) -> NDArray[np.intp]:
        """Places around one, itself among them."""
        if place not in self._found:
            near = [np.array([place])]
            for path in self.map.paths:
                numbered = self.map.numbered(path)
                here = path.along[numbered == place]
                near += [numbered[np.abs(path.along - at) <= self.metres] for at in here]
            self._found[place] = self.map.with_twins(np.concatenate(near))
        return self._found[place]


def _worth_keeping(placed: Sequence[_PlacedView]) -> list[_PlacedView]:
    """Views that were not recognised well, one a place: the one most surely there, the first of equals."""
    best: dict[int, _PlacedView] = {}
    for view in placed:
        if not view.well and (view.place not in best or view.sure > best[view.place].sure):
            best[view.place] = view
    return sorted(best.values(), key=lambda view: view.number)


@dataclass(frozen=True)
class _GrownSequence:
    """A sequence after a drive, and how many experiences were forgotten for it."""

    sequence: ReferenceSequence
    forgotten: int


def _grown(
    sequence: ReferenceSequence,
    first: int,
    drive: Sequence[View],
    placed: Sequence[_PlacedView],
    kept: Sequence[_PlacedView],
    most: int,
) -> _GrownSequence:
    """A sequence after a drive; its places are counted from ``first`` on."""
    sequence = _used(sequence, first, drive, placed)
    own = [view for view in kept if first <= view.place < first + len(sequence)]
    if not own:
        return _GrownSequence(sequence, 0)
    places = np.array([view.place - first for view in own])
    larger = _with(sequence, [drive[view.number] for view in own], places)
    left = _remembered(larger.experiences, most) if larger.experiences is not None else np.zeros(0, np.intp)
    forgotten = len(larger.experiences or ()) - len(left)
    if forgotten and larger.experiences is not None:
        larger = replace(larger, experiences=larger.experiences.chosen(left))
    return _GrownSequence(without_unseen(larger), forgotten)


def _used(
    sequence: ReferenceSequence, first: int, drive: Sequence[View], placed: Sequence[_PlacedView]
) -> ReferenceSequence:
    """Count for each place where a view was recognised well the experience that knew it best, once a drive.

    Of a view that nothing knew some experience is the best too, by chance.
    """
    experiences, ratios = sequence.experiences, sequence.layered_ratios
    if experiences is None or ratios is None:
        return sequence
    known, used = set(experiences.places.tolist()), np.zeros(len(experiences), np.bool_)
    for view in placed:
        place = view.place - first
        if view.well and place in known:
            best = ratios.best(_recognised(sequence, drive[view.number]), place)
            used[best] |= best != FIRST
    return replace(sequence, experiences=replace(experiences, uses=experiences.uses + used))


def _recognised(sequence: ReferenceSequence, view: View) -> Features:
    plain = usable(view)
    return {e.key: e.recognise(e.describe(plain)) for e in sequence.extractors if e.sensor in plain.sensors}


def _with(sequence: ReferenceSequence, views: Sequence[View], places: NDArray[np.intp]) -> ReferenceSequence:
    """The sequence with views as further experiences of its places; what is new in them becomes new features."""
    extractors = tuple(
        make_extractor(e.key, sequence.profile, {name: array.copy() for name, array in e.state().items()})
        for e in sequence.extractors
    )
    columns = [{e.key: e.learn(view) for e in extractors if e.sensor in view.sensors} for view in map(usable, views)]
    sizes = {e.key: e.size for e in extractors}
    before, unused = sequence.experiences, np.zeros(len(places), np.intp)
    if before is None:
        new = Experiences(IncidenceMatrix.from_columns(columns, sizes), places, unused)
    else:
        matrix = before.matrix.appended(columns, sizes)
        new = Experiences(matrix, np.append(before.places, places), np.append(before.uses, unused))
    return replace(sequence, matrix=sequence.matrix.appended([], sizes), extractors=extractors, experiences=new)


def _remembered(experiences: Experiences, most: int) -> NDArray[np.intp]:
    """Numbers of those that stay: where a place has more than ``most``, the newest, and of the others the most used.

    Of equally used ones the later stays.
    """
    stays = np.ones(len(experiences), np.bool_)
    for place in np.unique(experiences.places):
        *old, newest = np.flatnonzero(experiences.places == place).tolist()
        ranked = sorted(old, key=lambda number: (experiences.uses[number], number), reverse=True)
        stays[ranked[most - 1 :]] = False
        stays[newest] = True
    return np.flatnonzero(stays)
