"""A teleoperation session: the robot goes where it is led, and views are taken as the commands ask."""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.drives.recorder import RecordedView
from refseq_bench.sim.drives.trigger import Moved, Trigger
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.commands import (
    AFTER,
    Button,
    Commands,
    CommandSource,
    SessionPhase,
    SessionStatus,
    valid_in,
)

LATELY = 10
"""Number of views over which the rate is taken."""


class AbortedError(SimError):
    """The session was aborted at the controls: nothing of it is kept."""


def run_session(bench: Bench, source: CommandSource, sampling: Trigger | None) -> Iterator[RecordedView]:
    """Lead the robot by the commands of ``source`` until they say stop; yield the views as they are taken.

    The first is taken at the start command, then one whenever ``sampling`` fires (None: never) or a command asks for
    one. A pause takes none; motion counts on, so that one may be due at its end. A view's progress is the odometer's.
    The robot is led through its Control layer, with all its stops. Raises ``AbortedError`` on the abort command.
    """
    session = _Session(bench, sampling)
    while not session.status.phase.over:
        commands = source.commands(session.status)
        if session.press(commands.buttons):
            yield session.take()
        if not session.status.phase.over:
            session.drive(commands)
    source.commands(session.status)  # shows the end
    if session.status.phase is SessionPhase.ABORTED:
        raise AbortedError(f"aborted at {bench.time:.1f} s, after {session.status.count} views: none is kept")


class _Session:
    """The status of a session, and the steps that change it."""

    def __init__(self, bench: Bench, sampling: Trigger | None) -> None:
        self._bench, self._sampling = bench, sampling
        self._times: deque[float] = deque(maxlen=LATELY + 1)
        self.status = SessionStatus(time=bench.time)

    def press(self, buttons: tuple[Button, ...]) -> bool:
        """Act on the buttons; return True when a view is due."""
        due = False
        for button in buttons:
            due |= self._press(button)
        status = self.status
        if status.phase is not SessionPhase.SAMPLING:
            return due and not status.phase.over
        return due or (self._sampling is not None and self._sampling.fires(status.moved))

    def _press(self, button: Button) -> bool:
        phase = self.status.phase
        after = AFTER.get((phase, button))
        if after is None:
            valid = ", ".join(valid_in(phase))
            self.status = replace(self.status, note=f"{button} does nothing while {phase}; valid are {valid}")
            return False
        if button is Button.EMERGENCY:
            self._bench.control.emergency_stop()
        if button is Button.RELEASE:
            self._bench.control.release()
        self.status = replace(self.status, phase=after, note="")
        return button in (Button.START, Button.SAMPLE)

    def take(self) -> RecordedView:
        """Take a view."""
        view = self._bench.sense()
        self._times.append(view.time)
        status = self.status
        self.status = replace(status, count=status.count + 1, view=view, rate=self._rate(), moved=Moved())
        return RecordedView(view, self._bench.odometry, status.travelled)

    def _rate(self) -> float:
        """Views a minute, over the last few."""
        passed = self._times[-1] - self._times[0]
        return 60 * (len(self._times) - 1) / passed if passed > 0 else 0.0

    def drive(self, commands: Commands) -> None:
        """Drive for a control period."""
        bench, before = self._bench, self._bench.odometry
        if commands.twist is None:
            bench.wait()
        else:
            bench.drive(commands.twist)
        now, step, moved = bench.odometry, Moved(), replace(self.status.moved)
        step.add(before, now, CONTROL_PERIOD)
        moved.add(before, now, CONTROL_PERIOD)
        state = bench.state
        self.status = replace(
            self.status,
            time=bench.time,
            moved=moved,
            travelled=self.status.travelled + step.distance,
            twist=state.twist,
            stops=state.stops,
            note=bench.fault or self.status.note,
        )
