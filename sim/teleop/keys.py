"""Keys of a viewer as orders: a key that is held moves the robot, one that is pressed does something once."""

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

from robots import Twist
from sim.teleop.commands import SPEED, TURN_RATE, Button, Orders, Phase

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
"""What a key asks for as long as it is held: ahead, to the left."""
GOES_ON = MappingProxyType({Phase.READY: Button.START, Phase.SAMPLING: Button.PAUSE, Phase.PAUSED: Button.RESUME})
"""What the one key for starting, pausing and resuming asks for."""
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
"""Shares of the usual speeds among which faster and slower choose."""
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
"""What people are told of the keys; the last is the viewer's own."""


class Keyboard:
    """Keys to orders; it remembers the speed that was chosen."""

    def __init__(self) -> None:
        self._level = LEVELS.index(1.0)

    @property
    def speed(self) -> float:
        """How fast the robot is led [m/s]."""
        return SPEED * LEVELS[self._level]

    def orders(self, held: Collection[str], pressed: Sequence[str], phase: Phase) -> Orders:
        """What the keys ask for that are held, and that were pressed since the last time, in this order."""
        buttons = []
        for key in pressed:
            if key in (FASTER, SLOWER):
                self._level = min(max(self._level + (1 if key == FASTER else -1), 0), len(LEVELS) - 1)
            elif key == GO_ON and phase in GOES_ON:
                buttons.append(GOES_ON[phase])
            elif key in PRESSED:
                buttons.append(PRESSED[key])
        # A key and the arrow beside it ask for the same, not for twice as much; opposite keys cancel out.
        asked = {HELD[key] for key in held if key in HELD}
        ahead, turn = sum(one[0] for one in asked), sum(one[1] for one in asked)
        share = LEVELS[self._level]
        return Orders(Twist(ahead * share * SPEED, turn * share * TURN_RATE), tuple(buttons))
