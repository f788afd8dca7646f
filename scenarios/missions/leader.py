"""Leaders of missions: the way that was learnt, its true places, and the localiser on it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, LocaliserProtocol, Stage
from refseq.features.memory import clock
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.missions import TrueWay, path_along, path_of
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.names import is_staged
from refseq_bench.scenarios.methods.plugins import PluginLocaliser, is_plugin
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.merging import Merging, merged_drives

PROFILE = "best"
"""Whose map tells the way where a method has no profile: behaviours, doors and lengths are the same in all."""


@dataclass(frozen=True)
class KnownDrives:
    """The ``drives`` that a leader has learnt, the ``maps`` of each, and the ``map`` of all.

    ``merging`` tells how the maps became one, None where there is one that is as it was learnt.
    """

    drives: tuple[Reference, ...]
    maps: tuple[Map, ...]
    map: Map
    merging: Merging | None = None

    @classmethod
    def alone(cls, method: str, drive: Reference) -> Self:
        """One drive, as it was."""
        map_ = drive.map(_profile(method))
        return cls((drive,), (map_,), map_)

    @classmethod
    def merged(cls, method: str, drives: Mapping[str, Reference], merge: bool) -> Self:
        """Drives by name, merged into one map, or beside each other."""
        maps = tuple(drive.map(_profile(method)).named(name) for name, drive in drives.items())
        return cls(tuple(drives.values()), maps, *merged_drives(maps, merge))

    @property
    def views(self) -> list[Sequence[View]]:
        """The views of each drive."""
        return [drive.views for drive in self.drives]


@dataclass(frozen=True)
class Leader:
    """A method as a leader: the ground truth, and its localiser, None without one.

    ``learn_s`` [s] is what learning took beside the map's, and ``guest`` the user's localiser behind it, which has a
    process until it is closed.
    """

    ground: TrueWay
    localiser: LocaliserProtocol | None
    learn_s: float = 0.0
    guest: PluginLocaliser | None = None

    def close(self) -> None:
        """End the guest's process."""
        if self.guest is not None:
            self.guest.close()


def along_reference(method: str, known: KnownDrives, *, localised: bool, seed: int) -> Leader:
    """Along one reference drive, from its start to its end."""
    (drive,) = known.drives
    ground = TrueWay(path_along(known.map), positions(drive.views))
    return _leader(method, ground, known, seed) if localised else Leader(ground, None)


@dataclass(frozen=True, slots=True)
class Journey:
    """Where to: to ``goal`` [m] along one of the drives, by its ``path``, None: to its end; from near ``start``."""

    start: Pose
    path: str
    goal: float | None


def over_several(method: str, known: KnownDrives, journey: Journey, *, localised: bool, seed: int) -> Leader:
    """Along the shortest route over several drives, in one map.

    It begins at the view nearest to the start that looks the same way: who sets the robot down says where. Raises
    ``MapError`` where no route leads to the goal.
    """
    from refseq.atlas.routes import shortest_route  # graphs, which a single path does not need

    map_, views = known.map, known.views
    names = [path.name for path in map_.paths]
    number = names.index(journey.path)
    along = map_.paths[number].along
    last = len(along) - 1 if journey.goal is None else int(np.abs(along - journey.goal).argmin())
    held = _held(map_)
    goal = int(map_.numbered(map_.paths[number])[last])
    route = shortest_route(map_, int(held[_nearest(views, journey.start)]), goal)
    legs = [positions(views[names.index(leg.path)][leg.first : leg.last + 1]) for leg in route.legs]
    places = np.concatenate([leg[min(n, 1) :] for n, leg in enumerate(legs)]) if legs else _at(journey.start)
    ground = TrueWay(path_of(map_, route), places)
    if not localised:
        return Leader(ground, None)
    found = _leader(method, ground, known, seed)
    if is_staged(method) or found.localiser is None:
        return found
    return replace(found, localiser=InPlaces(found.localiser, held, len(map_)))


def _leader(method: str, ground: TrueWay, known: KnownDrives, seed: int) -> Leader:
    """A leader whose localiser answers in the map, or, where it is none of ours, in the views of all drives."""
    if is_staged(method):
        return Leader(ground, Localiser(known.map, stage=Stage(method.partition("/")[2]), seed=seed))
    first, *further = known.drives
    drive = Reference([view for views in known.views for view in views]) if further else first
    begin = clock()
    guest = PluginLocaliser(method, drive.views) if is_plugin(method) else None
    localiser = guest or BASELINES[method](drive)
    return Leader(ground, localiser, clock() - begin, guest)


class InPlaces:
    """A localiser that knows the views of several drives, one behind the other, answers in the places of their map.

    ``held`` (K,) is for each view the place that it is at, of so many.
    """

    def __init__(self, inner: LocaliserProtocol, held: NDArray[np.intp], places: int) -> None:
        self._inner, self._held, self._places = inner, held, places

    def reset(self) -> None:
        """Forget all views seen."""
        self._inner.reset()

    def update(self, view: View) -> Belief:
        """Answer with the belief of all views of a place summed up at the place."""
        belief = self._inner.update(view)
        path = tuple(int(self._held[view]) if view >= 0 else view for view in belief.path)
        lost_after = None if belief.lost_after is None else self._summed(belief.lost_after)
        best = int(self._held[belief.best])
        return replace(belief, places=self._summed(belief.places), best=best, path=path, lost_after=lost_after)

    def _summed(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.bincount(self._held, weights=shares, minlength=self._places).astype(np.float64)


def positions(views: Sequence[View]) -> NDArray[np.float64]:
    """True places of views, (n, 2) [m]. Raises ``ScenarioError`` where one is not known."""
    found = [(view.truth.x, view.truth.y) for view in views if view.truth is not None]
    if len(found) < len(views):
        raise ScenarioError("the reference does not know where it was; valid in a mission is a simulated drive")
    return np.array(found)


def _profile(method: str) -> str:
    return method.partition("/")[0] if is_staged(method) else PROFILE


def _held(map_: Map) -> NDArray[np.intp]:
    """For each view that was learnt, all drives' one behind the other, the place that it is at."""
    return np.concatenate([map_.numbered(path) for path in map_.paths])


def _nearest(drives: Sequence[Sequence[View]], start: Pose) -> int:
    """The view nearest to a pose, of those that look the same way, if any do."""
    truths = [view.truth for views in drives for view in views if view.truth is not None]
    apart = np.array([np.hypot(one.x - start.x, one.y - start.y) for one in truths])
    ahead = np.array([np.cos(one.heading - start.heading) > 0 for one in truths])
    return int(np.where(ahead if ahead.any() else True, apart, np.inf).argmin())


def _at(pose: Pose) -> NDArray[np.float64]:
    return np.array([[pose.x, pose.y]])
