"""A mission in the plan: the way with its steps, where the robot is and where it believes to be, and what it sees."""

from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.planar import Pose, in_world
from refseq.viewer.drawing.colours import BELIEVED, DIM, REFERENCE, SCAN, TEXT, TRUTH
from refseq.viewer.drawing.plane import ROBOT, circle, north_up, returns
from refseq.viewer.drawing.trail import Trail
from refseq.viewer.mission.record import Instant, LocalisedView, MissionRecord
from refseq.viewer.scene import Extent

ORIGIN = "mission/plan"
UNDER = 10.0
"""Draw order below all lines."""
CLOSE = 1.0
"""Steps that are nearer to each other along the way [m] have one label."""
LIKELY = 0.001
"""Places that are less likely do not glow."""


@dataclass(frozen=True)
class MissionPlan:
    """The plan of a ``record``; there is none where neither the way's places nor the robot's poses are known."""

    record: MissionRecord

    @property
    def extent(self) -> Extent | None:
        """The part of the world that is shown."""
        places = [Pose(float(x), float(y), 0.0) for x, y in self.record.places]
        return Extent.around([*places, *(instant.truth for instant in self.record.instants)])

    def view(self, extent: Extent) -> rrb.View:
        """The panel."""
        name = "plan [m]: grey the way and its steps, blue the robot, orange where it believes to be"
        return rrb.Spatial2DView(origin=ORIGIN, name=name, visual_bounds=extent.bounds)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log what does not change."""
        record = self.record
        if record.outline:
            walls = [north_up(line) for line in record.outline]
            stream.log(f"{ORIGIN}/outline", rr.LineStrips2D(walls, colors=DIM, radii=-0.6), static=True)
        if not len(record.places):
            return
        way = north_up(record.places)
        stream.log(f"{ORIGIN}/way", rr.LineStrips2D([way], colors=REFERENCE, radii=-1.5), static=True)
        spots, labels = zip(*self._steps(), strict=True)
        steps = rr.Points2D(spots, labels=labels, show_labels=True, colors=TEXT, radii=-4.0)
        stream.log(f"{ORIGIN}/steps", steps, static=True)

    def _steps(self) -> list[tuple[NDArray[np.float64], str]]:
        """Positions and labels of the orders' begins and of the goal; those close together share a label."""
        plan = self.record.plan
        orders = [(order.at, f"{number}: {order.behaviour}") for number, order in enumerate(plan.orders, 1)]
        found: list[tuple[float, str]] = []
        for at, text in [*orders, (plan.goal, "goal")]:
            if found and at - found[-1][0] < CLOSE:
                found[-1] = found[-1][0], f"{found[-1][1]}, {text}"
            else:
                found.append((at, text))
        return [(self._spot(at), text) for at, text in found]

    def send_instant(self, stream: rr.RecordingStream, instant: Instant) -> None:
        """Log the robot, and the place that it believes in."""
        if instant.truth is not None:
            shape = north_up(in_world(ROBOT, instant.truth))
            stream.log(f"{ORIGIN}/robot", rr.LineStrips2D([shape], colors=TRUTH, radii=-1.5))
        if len(self.record.places):
            ring = circle(0.6) + self._spot(instant.along)
            stream.log(f"{ORIGIN}/believed", rr.LineStrips2D([ring], colors=BELIEVED, radii=-1.5))

    def send_view(self, stream: rr.RecordingStream, seen: LocalisedView, trail: Trail) -> None:
        """Log the scan, the probability of each place of the way, and the path so far."""
        pose = seen.instant.truth
        if pose is not None:
            scan = north_up(in_world(returns(seen.view), pose))
            stream.log(f"{ORIGIN}/scan", rr.Points2D(scan, colors=SCAN, radii=-0.8))
            stream.log(f"{ORIGIN}/path", rr.LineStrips2D([north_up(trail.points)], colors=TRUTH, radii=-0.6))
        if len(self.record.places):
            belief = seen.belief
            shares = (1 - belief.lost) * belief.places[self.record.plan.path.places]
            likely = shares > LIKELY
            sizes = 0.08 + 0.5 * np.sqrt(shares[likely])
            dots = rr.Points2D(
                north_up(self.record.places[likely]), colors=[(*BELIEVED, 180)], radii=sizes, draw_order=UNDER
            )
            stream.log(f"{ORIGIN}/likely", dots)

    def _spot(self, along: float) -> NDArray[np.float64]:
        """The place so far along the way, as it is drawn; beyond its ends it is the end."""
        at = self.record.plan.path.along
        x, y = (np.interp(along, at, self.record.places[:, axis]) for axis in (0, 1))
        return north_up(np.array([[x, y]])).reshape(2)
