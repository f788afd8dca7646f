"""Keys of a viewer as commands: a key that is held moves the robot, one that is pressed acts once."""

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

from refseq_bench.robots import Twist
from refseq_bench.sim.teleop.commands import SPEED, TURN_RATE, Button, Commands, SessionPhase

HELD: Mapping[str, tuple[int, int]] = MappingProxyType(
    {
        "W": (1, 0),
        "S": (-1, 0),
        "A": (0, 1),
        "D": (0, -1),
        "UpArrow": (1, 0),
        "DownArrow": (-1, 0),
        "LeftArrow": (0, 1),
        "RightArrow": (0, -1),
    }
)
"""Motion of a key while it is held, in shares of the speed ahead and of the rate to the left."""
GOES_ON = MappingProxyType(
    {SessionPhase.READY: Button.START, SessionPhase.SAMPLING: Button.PAUSE, SessionPhase.PAUSED: Button.RESUME}
)
"""The button of the one key that starts, pauses and resumes."""
GO_ON = "Space"
PRESSED: Mapping[str, Button] = MappingProxyType(
    {
        "V": Button.SAMPLE,
        "X": Button.STOP,
        "Delete": Button.ABORT,
        "E": Button.EMERGENCY,
        "R": Button.RELEASE,
    }
)
FASTER, SLOWER = "Equal", "Minus"
OTHER_LOOK = "C"
LEVELS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5)
"""Shares of the usual speeds that the keys for faster and slower step through."""
LEGEND = (
    ("W A S D", "or arrows, held: lead the robot"),
    ("Space", "start, pause, resume sampling"),
    ("V", "take a view"),
    ("+ -", "faster, slower"),
    ("E, R", "emergency stop, release"),
    ("X", "stop, and keep the recording"),
    ("Delete", "abort, and keep nothing"),
    ("C", "look from behind, above, a camera"),
)
"""The keys' help; the last key is the viewer's own."""


class Keyboard:
    """Turns keys into commands; keeps the speed that was chosen."""

    def __init__(self) -> None:
        self._level = LEVELS.index(1.0)

    @property
    def speed(self) -> float:
        """The speed ahead that a held key commands [m/s]."""
        return SPEED * LEVELS[self._level]

    def commands(self, held: Collection[str], pressed: Sequence[str], phase: SessionPhase) -> Commands:
        """Commands of the keys that are held, and of those pressed since the last call, in their order."""
        buttons = []
        for key in pressed:
            if key in (FASTER, SLOWER):
                self._level = min(max(self._level + (1 if key == FASTER else -1), 0), len(LEVELS) - 1)
            elif key == GO_ON and phase in GOES_ON:
                buttons.append(GOES_ON[phase])
            elif key in PRESSED:
                buttons.append(PRESSED[key])
        # A key and the arrow beside it ask for the same, not for twice as much; opposite keys cancel out.
        motions = {HELD[key] for key in held if key in HELD}
        ahead, turn = sum(motion[0] for motion in motions), sum(motion[1] for motion in motions)
        share = LEVELS[self._level]
        return Commands(Twist(ahead * share * SPEED, turn * share * TURN_RATE), tuple(buttons))
