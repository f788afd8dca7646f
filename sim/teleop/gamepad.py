"""Gamepads of Linux: joystick devices such as ``/dev/input/js0`` (kernel: Documentation/input/joydev).

The left stick leads the robot while a shoulder button is held (deadman); the buttons are those of most pads with two
sticks, as the kernel's xpad driver numbers them.
"""

import errno
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Self

from refseq_bench.robots import Twist
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.commands import SPEED, TURN_RATE, Button, SessionPhase
from refseq_bench.sim.teleop.keys import GOES_ON

FIRST = Path("/dev/input/js0")
EVENT = struct.Struct("=IhBB")
"""Time [ms], value, kind, number."""
PRESS, AXIS, FIRST_STATE = 0x01, 0x02, 0x80
"""Kinds; the last is set in addition in events that tell how things stand when the device is opened."""
FULL = 32767
QUIET = 0.12
"""Dead zone of a stick, in shares of its travel; a smaller one lets a worn stick creep."""
SIDEWAYS, AHEAD = 0, 1
DEADMAN = frozenset({4, 5})
GO_ON = 7
BUTTONS = MappingProxyType({0: Button.SAMPLE, 2: Button.EMERGENCY, 3: Button.RELEASE, 6: Button.STOP})
LEGEND = (
    "left stick, a shoulder button held; A: view; Start: start, pause, resume; Back: stop; X, Y: emergency, release"
)


@dataclass(slots=True)
class PadState:
    """Positions of the sticks, buttons that are held, and those pressed since they were last read."""

    axes: dict[int, float] = field(default_factory=dict)
    held: set[int] = field(default_factory=set)
    pressed: list[int] = field(default_factory=list)

    def take(self, data: bytes) -> None:
        """Take whole events."""
        for _, value, kind, number in EVENT.iter_unpack(data):
            if kind & ~FIRST_STATE == AXIS:
                share = max(-1.0, value / FULL)
                self.axes[number] = 0.0 if abs(share) < QUIET else share
            elif kind & ~FIRST_STATE == PRESS:
                (self.held.add if value else self.held.discard)(number)
                if value and not kind & FIRST_STATE:
                    self.pressed.append(number)

    @property
    def twist(self) -> Twist | None:
        """The stick's motion; None while no shoulder button is held."""
        if not self.held & DEADMAN:
            return None
        return Twist(-self.axes.get(AHEAD, 0.0) * SPEED, -self.axes.get(SIDEWAYS, 0.0) * TURN_RATE)

    def buttons(self, phase: SessionPhase) -> tuple[Button, ...]:
        """Take the buttons that were pressed since the last call."""
        numbers, self.pressed = self.pressed, []
        pressed = [GOES_ON.get(phase) if number == GO_ON else BUTTONS.get(number) for number in numbers]
        return tuple(button for button in pressed if button is not None)


class Gamepad:
    """A joystick device that is open. Raises ``SimError`` where there is none, or it may not be read."""

    def __init__(self, path: Path) -> None:
        self.path, self.pad, self._rest = path, PadState(), b""
        try:
            self._file: int | None = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise SimError(
                f"gamepad {path}: cannot be opened: {error.strerror}; valid is a joystick device such as {FIRST}"
            ) from None

    def read(self) -> PadState | None:
        """Read the pad as it is now; None when it was unplugged."""
        while self._file is not None:
            try:
                data = os.read(self._file, 64 * EVENT.size)
            except BlockingIOError:
                break
            except OSError as error:
                if error.errno == errno.EINTR:
                    continue
                data = b""
            if not data:  # unplugged
                self.close()
                break
            data = self._rest + data
            whole = len(data) - len(data) % EVENT.size
            self.pad.take(data[:whole])
            self._rest = data[whole:]
        return None if self._file is None else self.pad

    def close(self) -> None:
        """Give the device back."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
