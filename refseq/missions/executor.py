"""The Tactical layer (5.2): what is believed comes in, the behaviour that the robot is to run now goes out.

The executor holds no robot and no clock. Whoever runs a mission tells it how time and the odometer go on, what views
say, and how behaviours end; it says what to do, and keeps a log that tells why.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, StrEnum

from refseq.belief import Belief
from refseq.missions.behaviour_codes import lengthened
from refseq.missions.plan import Order, Plan
from refseq.missions.progress import Trust, Whereabouts, Word
from refseq.missions.tasks import Task, Wait


class Status(Enum):
    """How a mission stands."""

    LOOKING = "looking"
    RUNNING = "running"
    TASK = "at a task"
    LOST = "lost"
    PAUSED = "paused"
    COMPLETED = "completed"
    FAILED = "failed"
    ABORTED = "aborted"

    @property
    def over(self) -> bool:
        """Whether nothing comes any more."""
        return self in (Status.COMPLETED, Status.FAILED, Status.ABORTED)

    @property
    def completed(self) -> bool:
        """Whether all was done."""
        return self is Status.COMPLETED


@dataclass(frozen=True, slots=True)
class Caution:
    """How a mission is run; all are choices.

    The last ``approach`` [m] to a place are driven by the odometer, so that the robot stops right there: it begins when
    the last view has agreed. A robot that has gone ``overrun`` times the way to a place, and ``slack`` [m] more, has
    missed it. One that is lost, or does not know where it begins, stands and looks for ``patience`` [s] before it gives
    up. An order may last ``least`` [s], and the time that its way takes at ``slowest`` [m/s].
    """

    trust: Trust = field(default_factory=Trust)
    approach: float = 1.5
    overrun: float = 1.2
    slack: float = 3.0
    patience: float = 30.0
    least: float = 90.0
    slowest: float = 0.05


@dataclass(frozen=True, slots=True)
class Do:
    """What the robot is to do: run ``behaviour``, or stand (``halt``).

    Another ``number`` is another execution: the behaviour begins anew. One that is halted goes on where it was.
    ``task`` is to be done now, and told with ``done``.
    """

    number: int
    behaviour: str
    halt: bool = False
    task: Task | None = None


class Level(StrEnum):
    """How much a line of the log matters: all is well; something is not as it should be; the mission ends by it."""

    INFO = "INFO"
    WARN = "WARN"
    ERROR = "ERROR"


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the log: when [s], where the robot believed itself to be [m along its way], and what happened."""

    time: float
    along: float
    what: str
    level: Level = Level.INFO

    def __str__(self) -> str:
        return f"{self.time:7.1f} s {self.along:7.1f} m  {self.what}"


class Executor:
    """Runs a plan.

    ``localised`` says whether views will be told: without them the odometer alone tells where the robot is, and it is
    taken to begin at ``start`` [m along the way]. With them it stands until they agree to that, or tell better.
    """

    def __init__(
        self, plan: Plan, *, localised: bool = True, start: float = 0.0, caution: Caution | None = None
    ) -> None:
        self.plan, self.caution, self._localised = plan, caution or Caution(), localised
        self._where = Whereabouts(plan.way, self.caution.trust, start)
        self.status = Status.LOOKING if localised else Status.RUNNING
        self.why = ""
        self.log: list[Entry] = []
        self.switches: list[tuple[int, float]] = []
        """Orders that were begun: the number of each, and the time [s]."""
        self._time = self._travelled = self._since = 0.0
        self._order = plan.order_at(start) if start > 0 else 0  # of several that begin at the start the first one
        self._due = {number: order.tasks for number, order in enumerate(plan.orders) if order.tasks}
        self._carried = False  # while it stood, views agreed that it is elsewhere
        self._number = 0
        self._behaviour = ""
        self._begun_at = 0.0  # where the odometer was when the present order began
        self._began = 0.0  # and when
        self._approaching = False
        self._tasks: list[Task] = []
        self._after_tasks: Callable[[], None] = self._set_out
        self._before_pause = self.status, self._since
        self._tell(f"the mission begins; {len(plan.orders)} orders over {plan.goal:.1f} m")
        if not localised:
            self._begin(self._order)

    # --- what is told to it ---

    def move(self, time: float, travelled: float) -> None:
        """It is ``time`` [s] by now, and the odometer has gone ``travelled`` [m] in all."""
        self._where.move(travelled - self._travelled)
        self._time, self._travelled = time, travelled
        if self.status in (Status.LOOKING, Status.LOST) and time - self._since > self.caution.patience:
            self._fail(f"{self.status.value} for {self.caution.patience:g} s")
        elif self.status is Status.TASK:
            self._wait()
        elif self.status is Status.RUNNING:
            self._watch()

    def believe(self, belief: Belief) -> None:
        """A view was taken here and now."""
        if self.status.over:
            return
        word = self._where.believe(belief)
        if self.status in (Status.LOOKING, Status.LOST):
            self._look(word)
        elif self.status is Status.RUNNING:
            if self._travelling:
                self._check(word)
        elif word is Word.MOVED:
            self._carried = True

    def ended(self, finished: bool, why: str) -> None:
        """The behaviour has ended, done or failed."""
        if self.status is not Status.RUNNING:
            return
        if not finished:
            self._fail(f"{self._behaviour} failed: {why}")
        elif self._travelling and not self._approaching:
            self._overrun()
        else:
            self._tell(f"{self._behaviour} done: {why}")
            while self._order < self._last:
                self._pass()
            # Where an order ends that leaves the way, nobody knows.
            if self._travelling or self._order + 1 < len(self.plan.orders):
                self._where.along = self.plan.end_of(self._order)
            self._next()

    def done(self) -> None:
        """The task that was asked for is done."""
        if self.status is Status.TASK:
            self._tell(f"done: {self._tasks.pop(0)}")
            self._since = self._time
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
            (status, since), paused = self._before_pause, self._time - self._since
            self._become(status, "resumed")
            self._since, self._began = since + paused, self._began + paused
            if self._carried and status is Status.RUNNING:
                self._resume_at(self._where.along)

    def abort(self, why: str = "somebody asked for it") -> None:
        """Stop for good."""
        if not self.status.over:
            self.why = why
            self._become(Status.ABORTED, f"aborted: {why}")

    # --- what it says ---

    @property
    def do(self) -> Do:
        """What to do now."""
        task = self._tasks[0] if self.status is Status.TASK and self._tasks else None
        halt = self.status is not Status.RUNNING
        return Do(self._number, self._behaviour, halt, None if isinstance(task, Wait) else task)

    @property
    def time(self) -> float:
        """How long it has been under way [s], as it was told last."""
        return self._time

    @property
    def travelled(self) -> float:
        """How far the odometer has gone in all [m], as it was told last."""
        return self._travelled

    @property
    def along(self) -> float:
        """Where the robot believes itself to be [m along its way]."""
        return self._where.along

    @property
    def number(self) -> int:
        """The number of the order in force."""
        return self._order

    @property
    def tasks(self) -> tuple[Task, ...]:
        """What it still has to do where it stands, the present task first."""
        return tuple(self._tasks) if self.status is Status.TASK else ()

    @property
    def order(self) -> Order:
        """The order in force."""
        return self.plan.orders[self._order]

    # --- how it goes on ---

    @property
    def _travelling(self) -> bool:
        return self.order.travels

    @property
    def _last(self) -> int:
        """The last of the orders that are the present one over again: at their landmarks it goes on without a stop."""
        orders, last = self.plan.orders, self._order
        while last + 1 < len(orders) and _goes_on(orders[last], orders[last + 1]):
            last += 1
        return last

    @property
    def _left(self) -> float:
        """How far it is believed to be to where something else begins [m]."""
        return self.plan.end_of(self._last) - self._where.along

    def _begin(self, number: int, *, tasks: bool = True) -> None:
        """Begin with an order; its tasks come first, where they are still due."""
        self._order = number
        self.switches.append((number, self._time))
        self._do_tasks(self._due.pop(number, ()) if tasks else (), self.order.why, self._set_out)

    def _do_tasks(self, tasks: Sequence[Task], where: str, after: Callable[[], None]) -> None:
        self._tasks, self._after_tasks = list(tasks), after
        if tasks:
            self._become(Status.TASK, f"stands for {where}: {', '.join(map(str, tasks))}")
        else:
            after()

    def _set_out(self) -> None:
        if self._carried:
            self._resume_at(self._where.along)
            return
        self.status, self._since = Status.RUNNING, self._time
        self._begun_at, self._began, self._approaching = self._travelled, self._time, False
        if not self._travelling:
            self._execute(self.order.behaviour, self.order.why)
        elif self._left <= self.caution.approach:
            self._approach()
        else:
            self._execute(lengthened(self.order.behaviour, self._most), f"{self.order.why}; {self._left:.1f} m to go")

    @property
    def _most(self) -> float:
        """So far it may go for the present order [m]."""
        return self.caution.overrun * max(self._left, 0.0) + self.caution.slack

    def _approach(self) -> None:
        self._approaching = True
        behaviour = lengthened(self.order.behaviour, self._left)
        self._execute(behaviour, f"{max(self._left, 0.0):.1f} m to {self._target}")

    @property
    def _target(self) -> str:
        after = self._last + 1
        return self.plan.orders[after].why if after < len(self.plan.orders) else "the goal"

    def _watch(self) -> None:
        """Look whether the place is near, and the time not over."""
        order = self.order
        limit = order.timeout
        if limit is None:
            way = self.plan.end_of(self._last) - order.at
            limit = self.caution.least + max(way, 0.0) / self.caution.slowest
        if self._time - self._began > limit:
            self._fail(f"{self._behaviour} not done after {limit:.0f} s")
        elif self._travelling and self._sure:
            if not self._approaching and self._left <= self.caution.approach:
                self._approach()
            while self._order < self._last and self._where.along >= self.plan.end_of(self._order):
                self._pass()

    @property
    def _sure(self) -> bool:
        return not self._localised or self._where.agreements > 0

    def _pass(self) -> None:
        """Note that a landmark is passed: the next order is in force, and has its own time."""
        self._order, self._began = self._order + 1, self._time
        self.switches.append((self._order, self._time))
        self._tell(f"passes {self.order.why}")

    def _check(self, word: Word) -> None:
        """A view on the way."""
        if word is Word.MOVED:
            agree = f"{self.caution.trust.confirm} views agree that it is elsewhere: at {self.along:.1f} m"
            self._tell(agree, Level.WARN)
            self._resume_at(self._where.along)
        elif self._where.lost:
            self._become(Status.LOST, f"lost: {self._where.doubts} views in a row do not agree; it stands")
        elif word is not Word.AGREES and self._where.doubts == 1:
            said = "says lost" if word is Word.LOST else "says elsewhere"
            self._tell(f"a view {said}; not believed yet", Level.WARN)

    def _look(self, word: Word) -> None:
        """A view while it stands and does not know where it is; where it was right, it goes on with what it was at."""
        looking = self.status is Status.LOOKING
        if word is not Word.MOVED and self._where.agreements < (1 if looking else self.caution.trust.confirm):
            return
        self._tell(f"knows where it is: at {self.along:.1f} m")
        if word is Word.MOVED:
            self._resume_at(self._where.along)
        elif looking and not self._carried:
            self._begin(self._order)
        else:
            self._set_out()

    def _resume_at(self, along: float) -> None:
        """Take up the order that is in force at a place; behind the goal there is none.

        Tasks of a place that lies behind the robot are left out.
        """
        self._carried = False
        if along > self.plan.goal + self.caution.trust.near and self.plan.orders[-1].travels:
            self._fail(f"it is behind the goal, by {along - self.plan.goal:.1f} m")
            return
        number = self.plan.order_at(along)
        # What ends by itself was begun elsewhere: where its place is behind the robot, it is left out.
        while not self.plan.orders[number].travels and along - self.plan.orders[number].at > self.caution.trust.near:
            if number + 1 == len(self.plan.orders):
                self._fail(f"it is behind the last order, {self.plan.orders[number].behaviour}")
                return
            number += 1
        late = along - self.plan.orders[number].at > self.caution.trust.near
        if late and number in self._due:
            self._tell(f"left out, behind it: {', '.join(map(str, self._due[number]))}", Level.WARN)
        self._begin(number, tasks=not late)

    def _overrun(self) -> None:
        went = self._travelled - self._begun_at
        self._fail(f"{self._target} not found: {went:.1f} m gone, believed to be {self._left:.1f} m ahead")

    def _next(self) -> None:
        if self._order + 1 < len(self.plan.orders):
            self._begin(self._order + 1)
        else:
            self._do_tasks(self.plan.tasks, "the goal", self._complete)

    def _complete(self) -> None:
        self._become(Status.COMPLETED, "the mission is completed")

    def _wait(self) -> None:
        task = self._tasks[0]
        if isinstance(task, Wait) and self._time - self._since >= task.seconds:
            self.done()

    def _execute(self, behaviour: str, why: str) -> None:
        self._number += 1
        self._behaviour = behaviour
        self._tell(f"{behaviour}: {why}")

    def _fail(self, why: str) -> None:
        self.why = why
        self._become(Status.FAILED, f"failed: {why}")

    def _become(self, status: Status, what: str) -> None:
        self.status, self._since = status, self._time
        self._tell(what, _WEIGHT.get(status, Level.INFO))

    def _tell(self, what: str, level: Level = Level.INFO) -> None:
        self.log.append(Entry(self._time, self._where.along, what, level))


_WEIGHT = {Status.LOST: Level.WARN, Status.FAILED: Level.ERROR, Status.ABORTED: Level.ERROR}
"""How much it matters that a mission comes to stand so."""


def _goes_on(order: Order, after: Order) -> bool:
    """Whether an order only goes on with the one before."""
    return order.travels and after.behaviour == order.behaviour and not after.tasks
