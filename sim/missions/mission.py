"""Running a mission on a bench: views are localised on the way, and the executor's behaviours steer the robot."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.missions.behaviour_codes import lengthened, travels
from refseq.missions.executor import Do, Executor
from refseq.missions.log import Touch
from refseq.missions.lookout import Lookout
from refseq.missions.tasks import Call, Photograph, Task
from refseq.view import View
from refseq_bench.robots import Twist
from refseq_bench.robots.behaviours import BehaviourOutcome
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.rest import come_to_rest
from refseq_bench.sim.drives.behaviour_runner import RunningBehaviour, behaviour_in, description_of, senses_of
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.drives.view_spacing import CLOSER, LOOKING, MISSION_EVERY
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.missions.touches import TouchLog


class ViewLocaliser(Protocol):
    """A localiser that answers to views on the way."""

    def update(self, view: View) -> Belief:
        """Take the next view and answer."""


@dataclass(frozen=True, slots=True)
class MissionView:
    """A view on the way: when [s], the true pose and what was believed; images are gone."""

    view: View
    belief: Belief


@dataclass(frozen=True)
class DrivenMission:
    """Record of a mission that was driven.

    ``track`` (n, 5) holds, each control period: time [s], true x, y [m], heading [rad], and where the robot believed
    itself to be [m along its way]. ``switches`` are the orders that were begun: number and time [s]. ``touches`` are
    the first ones of each thing that the robot touched.
    """

    executor: Executor
    track: NDArray[np.float64]
    seen: tuple[MissionView, ...]
    touches: tuple[Touch, ...]
    photographs: Mapping[str, Mapping[str, NDArray[np.uint8]]]

    @property
    def touched(self) -> tuple[str, ...]:
        """The names of the things that the robot touched."""
        return tuple(touch.thing for touch in self.touches)


@dataclass
class Hands:
    """Tasks that a robot carries out: photographs are kept, calls are passed on."""

    calls: Mapping[str, Callable[[View], None]] = field(default_factory=dict)
    photographs: dict[str, Mapping[str, NDArray[np.uint8]]] = field(default_factory=dict)

    def do(self, task: Task, view: View) -> None:
        """Do a task at a view that was just taken."""
        if isinstance(task, Photograph):
            self.photographs[task.name] = view.images
        elif isinstance(task, Call):
            self.calls[task.name](view)


def run_mission(
    bench: Bench,
    executor: Executor,
    localiser: ViewLocaliser | None,
    *,
    trigger: Trigger | None = None,
    calls: Mapping[str, Callable[[View], None]] | None = None,
    each: Callable[[Executor, Bench], None] | None = None,
) -> DrivenMission:
    """Run a mission until it is over.

    Without a ``localiser`` no view is taken, unless the mission seeks a scene; else when the ``trigger`` says so, by
    default every ``MISSION_EVERY`` metres. ``calls`` are the functions that tasks may call. ``each`` is called after
    every control period, and may pause or abort the mission, and once more when the robot has come to rest.

    Raises ``SimError`` for a task that calls what is not there, ``RobotsError`` for a behaviour that this robot does
    not have, ``SceneError`` for a scene of another camera.
    """
    for task in executor.plan.all_tasks:
        if isinstance(task, Call) and task.name not in (calls or {}):
            raise SimError(f"{task}: no such function; valid are {', '.join(calls or {}) or 'none'}")
    run = _MissionRun(bench, executor, localiser, trigger or Trigger(MISSION_EVERY), Hands(calls or {}))
    return run.until_over(each)


class _MissionRun:
    """A mission on its way."""

    def __init__(
        self, bench: Bench, executor: Executor, localiser: ViewLocaliser | None, trigger: Trigger, hands: Hands
    ) -> None:
        self._bench, self._executor, self._localiser = bench, executor, localiser
        self._trigger, self._hands, self._description = trigger, hands, description_of(bench.robot)
        self._touches, self._lookout = TouchLog(bench), Lookout(executor)
        self._behaviours = RunningBehaviour(self._description)
        self._moved, self._began = Moved(), bench.time
        self._start = bench.state.distance
        self._seen: list[MissionView] = []
        self._track: list[tuple[float, ...]] = []

    def until_over(self, each: Callable[[Executor, Bench], None] | None) -> DrivenMission:
        """Go on until the mission is over."""
        executor, bench = self._executor, self._bench
        for words in executor.plan.all_behaviours:  # all can be read before the robot moves
            behaviour_in(lengthened(words, 1.0) if travels(words) else words, self._description)
        self._look()
        while not executor.status.over:
            self._period(executor.do)
            if each is not None:
                each(executor, bench)
        come_to_rest(bench, self._note)
        if each is not None:
            each(executor, bench)
        track = np.array(self._track).reshape(-1, 5)
        return DrivenMission(executor, track, tuple(self._seen), self._touches.touches, self._hands.photographs)

    def _period(self, do: Do) -> None:
        """One control period: steer, tell the executor how far it is, take a view where one is due."""
        if do.task is not None and self._bench.state.stands:
            self._hands.do(do.task, self._sense())
            self._executor.done()
            return
        before = self._bench.odometry
        self._steer(do)
        self._moved.add(before, self._bench.odometry, CONTROL_PERIOD)
        self._note()
        self._executor.move(self._bench.time - self._began, self._bench.state.distance - self._start)
        closer = self._lookout.sees and self._moved.distance >= CLOSER
        if self._trigger.fires(self._moved) or closer or (do.halt and self._moved.time >= LOOKING):
            self._look()

    def _steer(self, do: Do) -> None:
        if do.halt:
            before = self._bench.time
            self._bench.drive(Twist())
            self._behaviours.halted(self._bench.time - before)
            return
        step = self._behaviours.step(do.number, do.behaviour, senses_of(self._bench))
        self._bench.drive(step.twist)
        if step.outcome is not BehaviourOutcome.RUNNING:
            self._executor.ended(step.outcome is BehaviourOutcome.FINISHED, step.why)

    def _look(self) -> None:
        """Take a view where somebody localises in it, or looks for something."""
        self._moved = Moved()
        if self._localiser is not None or self._lookout.looks:
            self._sense()

    def _sense(self) -> View:
        """Take a view, and believe what the localiser says: it has to see all of them, as each has its own motion."""
        self._moved = Moved()
        view = self._bench.sense()
        if not self._seen:
            self._lookout.check(view)
        if self._localiser is not None:
            belief = self._localiser.update(replace(view, truth=None))
            self._seen.append(MissionView(replace(view, images={}), belief))
            self._executor.believe(belief)
        self._lookout.look(view)
        return view

    def _note(self) -> None:
        """Keep what a control period has led to."""
        for touch in self._touches.look():
            self._executor.touched(touch)
        pose, executor = self._bench.pose, self._executor
        self._track.append((self._bench.time - self._began, pose.x, pose.y, pose.heading, executor.along))
