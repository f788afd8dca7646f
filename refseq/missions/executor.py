"""The Tactical layer (5.2): beliefs come in, the behaviour that the robot is to run now goes out.

The executor holds no robot and no clock. Whoever runs a mission tells it how time and the odometer go on, what views
say, and how behaviours end; it says what to do, and keeps a log that tells why. It is a state machine: its states and
transitions are those of ``refseq.missions.status``.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from refseq.belief import Belief
from refseq.missions.agenda import Agenda
from refseq.missions.behaviour_codes import lengthened, steered
from refseq.missions.language import MissionError
from refseq.missions.limits import TIMEOUT
from refseq.missions.log import Entry, Level, Touch
from refseq.missions.plan import Order, Plan, Sought
from refseq.missions.progress import Estimate, ProgressFilter, ProgressSettings
from refseq.missions.status import TRANSITIONS, Status
from refseq.missions.tasks import Task, Wait

NEXT = 0.01
"""A landmark that is seen begins so far behind the order in force at least [m]: orders keep their sequence."""


@dataclass(frozen=True, slots=True)
class ExecutorSettings:
    """Limits of a mission's run; all are choices.

    The last ``approach`` [m] to a place are driven by the odometer, so that the robot stops right there: it begins when
    the last view has agreed. A robot that has gone ``overrun`` times the way to a place, and ``slack`` [m] more, has
    missed it. One that is lost, or does not know where it begins, stands and looks for ``patience`` [s] before it gives
    up. An order may last ``least`` [s], and the time that its way takes at ``slowest`` [m/s]. A mission that is not
    over after ``timeout`` [s] is aborted. Pauses count for none of these.
    """

    progress: ProgressSettings = field(default_factory=ProgressSettings)
    approach: float = 1.5
    overrun: float = 1.2
    slack: float = 3.0
    patience: float = 30.0
    least: float = 90.0
    slowest: float = 0.05
    timeout: float = TIMEOUT


@dataclass(frozen=True, slots=True)
class Do:
    """The robot's command: run ``behaviour``, or stand (``halt``).

    Another ``number`` is another execution: the behaviour begins anew. One that is halted goes on where it was.
    ``task`` is to be done now, and told with ``done``.
    """

    number: int
    behaviour: str
    halt: bool = False
    task: Task | None = None


class Executor:
    """Runs a plan.

    ``localised`` says whether views will be told: without them the odometer alone tells where the robot is, and it is
    taken to begin at ``start`` [m along the way]. With them it stands until they agree to that, or tell better.
    """

    def __init__(
        self, plan: Plan, *, localised: bool = True, start: float = 0.0, settings: ExecutorSettings | None = None
    ) -> None:
        self.plan, self.settings, self._localised = plan, settings or ExecutorSettings(), localised
        self._progress = ProgressFilter(plan.path, self.settings.progress, start)
        self._agenda = Agenda(plan, start)
        self.sought: Sought | None = plan.sought
        self._seen_at: float | None = None  # where the landmark is that was sought and seen [m along the way]
        self.status = Status.LOCALISING
        self.why = ""
        self.log: list[Entry] = []
        self._time = self._travelled = 0.0
        self._active = 0.0  # time under way without pauses [s], by which all limits and waits go
        self._since = 0.0  # when the status became what it is, by the same
        self._last_sure: int | None = None  # the place of which the last view says that it got lost behind it
        self._kidnapped = False  # while it stood, views agreed that it is elsewhere
        self._number = 0
        self._behaviour = self._ordered = ""  # the one in force, and as it was before views steered it
        self._begun_at = 0.0  # where the odometer was when the present order began
        self._began = 0.0  # and when, without pauses
        self._tasks: list[Task] = []
        self._after_tasks: Callable[[], None] = self._set_out
        self._before_pause = self.status, self._since
        self._tell(
            f"the mission begins; {len(plan.orders)} order{'s' * (len(plan.orders) != 1)} over {plan.goal:.1f} m"
        )
        if not localised:
            self._begin(self._agenda.number)

    # --- events ---

    def move(self, time: float, travelled: float) -> None:
        """It is ``time`` [s] by now, and the odometer has gone ``travelled`` [m] in all."""
        self._progress.move(travelled - self._travelled)
        if self.status is not Status.PAUSED:
            self._active += time - self._time
        self._time, self._travelled = time, travelled
        if self._active > self.settings.timeout:
            self.abort(f"not over after {self.settings.timeout:g} s")
        if self._seen_at is not None and self.along >= self._seen_at:
            self.sought, self._seen_at = self.plan.sought, None
        match self.status:
            case Status.LOCALISING | Status.LOST if self._active - self._since > self.settings.patience:
                self._fail(f"{self.status.value} for {self.settings.patience:g} s")
            case Status.AT_TASK:
                self._end_wait()
            case Status.TRAVELLING | Status.APPROACHING | Status.MANOEUVRING:
                self._watch()

    def believe(self, belief: Belief, since: float = 0.0) -> None:
        """A view was taken here and now, or the odometer has gone ``since`` [m] meanwhile."""
        if self.status.over:
            return
        self._progress.move(-since)
        estimate = self._progress.update(belief)
        self._progress.move(since)
        self._last_sure = belief.last_sure
        match self.status:
            case Status.LOCALISING | Status.LOST:
                self._relocalise(estimate)
            case Status.TRAVELLING | Status.APPROACHING:
                self._check(estimate)
            case Status.AT_TASK | Status.PAUSED if estimate is Estimate.MOVED:
                self._kidnapped = True

    def sight(self, left: float) -> None:
        """The landmark that is ``sought`` is seen, so far ahead [m], negative: behind; each sighting corrects the last.

        The plan becomes that of the mission with the landmark there. One behind what comes before it is another one.
        """
        if self.sought is None or self.status not in (Status.TRAVELLING, Status.APPROACHING):
            return
        at = min(max(self.along + left, self.order.at + NEXT), self.plan.path.length)
        if at <= self.sought.after:
            return
        try:
            plan = self.sought.found(self.plan.path, at)
        except MissionError as error:
            self._fail(f"{self.sought.name} is seen, at {at:z.1f} m, but {error}")
            return
        if self._seen_at is None:
            self._tell(f"sees {self.sought.name}, {left:z.1f} m ahead")
        self.plan, self._agenda, self._seen_at = plan, self._agenda.carried_over(plan), at
        if self.status is Status.APPROACHING:
            self._set_out()

    def ended(self, finished: bool, why: str) -> None:
        """The behaviour has ended, done or failed."""
        if not self.status.moving:
            return
        if not finished:
            self._fail(f"{self._behaviour} failed: {why}")
        elif self.status is Status.TRAVELLING:
            self._miss()
        else:
            self._tell(f"{self._behaviour} done: {why}")
            while self._agenda.number < self._agenda.last:
                self._pass()
            # Where an order ends that leaves the way, nobody knows.
            if self.order.travels or not self._agenda.at_end:
                self._arrive(self.plan.end_of(self._agenda.number))
            self._next()

    def touched(self, touch: Touch) -> None:
        """The robot has touched something, on its way or while it comes to rest behind its end."""
        self.log.append(Entry(touch.time, self.along, str(touch), Level.WARN))

    def done(self) -> None:
        """The task that was asked for is done."""
        if self.status is Status.AT_TASK:
            self._tell(f"done: {self._tasks.pop(0)}")
            self._since = self._active
            if not self._tasks:
                self._after_tasks()

    def pause(self) -> None:
        """Stand until ``resume``."""
        if not self.status.over and self.status is not Status.PAUSED:
            self._before_pause = self.status, self._since
            self._become(Status.PAUSED, "paused")

    def resume(self) -> None:
        """Go on after a pause, which counts for no time limit."""
        if self.status is Status.PAUSED:
            status, since = self._before_pause
            self._become(status, "resumed")
            self._since = since
            if self._kidnapped and status.moving:
                self._resume_at(self.along)

    def abort(self, why: str = "somebody asked for it") -> None:
        """Stop for good."""
        if not self.status.over:
            self.why = why
            self._become(Status.ABORTED, f"aborted: {why}")

    # --- answers ---

    @property
    def do(self) -> Do:
        """The command in force."""
        task = self._tasks[0] if self.status is Status.AT_TASK and self._tasks else None
        return Do(self._number, self._behaviour, not self.status.moving, None if isinstance(task, Wait) else task)

    @property
    def doing(self) -> str:
        """The behaviour that moves the robot, without what steers it from view to view; empty where it stands."""
        return self._ordered if self.status.moving else ""

    @property
    def time(self) -> float:
        """Time under way [s], as it was told last."""
        return self._time

    @property
    def travelled(self) -> float:
        """Way of the odometer in all [m], as it was told last."""
        return self._travelled

    @property
    def along(self) -> float:
        """Believed position [m along its way]."""
        return self._progress.along

    @property
    def number(self) -> int:
        """The number of the order in force."""
        return self._agenda.number

    @property
    def order(self) -> Order:
        """The order in force."""
        return self._agenda.order

    @property
    def switches(self) -> Sequence[tuple[int, float]]:
        """Orders that were begun: the number of each, and the time [s]."""
        return self._agenda.switches

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Tasks still to do where the robot stands, the present one first."""
        return tuple(self._tasks) if self.status is Status.AT_TASK else ()

    # --- standing without knowing where: LOCALISING, LOST ---

    def _relocalise(self, estimate: Estimate) -> None:
        """A view while it does not know where it is; where it was right, it goes on with the order in force."""
        first = self.status is Status.LOCALISING
        enough = 1 if first else self.settings.progress.confirm
        if estimate is not Estimate.MOVED and self._progress.agreements < enough:
            return
        self._tell(f"knows where it is: at {self.along:z.1f} m")
        if estimate is Estimate.MOVED:
            self._resume_at(self.along)
        elif first and not self._kidnapped:
            self._begin(self._agenda.number)
        else:
            self._set_out()

    # --- standing at a landmark: AT_TASK ---

    def _do_tasks(self, tasks: Sequence[Task], where: str, after: Callable[[], None]) -> None:
        self._tasks, self._after_tasks = list(tasks), after
        if tasks:
            self._become(Status.AT_TASK, f"stands for {where}: {', '.join(map(str, tasks))}")
        else:
            after()

    def _end_wait(self) -> None:
        task = self._tasks[0]
        if isinstance(task, Wait) and self._active - self._since >= task.seconds:
            self.done()

    # --- running a behaviour: TRAVELLING, APPROACHING, MANOEUVRING ---

    def _watch(self) -> None:
        """Note landmarks on the way, and end an order that takes too long."""
        if self._active - self._began > (limit := self._time_limit):
            self._fail(f"{self._behaviour} not done after {limit:.0f} s")
        elif self.status is not Status.MANOEUVRING and (self._progress.agreements > 0 or not self._localised):
            if self.status is Status.TRAVELLING and self._left <= self.settings.approach:
                self._approach()
            while self._agenda.number < self._agenda.last and self.along >= self.plan.end_of(self._agenda.number):
                self._pass()

    @property
    def _time_limit(self) -> float:
        """Time that the present order may last [s]."""
        if self.order.timeout is not None:
            return self.order.timeout
        return self.settings.least + max(self._agenda.end - self.order.at, 0.0) / self.settings.slowest

    @property
    def _left(self) -> float:
        """Believed way to where something else begins [m]."""
        return self._agenda.end - self.along

    @property
    def _most(self) -> float:
        """The longest way to where something else begins [m]; behind it the place is missed."""
        return self.settings.overrun * max(self._left, 0.0) + self.settings.slack

    def _check(self, estimate: Estimate) -> None:
        """A view on the way."""
        if estimate is Estimate.MOVED:
            views = f"{self.settings.progress.confirm} views agree that it is elsewhere"
            self._tell(f"{views}: at {self.along:z.1f} m", Level.WARN)
            self._resume_at(self.along)
        elif self._progress.lost:
            lost = f"lost: {self._progress.doubts} views in a row do not agree; it stands{self._told_last_sure}"
            self._become(Status.LOST, lost)
        elif estimate is Estimate.AGREES:
            self._steer()
        elif self._progress.doubts == 1:
            said = "says lost" if estimate is Estimate.LOST else "says elsewhere"
            self._tell(f"a view {said}; not believed yet", Level.WARN)

    def _steer(self) -> None:
        """Begin the behaviour anew where a view tells how far beside the way that was led the robot is."""
        beside = self._progress.beside
        if beside is None:
            return
        there = steered(self.order.behaviour, -beside.aside, -math.degrees(beside.heading))
        if there != self.order.behaviour:
            self._number += 1
            length = self._left if self.status is Status.APPROACHING else self._most
            self._behaviour = lengthened(there, length)

    @property
    def _told_last_sure(self) -> str:
        """Where the chain was last sure (3.3.1), for the log; empty where it does not tell."""
        if self._last_sure is None:
            return ""
        held = self.plan.path.held
        along = held.along[held.places == self._last_sure]
        where = f", at {along[np.argmin(np.abs(along - self.along))]:.1f} m" if len(along) else ", off its way"
        return f", last sure at place {self._last_sure}{where}"

    def _pass(self) -> None:
        """Note that a landmark is passed: the next order is in force, and has its own time."""
        self._began = self._active
        self._agenda.begin(self._agenda.number + 1, self._time)
        self._tell(f"passes {self.order.why}")

    def _miss(self) -> None:
        went = self._travelled - self._begun_at
        self._fail(f"{self._agenda.target} not found: {went:.1f} m gone, believed to be {self._left:z.1f} m ahead")

    # --- from order to order ---

    def _arrive(self, at: float) -> None:
        """Take the place where something else begins [m] for the robot's, and tell where views had it elsewhere."""
        apart = at - self.along
        if abs(apart) > self.settings.progress.near:
            side = "ahead of" if apart > 0 else "behind"
            told = f"goes on from {at:z.1f} m, {abs(apart):.1f} m {side} where it was believed to be"
            self._tell(told, Level.WARN)
        self._progress.along = at

    def _begin(self, number: int) -> None:
        """Begin with an order; its tasks come first, where they are still due and its place is not behind the robot."""
        late = self.along - self.plan.orders[number].at > self.settings.progress.near
        if left := self._agenda.leave_out(number, late=late):
            self._tell(f"left out, behind it: {', '.join(map(str, left))}", Level.WARN)
        self._agenda.begin(number, self._time)
        self._do_tasks(() if late else self._agenda.due.pop(number, ()), self.order.why, self._set_out)

    def _set_out(self) -> None:
        """Run the behaviour of the order in force."""
        if self._kidnapped:
            self._resume_at(self.along)
            return
        self._begun_at, self._began = self._travelled, self._active
        if not self.order.travels:
            self._run(Status.MANOEUVRING, self.order.behaviour, self.order.why)
        elif self._left <= self.settings.approach:
            self._approach()
        else:
            behaviour = lengthened(self.order.behaviour, self._most)
            self._run(Status.TRAVELLING, behaviour, f"{self.order.why}; {self._left:.1f} m to go")

    def _approach(self) -> None:
        behaviour = lengthened(self.order.behaviour, self._left)
        self._run(Status.APPROACHING, behaviour, f"{max(self._left, 0.0):.1f} m to {self._agenda.target}")

    def _run(self, status: Status, behaviour: str, why: str) -> None:
        self._number += 1
        self._behaviour = self._ordered = behaviour
        self._become(status, f"{behaviour}: {why}")

    def _resume_at(self, along: float) -> None:
        """Take up the order that is in force at a place; behind the goal there is none.

        Tasks of places that lie behind the robot are left out.
        """
        self._kidnapped = False
        near = self.settings.progress.near
        if along > self.plan.goal + near and self.plan.orders[-1].travels:
            self._fail(f"it is behind the goal, by {along - self.plan.goal:.1f} m")
            return
        number = self._agenda.order_for(along, near)
        if number is None:
            self._fail(f"it is behind the last order, {self.plan.orders[-1].behaviour}")
            return
        self._begin(number)

    def _next(self) -> None:
        if self._agenda.at_end and self.plan.sought is not None:
            self._fail(f"{self.plan.sought.name} was not seen on the way")
        elif self._agenda.at_end:
            self._do_tasks(self.plan.tasks, "the goal", self._complete)
        else:
            self._begin(self._agenda.number + 1)

    def _complete(self) -> None:
        self._become(Status.COMPLETED, "the mission is completed")

    def _fail(self, why: str) -> None:
        self.why = why
        self._become(Status.FAILED, f"failed: {why}")

    def _become(self, status: Status, what: str) -> None:
        """Take a transition of the table."""
        assert status in TRANSITIONS[self.status], f"{self.status} is never followed by {status}"
        self.status, self._since = status, self._active
        self._tell(what, _WEIGHT.get(status, Level.INFO))

    def _tell(self, what: str, level: Level = Level.INFO) -> None:
        self.log.append(Entry(self._time, self.along, what, level))


_WEIGHT = {Status.LOST: Level.WARN, Status.FAILED: Level.ERROR, Status.ABORTED: Level.ERROR}
"""Level of the log line when a mission comes to a status."""
