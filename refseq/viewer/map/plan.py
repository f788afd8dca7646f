"""The paths of a map in the plan: filled where a path holds its places, hollow where another path does."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.map.map import Map
from refseq.planar import Pose, in_world
from refseq.viewer.drawing.colours import BELIEVED, DIM, TRUTH
from refseq.viewer.drawing.plane import ROBOT, circle, north_up
from refseq.viewer.map.marks import of_path

ASIDE = 0.35
"""Distance to the right at which each further path is drawn [m]; at 0 they hide each other."""
AROUND = 2.0
"""The plan goes so far beyond the paths [m]."""
LIKELY = 0.001
"""Places that are less likely do not glow."""
UNDER = 10.0
"""Draw order below all lines."""
ORIGIN = "map/paths/plan"


@dataclass(frozen=True)
class PathsPlan:
    """The plan of a ``map`` whose places' true poses are known, otherwise there is none, with an ``outline`` [m]."""

    map: Map
    outline: Sequence[NDArray[np.float64]] = ()

    @cached_property
    def _lanes(self) -> list[NDArray[np.float64]]:
        """For each path where its views are drawn, (K, 2), not a number where the pose of the place is not known."""
        lanes = []
        for number, path in enumerate(self.map.paths):
            poses = self._poses[self.map.numbered(path)]
            right = poses[:, 2] - np.pi / 2
            shift = ASIDE * number * np.stack([np.cos(right), np.sin(right)], axis=1)
            lanes.append(north_up(poses[:, :2] + shift))
        return lanes

    @cached_property
    def _poses(self) -> NDArray[np.float64]:
        """Pose of each place, (K, 3)."""
        nowhere = (np.nan,) * 3
        return np.array([(p.x, p.y, p.heading) if p else nowhere for p in self.map.poses]).reshape(-1, 3)

    @property
    def known(self) -> bool:
        """True where there is a plan."""
        return bool(np.isfinite(self._poses).any())

    @property
    def _extent(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        spots = np.concatenate(self._lanes)
        return np.nanmin(spots, axis=0) - AROUND, np.nanmax(spots, axis=0) + AROUND

    @property
    def aspect(self) -> float:
        """Width over height."""
        low, high = self._extent
        return float(np.divide(*(high - low)))

    def view(self, *, moving: bool) -> rrb.View:
        """The panel; ``moving`` when a robot is on it."""
        low, high = self._extent
        bounds = rrb.VisualBounds2D(x_range=[low[0], high[0]], y_range=[low[1], high[1]])
        name = "plan [m]: a dot a place, a ring a view whose place another path holds"
        if moving:
            name = "plan [m]: dots places, rings shared views, blue the robot, orange the belief"
        return rrb.Spatial2DView(origin=ORIGIN, name=name, visual_bounds=bounds)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log what does not change."""
        if not self.known:
            return
        if self.outline:
            walls = [north_up(line) for line in self.outline]
            stream.log(f"{ORIGIN}/outline", rr.LineStrips2D(walls, colors=DIM, radii=-0.6), static=True)
        for number, lane in enumerate(self._lanes):
            colour, mine = of_path(number), self._own(number)
            stream.log(
                f"{ORIGIN}/paths/{number}", rr.LineStrips2D(list(_runs(lane)), colors=colour, radii=-0.5), static=True
            )
            dots = lane[mine & np.isfinite(lane[:, 0])]
            stream.log(f"{ORIGIN}/places/{number}", rr.Points2D(dots, colors=colour, radii=-2.5), static=True)
            rings = [circle(0.22) + spot for spot in lane[~mine & np.isfinite(lane[:, 0])]]
            if rings:
                stream.log(f"{ORIGIN}/shared/{number}", rr.LineStrips2D(rings, colors=colour, radii=-0.5), static=True)

    def send_pose(self, stream: rr.RecordingStream, pose: Pose | None) -> None:
        """Log the robot's true pose."""
        if not self.known:
            return
        shape = [] if pose is None else [north_up(in_world(ROBOT, pose))]
        stream.log(f"{ORIGIN}/robot", rr.LineStrips2D(shape, colors=TRUTH, radii=-1.5))

    def send_belief(self, stream: rr.RecordingStream, belief: Belief) -> None:
        """Places that are likely, the larger the likelier, and a ring around the best."""
        if not self.known:
            return
        shares = (1 - belief.lost) * belief.places
        glowing = np.flatnonzero((shares > LIKELY) & np.isfinite(self._poses[:, 0]))
        spots = north_up(self._poses[glowing, :2])
        sizes = 0.1 + 0.7 * np.sqrt(shares[glowing])
        stream.log(f"{ORIGIN}/likely", rr.Points2D(spots, colors=[(*BELIEVED, 150)], radii=sizes, draw_order=UNDER))
        best = self._poses[belief.best]
        rings = [circle(0.9) + north_up(best[None, :2])] if np.isfinite(best[0]) else []
        stream.log(f"{ORIGIN}/best", rr.LineStrips2D(rings, colors=BELIEVED, radii=-1.2))

    def _own(self, number: int) -> NDArray[np.bool_]:
        """Mark the views of a path that hold their place themselves."""
        path = self.map.paths[number]
        return np.array([self.map.names[sequence] == path.name for sequence in path.sequences])


def _runs(lane: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """The pieces of a line between which nothing is known."""
    there = np.isfinite(lane[:, 0])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]])))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield lane[start:stop]
