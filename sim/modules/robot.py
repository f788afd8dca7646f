"""The bench plays the robot: it carries commands out, senses, keeps the journal, and stands where a module is gone."""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from statistics import median

from refseq.modules.heads import MessageError, Parts, head_bytes
from refseq.modules.link import Link
from refseq.modules.messages import (
    BELIEF,
    BELIEFS,
    COMMANDS,
    HEAD,
    STATE,
    STEPS,
    VIEWS,
    BeliefHead,
    Command,
    Step,
    head_of,
    part,
    sent_scan,
    view_parts,
)
from refseq.modules.process import Role
from refseq.view import Scan
from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.rest import come_to_rest
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.drives.view_spacing import LOOKING
from refseq_bench.sim.missions.touches import TouchLog
from refseq_bench.sim.modules.state import state_bytes
from refseq_bench.sim.realtime import RealTimePacer

STEPS_KEPT = 100_000
"""Steps that a restarted module is told of, an hour; a mission that lasts longer cannot be taken over."""
VIEWS_KEPT = 256
"""Views that a restarted localiser is told of: their pictures are what the journal weighs."""
FRESH = 0.5
"""In real time a command that answers what was sensed longer ago [s] is not carried out: the robot stands."""
ANSWER = 2.0
"""In real time the robot stands where a view is not answered for so long [s], until all are."""
ANSWER_PERIODS = round(ANSWER / CONTROL_PERIOD)
"""Control periods of ``ANSWER``."""
REMEMBERED = 100
"""Steps that may be answered late."""
LOOK = 0.02
"""Period in which a robot that waits looks around [s]."""
FAREWELL = 3.0
"""Seconds in which the others may read that the drive is over."""


@dataclass
class Peers:
    """Modules that are there, of those that are ``needed``; ``news`` is told when one comes or goes."""

    needed: tuple[Role, ...]
    told: Callable[[str], None]
    there: set[str] = field(default_factory=set)

    def changed(self, role: str, there: bool) -> None:
        """One has come or gone."""
        (self.there.add if there else self.there.discard)(role)
        stands = "; the robot stands" if not there and role in self.needed else ""
        if role != Role.ROBOT:
            self.told(f"{role}: {'is there' if there else 'is gone'}{stands}")

    @property
    def missing(self) -> str:
        """Names of those that are needed and gone."""
        return ", ".join(sorted(set(self.needed) - self.there))


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Ways to run the robot: it takes a view when the ``trigger`` says so, and where it stands every ``LOOKING`` s.

    ``realtime``: simulated time goes by as time does, whoever answers; else it waits for each answer, however long that
    takes. ``localised``: a localiser is needed.
    """

    trigger: Trigger
    realtime: bool = False
    localised: bool = True


class RobotModule:
    """A drive of the bench under commands that come over a link.

    ``latency`` of each view that was answered: from when it was sent until its belief was here [s]. ``touches`` watches
    for what it touches.
    """

    def __init__(
        self, bench: Bench, link: Link, drive: str, settings: RobotSettings, told: Callable[[str], None]
    ) -> None:
        self._bench, self._drive, self._settings, self._told = bench, drive, settings, told
        needed = (Role.CONTROL, Role.MISSION, *((Role.LOCALISER,) if settings.localised else ()))
        self._peers = Peers(needed, told)
        self._news = threading.Condition()
        self._command: Command | None = None
        self._came: dict[int, bytes] = {}  # beliefs that have come and are in no step yet
        self.latency: list[float] = []
        self._seen = 0  # views that were taken
        self._sent: dict[int, float] = {}  # when each view was sent that is not answered [s]
        self._published: deque[float] = deque(maxlen=REMEMBERED)  # when the last steps were [s]
        self._number, self._held = 0, ""
        self._scan: Scan | None = None  # the last in a step
        self._moved, self._began, self._start = Moved(), bench.time, bench.state.distance
        self.touches, self._touched = TouchLog(bench), 0  # and how many of them stand in the journal
        self._pacer = RealTimePacer()
        self._in_time: deque[bool] = deque(maxlen=ANSWER_PERIODS)  # for each of the last periods: its command was fresh
        self._late = False  # most of them were not, and it was told
        self._steps, self._views = link.publisher(STEPS, STEPS_KEPT), link.publisher(VIEWS, VIEWS_KEPT)
        link.join(Role.ROBOT)
        link.subscribe(COMMANDS, self._commanded)
        link.subscribe(BELIEFS, self._believed)
        link.watch(self._changed)

    # --- what comes in, in the link's threads ---

    def _commanded(self, parts: Parts) -> None:
        try:
            command: Command = head_of(Command, parts)
        except MessageError as error:
            self._told(str(error))
            return
        with self._news:
            late = self._command is not None and command.answers < self._command.answers
            if command.drive == self._drive and not late:
                self._command = command
                self._news.notify_all()

    def _believed(self, parts: Parts) -> None:
        now = time.monotonic()
        try:
            head: BeliefHead = head_of(BeliefHead, parts)
        except MessageError as error:
            self._told(str(error))
            return
        data = part(parts, BELIEF)
        with self._news:
            if head.drive == self._drive and head.view in self._sent and data:
                self._came[head.view] = data
                self.latency.append(now - self._sent.pop(head.view))
                self._news.notify_all()

    def _changed(self, role: str, there: bool) -> None:
        with self._news:
            self._peers.changed(role, there)
            self._news.notify_all()

    # --- the drive ---

    def run(self) -> str:
        """Drive until the mission is over; gives how it ended."""
        self._wait_for(lambda: not self._peers.missing)
        self._publish(view=self._look())
        while True:
            command = self._next_command()
            if command is None:
                self._stand_still()
            elif command.over:
                self._say_farewell(command.over)
                return command.over
            else:
                self._carry_out(command)

    def _next_command(self) -> Command | None:
        """The command for the last step; None where the robot is to stand."""
        if self._held or self._overdue():
            self._in_time.clear()
            return None
        if not self._settings.realtime:
            self._wait_for(lambda: self._answered or bool(self._peers.missing))
            return self._command if not self._peers.missing else None
        self._pacer.keep(self._bench.time)
        with self._news:
            command = self._command
        if command is None or self._peers.missing:
            self._in_time.clear()
            return None
        ago = self._number - command.answers
        known = 1 <= ago <= len(self._published)
        in_time = known and time.monotonic() - self._published[-ago] < FRESH
        self._tell_of_lateness(in_time)
        return command if in_time else None

    def _tell_of_lateness(self, in_time: bool) -> None:
        """Tell once that most commands of the last ``ANSWER`` seconds were late, and that all are in time again."""
        self._in_time.append(in_time)
        if len(self._in_time) < ANSWER_PERIODS:
            return
        late = self._in_time.count(False)
        if not self._late and late > len(self._in_time) / 2:
            self._late = True
            self._told(
                f"{Role.CONTROL}: in {late} of the last {len(self._in_time)} periods its command answers what was "
                f"sensed more than {FRESH:g} s ago: machine or link are too slow for real time; the robot stands there"
            )
        elif self._late and not late:
            self._late = False
            self._told(f"{Role.CONTROL}: its commands are in time again")

    @property
    def _answered(self) -> bool:
        return self._command is not None and self._command.answers == self._number - 1

    def _overdue(self) -> str:
        """The localiser, where it lags behind."""
        with self._news:
            waiting = list(self._sent.values())
        if not waiting:
            return ""
        lags = not self._settings.realtime or self._held or time.monotonic() - min(waiting) > ANSWER
        return Role.LOCALISER.value if lags else ""

    def _carry_out(self, command: Command) -> None:
        """Do as it is told for one control period, and look where a view is due."""
        if command.scan:
            self._bench.scan()
            self._publish(command)
            return
        before = self._bench.odometry
        self._bench.drive(Twist(command.linear, command.angular))
        self.touches.look()
        self._moved.add(before, self._bench.odometry, CONTROL_PERIOD)
        due = self._settings.trigger.fires(self._moved) or (command.halt and self._moved.time >= LOOKING)
        self._publish(command, view=self._look() if due else None)

    def _stand_still(self) -> None:
        """Stand for a period: nobody commands, or a module is gone; time goes by as it does."""
        began, before = time.monotonic(), self._bench.odometry
        self._bench.drive(Twist())
        self.touches.look()
        self._moved.add(before, self._bench.odometry, 0.0)
        self._held = self._peers.missing or self._overdue()
        self._publish()
        if not self._settings.realtime:
            time.sleep(max(0.0, CONTROL_PERIOD - (time.monotonic() - began)))
        elif self._held:
            self._pacer.keep(self._bench.time)

    def _say_farewell(self, over: str) -> None:
        come_to_rest(self._bench, self.touches.look)
        self._peers.needed = ()
        self._publish(over=over)
        self._wait_for(lambda: not self._peers.there - {Role.ROBOT}, FAREWELL)

    def _look(self) -> int | None:
        """Take a view and send it; gives its number. In real time nobody waits for what is believed of it."""
        self._moved = Moved()
        if not self._settings.localised:
            return None
        view, number = replace(self._bench.sense(), truth=None), self._seen
        self._seen += 1
        with self._news:
            self._sent[number] = time.monotonic()
        self._views(view_parts(self._drive, number, view))
        if not self._settings.realtime:
            self._wait_for(lambda: not self._sent or bool(self._peers.missing))
        return number

    def _new_scan(self) -> Scan | None:
        """The scan to steer by, where it is not known yet."""
        if self._bench.scan_due and not self._settings.realtime:  # it is turned when it is asked for
            return None
        before, self._scan = self._scan, self._bench.scan()
        return None if self._scan is before else self._scan

    def _publish(self, command: Command | None = None, *, view: int | None = None, over: str = "") -> None:
        """Add a step to the journal."""
        bench, number = self._bench, self._number
        scan = sent_scan(self._new_scan(), bench.time)
        pose = bench.pose
        step = Step(
            drive=self._drive,
            number=number,
            time=bench.time - self._began,
            clock=bench.time,
            travelled=bench.state.distance - self._start,
            robot=bench.robot.name,
            held=self._held,
            command=command,
            view=view,
            scan=scan.geometry,
            scan_due=bench.scan_due,
            touches=self.touches.touches[self._touched :],
            truth=(pose.x, pose.y, pose.heading),
            over=over,
        )
        with self._news:
            came, self._came = self._came, {}
        parts = [(HEAD, head_bytes(step)), (STATE, state_bytes(bench.state)), *scan.parts]
        self._published.append(time.monotonic())
        self._number += 1
        self._touched = len(self.touches.touches)
        self._steps([*parts, *((BELIEF, came[one]) for one in sorted(came))])

    def _wait_for(self, reached: Callable[[], bool], most: float | None = None) -> None:
        """Wait until something is so, at most so long [s]; Ctrl-C is heard."""
        end = None if most is None else time.monotonic() + most
        with self._news:
            while not reached() and (end is None or time.monotonic() < end):
                self._news.wait(LOOK)


def latency_line(latency: Iterable[float]) -> str:
    """Times that beliefs took, in a line."""
    found = sorted(latency)
    if not found:
        return "no view was answered"
    late = found[min(len(found) - 1, int(0.95 * len(found)))]
    return (
        f"{len(found)} views; from a view to its belief {1000 * median(found):.0f} ms in the median, "
        f"{1000 * late:.0f} ms in 95 of 100, {1000 * found[-1]:.0f} ms at most"
    )
