"""What somebody at the controls can ask for, and what the controls show him."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Protocol

from refseq.view import View
from robots import Stop, Twist
from sim.drives.recorder import Moved

SPEED = 0.4
"""How fast the robot is led [m/s] unless somebody says else; the operator's mean speed."""
TURN_RATE = 0.4
"""How fast it turns then [rad/s]; a choice."""
STILL = Twist()


class Button(StrEnum):
    """What is asked for once, apart from motion."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    SAMPLE = "sample"
    STOP = "stop"
    ABORT = "abort"
    EMERGENCY = "emergency"
    RELEASE = "release"


class Phase(StrEnum):
    """How far a sitting has come. Views are taken while it samples; the robot can be led in each phase but the last."""

    READY = "ready"
    SAMPLING = "sampling"
    PAUSED = "paused"
    STOPPED = "stopped"
    ABORTED = "aborted"

    @property
    def over(self) -> bool:
        """Whether nothing comes after it."""
        return self in (Phase.STOPPED, Phase.ABORTED)


UNDER_WAY = (Phase.READY, Phase.SAMPLING, Phase.PAUSED)
AFTER: Mapping[tuple[Phase, Button], Phase] = MappingProxyType(
    {
        (Phase.READY, Button.START): Phase.SAMPLING,
        (Phase.SAMPLING, Button.PAUSE): Phase.PAUSED,
        (Phase.PAUSED, Button.RESUME): Phase.SAMPLING,
        (Phase.SAMPLING, Button.SAMPLE): Phase.SAMPLING,
        **{(phase, Button.STOP): Phase.STOPPED for phase in UNDER_WAY},
        **{(phase, Button.ABORT): Phase.ABORTED for phase in UNDER_WAY},
        **{(phase, button): phase for phase in UNDER_WAY for button in (Button.EMERGENCY, Button.RELEASE)},
    }
)
"""The phase after a button; a button that is not here in some phase does nothing in it."""


def valid_in(phase: Phase) -> tuple[Button, ...]:
    """The buttons that do something in a phase."""
    return tuple(button for button in Button if (phase, button) in AFTER)


@dataclass(frozen=True, slots=True)
class Orders:
    """What is asked for at a moment: a motion, and buttons in the order in which they were pressed.

    ``twist`` None: nobody is at the controls. The robot is then commanded nothing, and its own watch for commands that
    do not come stops it (deadman).
    """

    twist: Twist | None = STILL
    buttons: tuple[Button, ...] = ()


@dataclass(frozen=True, slots=True)
class Status:
    """What the controls show: phase and simulated ``time`` [s], and what was taken until now.

    ``count`` views, ``view`` the last of them, ``rate`` how many a minute of simulated time lately, ``moved`` since the
    last. ``gone`` [m] is the way by the odometer, ``twist`` the motion that the robot measured, ``stops`` its reasons
    not to go. ``note`` tells what became of a button that did nothing.
    """

    time: float = 0.0
    phase: Phase = Phase.READY
    count: int = 0
    view: View | None = None
    rate: float = 0.0
    moved: Moved = field(default_factory=Moved)
    gone: float = 0.0
    twist: Twist = field(default_factory=Twist)
    stops: tuple[Stop, ...] = ()
    note: str = ""


class Hand(Protocol):
    """Whoever is at the controls: asked in each control period, and shown how things stand."""

    def orders(self, status: Status) -> Orders:
        """What is asked for now."""
