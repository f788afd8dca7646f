"""One episode of a task on a bench of its own: setting the robot down, an action after the other, what is true then."""

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np

from refseq.map.map import Map
from refseq.missions.path import path_along
from refseq.planar import Pose, relative_pose, wrap
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.robots.robot import Shape
from refseq_bench.robots.state import LATCHED
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.contacts import ContactLog
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_runner import senses_of
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.recorder import operator_for
from refseq_bench.sim.envs.episodes.actions import Acting, periods
from refseq_bench.sim.envs.episodes.localising import Following, places_of
from refseq_bench.sim.envs.episodes.validation import (
    checked_episode,
    checked_judgement,
    checked_remaining,
    lies_in,
)
from refseq_bench.sim.envs.tasks.task import Episode, Judgement, Situation, Task, TaskGround
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.physics import Due
from refseq_bench.worlds.build import World
from refseq_bench.worlds.plans.schema import FloorPlan

SETTLING = 10
"""Control periods that a robot stands before its first observation, until all sonars have fired once."""
TRIES = 100
"""Starts that are drawn before a world is taken to have no room for the task."""
TURNS = tuple(np.radians(np.arange(15, 360, 15)).tolist())
"""Where a robot has room at all of these headings it can turn about itself [rad]; 15° apart, by choice."""
LEAD_TIME = 60.0
"""The robot is led for no longer than this [s]; where it cannot get on it is carried off from there."""


@dataclass(frozen=True, slots=True)
class EpisodeSetting:
    """Settings shared by all episodes in a world: world, robot's name, bench's settings, route, map."""

    world: World
    robot: str
    settings: BenchSettings
    route: str
    map: Map | None = None


class BenchEpisode:
    """A robot at the start of an episode of ``task``, all drawn from ``rng``; ``close`` it in the end.

    Raises ``SimError`` where the world has no room for the task.
    """

    def __init__(self, task: Task, setting: EpisodeSetting, rng: np.random.Generator) -> None:
        robot = robots.load(setting.robot)
        self.bench = Bench(
            setting.world, robot, route=setting.route, seed=int(rng.integers(2**32)), settings=setting.settings
        )
        self._looking, self.behaviour = task.looking, ""
        self.motion = (0.0, 0.0, 0.0)
        """Motion that the odometer counted in the last action, in the robot's frame at its begin [m, m, rad]."""
        self.outcome, self.why = BehaviourOutcome.RUNNING, ""
        """Outcome of the last action, and why."""
        self.touches = False
        """True if the robot touched anything in the last action."""
        try:
            self._contacts = ContactLog(self.bench)
            ground = ground_of(setting.world.plan, setting.route, robot.shape, setting.map)
            self.episode = self._with_room(task, ground, rng)
            self.following = self._led(setting.map)
            self.remaining = checked_remaining(self.episode, self.episode.begin(self.situation))
        except BaseException:
            self.bench.close()  # nobody else holds it yet
            raise

    def _with_room(self, task: Task, ground: TaskGround, rng: np.random.Generator) -> Episode:
        """Draw episodes until the robot has room where one begins, and stands there."""
        for _ in range(TRIES):
            episode = checked_episode(task, task.episode(ground, rng))
            turns = (*TURNS, 0.0) if task.turns else (0.0,)
            if lies_in(ground.plan, episode.start) and all(self._has_room(episode.start, turn) for turn in turns):
                return episode
        raise SimError(
            f"world {ground.plan.name!r} has no room for {self.bench.robot.name!r} at any of {TRIES} starts that were "
            f"drawn, the last at {episode.start}; valid is a world or a route with more"
        )

    def _has_room(self, start: Pose, turned: float) -> bool:
        """True if the robot has room where it is set down, turned by so much; it stands there then."""
        self.bench.place(Pose(start.x, start.y, start.heading + turned))
        return self._contacts.has_room

    def _led(self, map_: Map | None) -> Following | None:
        """Let the robot come to its start and stand, with a localiser that has followed it from where it was led."""
        if map_ is None:
            self._stand()
            return None
        if self.episode.led is None:
            self._stand()
            return Following(map_, self.bench, self._looking)
        following = self._lead(map_, *self.episode.led)
        self.bench.place(self.episode.start)
        self._stand()
        following.look()
        return following

    def _lead(self, map_: Map, begin: float, end: float) -> Following:
        operator = operator_for(self.bench, 0, OperatorStyle(strength=0.0))
        self.bench.place(operator.carried(begin))
        following, until = Following(map_, self.bench, self._looking), self.bench.time + LEAD_TIME
        while operator.progress < end and not operator.finished and self.bench.time < until:
            self.bench.drive(operator.command(self.bench.time, self.bench.pose))
            following.after_period()
        return following

    def _stand(self) -> None:
        for _ in range(SETTLING):
            self.bench.drive(Twist())

    @property
    def situation(self) -> Situation:
        """The truth now; touches are those since the last action began."""
        belief = None if self.following is None else self.following.belief
        return Situation(self.bench.pose, self.touches, self._down, belief, self.behaviour, self.bench.state.stands)

    @property
    def _down(self) -> str:
        """Why the robot goes no more until somebody helps it; empty while it does."""
        latched = next((stop.cause.value for stop in self.bench.state.stops if stop.cause in LATCHED), "")
        return self.bench.fault or latched

    def acting(self, acting: Acting) -> Generator[Due, None, Judgement]:
        """Go on until the action's time is up, it has ended, or something is touched; returns what that was worth.

        Steps of the physics are left to the caller, who takes each that is due.
        """
        before = self.bench.odometry
        self.touches, self.behaviour = False, acting.behaviour
        for _ in range(periods(acting, CONTROL_PERIOD)):
            step = acting.step(senses_of(self.bench))
            yield from self.bench.driving(step.twist)
            if self.following is not None:
                self.following.after_period()
            self.touches = bool(self._contacts.look())
            if self.touches or self._down or step.outcome is not BehaviourOutcome.RUNNING:
                break
        self.outcome, self.why = step.outcome, step.why
        self.motion = _motion(before, self.bench.odometry)
        if self.following is not None and self._looking.standing and self.bench.state.stands:
            self.following.look()
        judged = checked_judgement(self.episode, self.episode.judge(self.situation))
        self.remaining = judged.remaining
        return judged

    def close(self) -> None:
        """Give the bench back."""
        self.bench.close()


def ground_of(plan: FloorPlan, route: str, shape: Shape, map_: Map | None) -> TaskGround:
    """Ground of a task in a world, with what is known of its map."""
    points = np.array(plan.routes[route], np.float64)
    if map_ is None:
        return TaskGround(plan, points, shape)
    way = path_along(map_)
    # Actions are said by the task: those that are derived from a drive that was led, with its walls, are none of them.
    return TaskGround(plan, points, shape, places_of(map_), replace(way, behaviours=("",) * len(way.places)))


def _motion(before: Pose, after: Pose) -> tuple[float, float, float]:
    """Motion from one pose to another in the first one's frame [m, m, rad]."""
    motion = relative_pose(after, before)
    return motion.x, motion.y, wrap(motion.heading)
