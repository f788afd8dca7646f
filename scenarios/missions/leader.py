"""Leaders of missions: the way that was learnt, its true places, and the localiser on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.routes import shortest_route
from refseq.belief import Belief, LocaliserProtocol, Stage
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.missions import TrueWay, path_along, path_of
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.by_name import is_staged
from refseq_bench.scenarios.methods.plugins import PluginLocaliser, is_plugin
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.merging import merged_drives

PROFILE = "best"
"""Whose map tells the way where a method has no profile: behaviours, doors and lengths are the same in all."""


@dataclass(frozen=True)
class Leader:
    """A method as a leader: the ground truth, and its localiser, None without one. ``map`` is what it keeps."""

    ground: TrueWay
    localiser: LocaliserProtocol | None
    map: Map


def along_reference(method: str, drive: Reference, *, localised: bool, seed: int) -> Leader:
    """Along one reference drive, from its start to its end."""
    map_ = drive.map(_profile(method))
    ground = TrueWay(path_along(map_), positions(drive.views))
    if not localised:
        return Leader(ground, None, map_)
    if is_staged(method):
        return Leader(ground, _staged(method, map_, seed), map_)
    return Leader(ground, _of_views(method, drive), map_)


@dataclass(frozen=True, slots=True)
class Journey:
    """Where to: to ``goal`` [m] along one of the drives, by its ``path``, None: to its end; from near ``start``."""

    start: Pose
    path: str
    goal: float | None
    merge: bool = True


def over_several(
    method: str, names: Sequence[str], drives: Sequence[Reference], journey: Journey, *, localised: bool, seed: int
) -> Leader:
    """Along the shortest route over several drives, merged into one map.

    It begins at the view nearest to the start that looks the same way: who sets the robot down says where. Raises
    ``MapError`` where no route leads to the goal.
    """
    maps = [drive.map(_profile(method)).named(name) for name, drive in zip(names, drives, strict=True)]
    map_, _ = merged_drives(maps, journey.merge)
    views = [drive.views for drive in drives]
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
        return Leader(ground, None, map_)
    if is_staged(method):
        return Leader(ground, _staged(method, map_, seed), map_)
    every = Reference([view for of_drive in views for view in of_drive])
    return Leader(ground, InPlaces(_of_views(method, every), held, len(map_)), map_)


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


def _staged(method: str, map_: Map, seed: int) -> Localiser:
    return Localiser(map_, stage=Stage(method.partition("/")[2]), seed=seed)


def _of_views(method: str, drive: Reference) -> LocaliserProtocol:
    return PluginLocaliser(method, drive.views) if is_plugin(method) else BASELINES[method](drive)


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
