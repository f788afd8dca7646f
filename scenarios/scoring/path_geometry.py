"""Geometry of reference paths: distances, projections, and places within a tolerance of a pose."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.frames import FramePose


class LengthUnit(StrEnum):
    """Unit of lengths along reference paths: metres, or pictures where places are numbered and nothing is measured."""

    METRES = "m"
    FRAMES = "frames"


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Greatest error of a right answer: ``distance`` [``unit``] and ``heading`` [rad], both above 0 and inclusive."""

    distance: float = 1.5
    heading: float = math.radians(30)
    unit: LengthUnit = LengthUnit.METRES

    def __post_init__(self) -> None:
        if not (self.distance > 0 and self.heading > 0):
            raise ScenarioError(f"tolerance {self.distance} m, {self.heading} rad: valid are positive numbers")

    @property
    def label(self) -> str:
        """The distance in words: ``1.5 m``, ``1 frame``."""
        one = self.unit is LengthUnit.FRAMES and self.distance == 1
        return "1 frame" if one else f"{self.distance:g} {self.unit}"


WIDE = Tolerance()
"""The tolerance of the headline figures: 1.5 m and 30°."""

NARROW = Tolerance(0.5)
"""Printed beside it, always."""


class ReferencePath:
    """The true poses of a reference drive as a path: ``size`` K places, ``along`` (K,) [m] from the first known pose.

    The path runs straight from each known pose to the next. A place without a pose has ``along`` nan and is near to
    nothing; a path of which no pose is known is not ``known``, and nobody can be judged by it. Several drives are
    ``stretches`` of the views, each a path of its own; ``along`` goes on from one to the next without a gap.
    """

    def __init__(self, views: Sequence[View], stretches: Sequence[slice] | None = None) -> None:
        poses = [view.truth for view in views]
        table = [(pose.x, pose.y, pose.heading) if pose else (math.nan,) * 3 for pose in poses]
        self.size = len(table)
        self.points: NDArray[np.float64] = np.array(table).reshape(-1, 3)[:, :2]
        self.headings: NDArray[np.float64] = np.array(table).reshape(-1, 3)[:, 2]
        self._known = np.flatnonzero(np.isfinite(self.headings))
        self.known = len(self._known) > 0
        self.stretches = tuple(stretches or (slice(0, self.size),))
        self._drive: NDArray[np.intp] = np.repeat(
            range(len(self.stretches)), [s.stop - s.start for s in self.stretches]
        )
        self._joined = np.diff(self._drive[self._known]) == 0
        steps = np.where(self._joined, np.linalg.norm(np.diff(self.points[self._known], axis=0), axis=1), 0.0)
        self.along: NDArray[np.float64] = np.full(self.size, math.nan)
        self.along[self._known] = np.concatenate([[0.0], np.cumsum(steps)])[: len(self._known)]

    def within(self, pose: Pose | None, tolerance: Tolerance) -> NDArray[np.bool_]:
        """Mark the places within the tolerance of a pose, (K,); none when it is not known."""
        if pose is None:
            return np.zeros(self.size, dtype=bool)
        near = np.hypot(*(self.points - (pose.x, pose.y)).T) <= tolerance.distance
        if isinstance(pose, FramePose) and pose.right is not None:
            near &= np.isin(self.points[:, 0], list(pose.right))
        return near & (angle_between(self.headings, pose.heading) <= tolerance.heading)

    def near(self, views: Sequence[View], tolerance: Tolerance) -> NDArray[np.bool_]:
        """Mark the places within the tolerance of each view's true pose, (M, K)."""
        return np.array([self.within(view.truth, tolerance) for view in views]).reshape(len(views), self.size)

    def apart(self, place: int, pose: Pose) -> float:
        """Straight distance of a place from a pose [m]; nan where it is not known."""
        return math.hypot(*(self.points[place] - (pose.x, pose.y)))

    def nearest(self, pose: Pose | None, among: slice | None = None) -> int | None:
        """Find the place nearest to a pose, among those that look the same way (within 90°), else among all.

        Only those of a stretch are looked at, if one is given.
        """
        if pose is None:
            return None
        distances = np.full(self.size, np.nan)
        distances[among or slice(None)] = np.hypot(*(self.points - (pose.x, pose.y)).T)[among or slice(None)]
        same_way = np.isfinite(distances) & (angle_between(self.headings, pose.heading) < math.pi / 2)
        candidates = np.where(same_way if same_way.any() else True, distances, np.nan)
        return None if np.isnan(candidates).all() else int(np.nanargmin(candidates))

    def pose(self, place: int) -> Pose | None:
        """The true pose of a place, None where it is not known."""
        x, y = self.points[place]
        return None if math.isnan(x) else Pose(float(x), float(y), float(self.headings[place]))

    def drive(self, place: int) -> int:
        """The number of the drive that a place is on."""
        return int(self._drive[place])

    def beside(self, place: int) -> slice:
        """The places of the drive that a place is on."""
        return self.stretches[self.drive(place)]

    def nearest_beside(self, place: int, pose: Pose | None, near: NDArray[np.bool_]) -> int | None:
        """Of the drive that a place is on the place nearest to a pose; None where none of it is among the ``near``.

        Where there is but one drive, it is simply the nearest.
        """
        own = self.beside(place)
        astray = len(self.stretches) > 1 and not near[own].any()
        return None if astray else self.nearest(pose, own)

    def error(self, place: int, pose: Pose, *, astray: bool) -> float:
        """From a pose to a place [m]: along the drive that the place is on, or straight, if that is ``astray``."""
        if astray:
            return self.apart(place, pose)
        return float(self.along[place] - self.project(pose, self.beside(place)))

    def project(self, pose: Pose, among: slice | None = None) -> float:
        """Distance along the path [m] of its point nearest to a pose, on stretches driven the same way if any.

        Only the places of a stretch are looked at, if one is given.
        """
        inside = self._joined.copy()
        if among is not None:
            inside &= (self._known[:-1] >= among.start) & (self._known[1:] < among.stop)
        starts, ends = self._known[:-1][inside], self._known[1:][inside]
        if not len(starts):
            return float(self.along[self.nearest(pose, among) or self._known[0]])
        leg = self.points[ends] - self.points[starts]
        length = np.linalg.norm(leg, axis=1)
        offset = np.array([pose.x, pose.y]) - self.points[starts]
        share = np.clip(np.einsum("ij,ij->i", offset, leg) / np.maximum(length, 1e-12) ** 2, 0, 1)
        miss = np.linalg.norm(offset - share[:, None] * leg, axis=1)
        same_way = angle_between(self.headings[starts], pose.heading) < math.pi / 2
        leg_number = int(np.argmin(np.where(same_way, miss, np.inf) if same_way.any() else miss))
        return float(self.along[starts[leg_number]] + share[leg_number] * length[leg_number])


class RememberedPath(ReferencePath):
    """A reference path that works out once what is asked of a pose, for all methods that are judged by it.

    What it answers must not be changed; it is kept as long as the path is.
    """

    def __init__(self, views: Sequence[View], stretches: Sequence[slice] | None = None) -> None:
        super().__init__(views, stretches)
        self._within: dict[tuple[Pose | None, Tolerance], NDArray[np.bool_]] = {}
        self._nearest: dict[tuple[Pose | None, tuple[int, int] | None], int | None] = {}
        self._projected: dict[tuple[Pose, tuple[int, int] | None], float] = {}

    def within(self, pose: Pose | None, tolerance: Tolerance) -> NDArray[np.bool_]:
        """Mark the places within the tolerance of a pose, (K,), read-only."""
        key = pose, tolerance
        if key not in self._within:
            self._within[key] = super().within(pose, tolerance)
            self._within[key].setflags(write=False)
        return self._within[key]

    def nearest(self, pose: Pose | None, among: slice | None = None) -> int | None:
        """Find the place nearest to a pose, as a path does."""
        key = pose, _ends(among)
        if key not in self._nearest:
            self._nearest[key] = super().nearest(pose, among)
        return self._nearest[key]

    def project(self, pose: Pose, among: slice | None = None) -> float:
        """Distance along the path of its point nearest to a pose [m], as of a path."""
        key = pose, _ends(among)
        if key not in self._projected:
            self._projected[key] = super().project(pose, among)
        return self._projected[key]


def _ends(stretch: slice | None) -> tuple[int, int] | None:
    """A stretch by its ends: a slice has no hash."""
    return None if stretch is None else (stretch.start, stretch.stop)


def path_of(comparison: Comparison) -> ReferencePath:
    """The path, or the paths, of what was learnt; not ``known`` where no pose is."""
    return ReferencePath(comparison.reference_views, comparison.stretches)


def remembered_path_of(comparison: Comparison) -> RememberedPath:
    """The same, to judge several methods by."""
    return RememberedPath(comparison.reference_views, comparison.stretches)


def angle_between(headings: NDArray[np.float64], heading: float) -> NDArray[np.float64]:
    """Size of the turn between headings, (K,), in [0, π] [rad]."""
    turn = np.abs(headings - heading) % (2 * math.pi)
    return np.minimum(turn, 2 * math.pi - turn)
