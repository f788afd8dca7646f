"""One sitting at the controls: the robot goes where it is led, and views are taken as they are asked for."""

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

from sim.bench.bench import CONTROL_PERIOD, Bench
from sim.drives.recorder import Moved, Taken, Trigger
from sim.errors import SimError
from sim.teleop.commands import AFTER, Button, Hand, Orders, Phase, Status, valid_in

LATELY = 10
"""The rate is that of so many views."""


class AbortedError(SimError):
    """Whoever is at the controls gave the sitting up: nothing of it is to be kept."""


def familiarise(bench: Bench, hand: Hand, sampling: Trigger | None) -> Iterator[Taken]:
    """Let a hand lead the robot until it says stop; yields the views as they are taken, their progress by the odometer.

    The first is taken where the hand says start, then one whenever ``sampling`` says so (None: by hand only) or the
    hand asks for one. While the hand pauses there are none; motion counts on, so that one may be due when it goes on.
    The robot is led through its Control layer, with all its stops. Raises ``AbortedError`` where the hand gives up.
    """
    sitting = _Sitting(bench, sampling)
    while not sitting.status.phase.over:
        orders = hand.orders(sitting.status)
        if sitting.heed(orders.buttons):
            yield sitting.take()
        if not sitting.status.phase.over:
            sitting.go_on(orders)
    hand.orders(sitting.status)  # shows how it ended
    if sitting.status.phase is Phase.ABORTED:
        raise AbortedError(f"aborted at {bench.time:.1f} s, after {sitting.status.count} views: none is kept")


class _Sitting:
    """How things stand, and what changes it."""

    def __init__(self, bench: Bench, sampling: Trigger | None) -> None:
        self._bench, self._sampling = bench, sampling
        self._times: deque[float] = deque(maxlen=LATELY + 1)
        self.status = Status(time=bench.time)

    def heed(self, buttons: tuple[Button, ...]) -> bool:
        """Do what the buttons ask for; returns whether a view is due."""
        due = False
        for button in buttons:
            due |= self._press(button)
        status = self.status
        if status.phase is not Phase.SAMPLING:
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

    def take(self) -> Taken:
        """Take a view."""
        view = self._bench.sense()
        self._times.append(view.time)
        status = self.status
        self.status = replace(status, count=status.count + 1, view=view, rate=self._rate(), moved=Moved())
        return Taken(view, self._bench.odometry, status.gone)

    def _rate(self) -> float:
        """Views a minute, over the last few."""
        passed = self._times[-1] - self._times[0]
        return 60 * (len(self._times) - 1) / passed if passed > 0 else 0.0

    def go_on(self, orders: Orders) -> None:
        """Go on for a control period."""
        bench, before = self._bench, self._bench.odometry
        if orders.twist is None:
            bench.wait()
        else:
            bench.drive(orders.twist)
        now, step, moved = bench.odometry, Moved(), replace(self.status.moved)
        step.add(before, now, CONTROL_PERIOD)
        moved.add(before, now, CONTROL_PERIOD)
        state = bench.state
        self.status = replace(
            self.status,
            time=bench.time,
            moved=moved,
            gone=self.status.gone + step.distance,
            twist=state.twist,
            stops=state.stops,
            note=bench.fault or self.status.note,
        )
