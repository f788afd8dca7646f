"""Ends of missions against the truth: standing at a place, looking another way there, being behind a door."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.missions.behaviour_codes import code_of, kind_of
from refseq.missions.language import BehaviourCode
from refseq.missions.plan import Plan
from refseq.missions.true_way import TrueWay
from refseq.planar import wrap
from refseq_bench.sim.envs.tasks.cross_door import OPEN, DoorwayPlace
from refseq_bench.sim.envs.tasks.reach_place import ARRIVED
from refseq_bench.sim.envs.tasks.task import Situation, TaskGround
from refseq_bench.sim.errors import SimError

WITHIN = 1.5
"""A behaviour that begins no farther than this from where it should is right [m]: the missions' score has the same."""
FACING = math.radians(15)
"""A robot that is to turn looks the right way within this [rad]: a choice."""
REACH = 3.0
"""A door that an order crosses is no farther than this from where the order begins [m]: a choice."""


@dataclass(frozen=True)
class MissionGoal(ABC):
    """End of a mission at a true ``place`` (2,) [m]."""

    place: NDArray[np.float64]

    @property
    def beyond(self) -> NDArray[np.float64]:
        """The way there behind the learnt path's end, (n, 2) [m]."""
        return np.zeros((0, 2))

    @abstractmethod
    def reached(self, situation: Situation) -> bool:
        """True if the mission is done."""

    def near(self, situation: Situation, within: float) -> bool:
        """True if the robot is within so much of the place [m]."""
        x, y = self.place
        return math.hypot(situation.pose.x - x, situation.pose.y - y) <= within


@dataclass(frozen=True)
class StandAt(MissionGoal):
    """Stand at a place, as near to it as the task to reach one asks for."""

    def reached(self, situation: Situation) -> bool:
        """True if the robot stands there."""
        return situation.stands and self.near(situation, ARRIVED)


@dataclass(frozen=True)
class FaceAt(MissionGoal):
    """Stand near a place and look in a direction, ``heading`` [rad]."""

    heading: float

    def reached(self, situation: Situation) -> bool:
        """True if the robot stands there and looks that way."""
        off = abs(wrap(situation.pose.heading - self.heading))
        return situation.stands and off <= FACING and self.near(situation, WITHIN)


@dataclass(frozen=True)
class BehindDoor(MissionGoal):
    """Be behind a ``doorway``, the tail ``far`` [m] behind its wall's face; the place is its middle."""

    doorway: DoorwayPlace
    far: float

    @property
    def beyond(self) -> NDArray[np.float64]:
        """Through the door's middle."""
        return np.array([self.doorway.middle, self.doorway.middle + self.far * self.doorway.through])

    def reached(self, situation: Situation) -> bool:
        """True if the robot is behind this door, and no other."""
        return self.doorway.is_behind(situation.pose, self.far)


def goal_of(plan: Plan, truth: TrueWay, ground: TaskGround) -> MissionGoal:
    """The end of a plan; raises ``SimError`` where it is behind a door that is shut."""
    last = plan.orders[-1]
    if last.travels:
        return StandAt(truth.position(plan.goal))
    code, _, angle = kind_of(last.behaviour).partition(":")
    if code == BehaviourCode.TURN:
        return FaceAt(truth.position(last.at), wrap(truth.pose(last.at).heading + math.radians(float(angle))))
    if code == BehaviourCode.CROSS_DOOR:
        doorway = doorway_near(ground, truth.position(last.at))
        if doorway is None:
            raise SimError(f"{last.why}: no door there is open in world {ground.plan.name!r}; valid is one that is")
        return BehindDoor(doorway.middle, doorway, doorway.deep + ground.shape.behind)
    raise SimError(f"{last.why}: ends with {code_of(last.behaviour)}; valid are MN, MW, MT, MC and MA straight on")


def doorway_near(ground: TaskGround, place: NDArray[np.float64]) -> DoorwayPlace | None:
    """The open door of the world that is nearest to a true place (2,) [m]; None where none is within ``REACH``."""
    doorways = [DoorwayPlace.of(ground.plan, door) for door in ground.plan.door if door.open >= OPEN]
    ahead = [one for one in doorways if (one.middle - place) @ one.through > 0]
    nearest = min(ahead, key=lambda one: math.dist(one.middle, place), default=None)
    return nearest if nearest is not None and math.dist(nearest.middle, place) <= REACH else None
