"""The task to go through an open door."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.task import Episode, Situation, Task, TaskGround
from refseq_bench.sim.errors import SimError
from refseq_bench.worlds.plans.frame import LocalFrame, left_of
from refseq_bench.worlds.plans.schema import Door, FloorPlan

OPEN = 80.0
"""A door that is open by less [deg] is none to go through; a choice."""
NEAR, FAR, ASIDE, TURNED = 1.5, 2.0, 0.4, math.radians(25)
"""Starts are between so far before a door, so far beside its axis, and turned from it [m, m, m, rad].

From there the behaviour that crosses doors was measured."""

BESIDE = 1.5
"""Behind a wall but farther beside its door's axis than this [m], a robot is not behind that door; a choice.

A robot that is through has room to turn within it; a larger one would take in what came round the wall."""


@dataclass(frozen=True, slots=True)
class DoorwayPlace:
    """An open door: ``middle`` (2,) [m] of its opening, ``through`` (2,) the way one goes, ``deep`` its wall [m]."""

    middle: NDArray[np.float64]
    through: NDArray[np.float64]
    deep: float

    @classmethod
    def of(cls, plan: FloorPlan, door: Door) -> "DoorwayPlace":
        """The doorway of a plan's door, as one goes from the side that its wall's face is on."""
        wall = plan.wall_named(door.wall)
        frame = LocalFrame.of(wall)
        return cls(frame.point(door.at, 0.0, 0.0)[:2], -frame.inward, wall.thickness)

    def start(self, before: float, aside: float, turned: float) -> Pose:
        """A pose ``before`` it, ``aside`` to the left of its axis, ``turned`` to the left from it [m, m, rad]."""
        x, y = self.middle - before * self.through + aside * left_of(self.through)
        return Pose(float(x), float(y), math.atan2(self.through[1], self.through[0]) + turned)

    def seen_from(self, pose: Pose) -> tuple[float, float]:
        """Distances of a pose behind the wall's face and beside the door's axis [m, m]."""
        offset = np.array([pose.x, pose.y]) - self.middle
        behind = float(offset @ self.through)
        return behind, float(abs(self.through[0] * offset[1] - self.through[1] * offset[0]))

    def is_behind(self, pose: Pose, far: float) -> bool:
        """True if a pose is ``far`` behind the wall's face [m] or farther, and behind this door, not beside it."""
        behind, aside = self.seen_from(pose)
        return behind >= far and aside <= BESIDE


class ThroughDoor(Episode):
    """Reward: the metres by which the way to the other side has become shorter since the last step.

    That way leads straight to the door's middle and on until the robot's tail is out of the wall: there is the goal.
    """

    def __init__(self, doorway: DoorwayPlace, start: Pose, tail: float) -> None:
        self.start = start
        self._doorway, self._far = doorway, doorway.deep + tail

    def remaining(self, situation: Situation) -> float:
        """The way to the other side [m]."""
        behind, aside = self._doorway.seen_from(situation.pose)
        return math.hypot(min(behind, 0.0), aside) + self._far - min(max(behind, 0.0), self._far)

    def reached(self, situation: Situation) -> bool:
        """True if the robot's tail is out of the wall, behind this door."""
        return self._doorway.is_behind(situation.pose, self._far)


class CrossDoorTask(Task):
    """Stand before an open door and go through it without touching it."""

    behaviours = ("MC:ahead", "MC:left", "MC:right", "MN:1000", "MT:45", "MT:-45", "stop")

    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Begin before one of the plan's open doors."""
        doors = [door for door in ground.plan.door if door.open >= OPEN]
        if not doors:
            raise SimError(f"world {ground.plan.name!r} has no door that is open by {OPEN:g} degrees or more")
        doorway = DoorwayPlace.of(ground.plan, doors[rng.integers(len(doors))])
        before, aside, turned = rng.uniform((NEAR, -ASIDE, -TURNED), (FAR, ASIDE, TURNED))
        return ThroughDoor(doorway, doorway.start(before, aside, turned), ground.shape.behind)
