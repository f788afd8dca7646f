"""Tasks apart from any simulation: where an episode begins, and what each moment of it is worth.

Nothing here knows Gymnasium or a bench. Whoever runs robots, one or many at once, asks a task for an episode and tells
it after every step what is true.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.missions.path import MissionPath
from refseq.missions.plan import Plan
from refseq.planar import Pose
from refseq_bench.robots.robot import Shape
from refseq_bench.sim.bench.polyline import Polyline
from refseq_bench.sim.drives.view_spacing import LEARNT_EVERY
from refseq_bench.worlds.plans.schema import FloorPlan

SUCCESS, FAILURE = 5.0, -5.0
"""Reward of the end of an episode, beside the way that was made good: choices."""


@dataclass(frozen=True)
class TaskGround:
    """Where a task is set: the floor ``plan``, the ``route`` (n, 2) [m], the robot's ``shape``.

    ``places`` (K, 2) [m] is where the places of the reference sequence truly are, ``learnt`` what the map itself knows
    of the way along them; both are None without a map.
    """

    plan: FloorPlan
    route: NDArray[np.float64]
    shape: Shape
    places: NDArray[np.float64] | None = None
    learnt: MissionPath | None = None

    @cached_property
    def way(self) -> Polyline:
        """The way along the route."""
        return Polyline(self.route)

    @cached_property
    def path(self) -> Polyline:
        """The way from place to place of the reference sequence."""
        assert self.places is not None, "tasks with a map are given its places"
        return Polyline(self.places)


@dataclass(frozen=True, slots=True)
class Situation:
    """True situation of a robot: where it is, whether it ``touches`` anything but the floor, why it goes no more.

    ``down`` is one line, empty while all is well. ``belief`` is the localiser's, where the task has one. ``behaviour``
    is the one that was chosen last, empty with other actions; ``stands`` tells whether the robot does.
    """

    pose: Pose
    touches: bool = False
    down: str = ""
    belief: Belief | None = None
    behaviour: str = ""
    stands: bool = False


@dataclass(frozen=True, slots=True)
class Looking:
    """Rhythm of the localiser's views: each ``distance`` [m], each ``turn`` [rad], None: turns do not count.

    With ``standing`` it is also given one after each action that leaves the robot standing.
    """

    distance: float = LEARNT_EVERY
    turn: float | None = math.pi / 4
    standing: bool = False


@dataclass(frozen=True, slots=True)
class AskedOrder:
    """A task's order from a place of the map on: ``at`` [m along its path] the robot is to do ``behaviour``."""

    at: float
    behaviour: str


@dataclass(frozen=True, slots=True)
class Judgement:
    """Reward of a step, and whether the episode has ended in ``success`` or in a ``failure`` (one line or empty).

    ``remaining`` is how far the goal still is, in the task's own measure.
    """

    reward: float
    remaining: float
    success: bool = False
    failure: str = ""

    @property
    def over(self) -> bool:
        """True if the episode has ended."""
        return self.success or bool(self.failure)


class Episode(ABC):
    """One try. The reward of a step is by how much ``remaining`` has become less, and ``SUCCESS`` or ``FAILURE``.

    So the sum of all rewards is what was made good from begin to end, whatever was done in between, and the end's worth
    (a potential in the sense of Ng, Harada and Russell 1999). Touching anything, tipping over and a stop that somebody
    would have to release are failures.
    """

    start: Pose
    """Where the robot is set down."""
    goal: int | None = None
    """The place of the reference sequence to go to, if any."""
    led: tuple[float, float] | None = None
    """From where to where along the route [m] the robot is led before it is carried to the start, if it is."""
    plan: Plan | None = None
    """Orders of a mission, where there is one."""
    asked: tuple[AskedOrder, ...] = ()
    """Orders along the path, where the task gives them place by place."""

    def begin(self, situation: Situation) -> float:
        """Look at the robot before its first step; returns what remains."""
        self._remaining = self.remaining(situation)
        return self._remaining

    def judge(self, situation: Situation) -> Judgement:
        """Judge the step that has led to a situation."""
        before, self._remaining = self._remaining, self.remaining(situation)
        failure = situation.down or ("collision" if situation.touches else "")
        success = not failure and self.reached(situation)
        end = SUCCESS if success else FAILURE if failure else 0.0
        reward = before - self._remaining + end - self.fee(situation)
        return Judgement(reward, self._remaining, success, failure)

    def fee(self, situation: Situation) -> float:
        """Reward that is taken away for the step; called once a step, after ``remaining`` and ``reached``."""
        return 0.0

    @property
    def told(self) -> Mapping[str, Any]:
        """Further entries of ``info``; the same keys each time."""
        return {}

    @abstractmethod
    def remaining(self, situation: Situation) -> float:
        """Distance to the goal in the task's measure; called once a step."""

    @abstractmethod
    def reached(self, situation: Situation) -> bool:
        """True if the goal has been reached; called after ``remaining``."""


class Task(ABC):
    """A kind of episodes.

    ``behaviours`` are what there is to choose from, as they are written; ``mapped`` says whether a localiser runs
    along, ``goes_to_place`` whether an episode's goal is a place of its map, ``asks`` whether it tells what it asks for
    along the path, ``turns`` whether the robot is to have room for a turn on the spot where it is set down.
    ``route`` is the one that is taken where none is asked for, if the world has it. ``looking`` is when the localiser
    gets a view. ``keywords`` are those of ``gym.make`` that the class itself takes.
    """

    behaviours: tuple[str, ...]
    mapped: bool = False
    goes_to_place: bool = False
    asks: bool = False
    turns: bool = False
    route: str = "forward"
    looking: Looking = Looking()
    keywords: tuple[str, ...] = ()

    def check(self, ground: TaskGround) -> None:
        """Raise ``SimError`` for a ground on which no episode can be drawn; called once for a task with a map."""
        self.episode(ground, np.random.default_rng(0))

    @abstractmethod
    def episode(self, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Draw an episode; raises ``SimError`` where the ground has no room for the task."""
