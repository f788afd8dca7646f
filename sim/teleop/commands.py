"""Commands of a teleoperation session, and the status that the controls show."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Protocol

from refseq.view import View
from refseq_bench.robots import Stop, Twist
from refseq_bench.sim.drives.trigger import Moved

SPEED = 0.4
"""Usual speed [m/s]: the mean of the simulated operator; keys and sticks scale it."""
TURN_RATE = 0.4
"""Usual rate of turn [rad/s]; a higher one is harder to lead by keys."""
STILL = Twist()


class Button(StrEnum):
    """A command that acts once, unlike motion, which is held."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    SAMPLE = "sample"
    STOP = "stop"
    ABORT = "abort"
    EMERGENCY = "emergency"
    RELEASE = "release"


class SessionPhase(StrEnum):
    """The phase of a session; views are taken while it samples, and the robot is led until it is over."""

    READY = "ready"
    SAMPLING = "sampling"
    PAUSED = "paused"
    STOPPED = "stopped"
    ABORTED = "aborted"

    @property
    def over(self) -> bool:
        """True when no phase follows."""
        return self in (SessionPhase.STOPPED, SessionPhase.ABORTED)


UNDER_WAY = (SessionPhase.READY, SessionPhase.SAMPLING, SessionPhase.PAUSED)
AFTER: Mapping[tuple[SessionPhase, Button], SessionPhase] = MappingProxyType(
    {
        (SessionPhase.READY, Button.START): SessionPhase.SAMPLING,
        (SessionPhase.SAMPLING, Button.PAUSE): SessionPhase.PAUSED,
        (SessionPhase.PAUSED, Button.RESUME): SessionPhase.SAMPLING,
        (SessionPhase.SAMPLING, Button.SAMPLE): SessionPhase.SAMPLING,
        **{(phase, Button.STOP): SessionPhase.STOPPED for phase in UNDER_WAY},
        **{(phase, Button.ABORT): SessionPhase.ABORTED for phase in UNDER_WAY},
        **{(phase, button): phase for phase in UNDER_WAY for button in (Button.EMERGENCY, Button.RELEASE)},
    }
)
"""The phase after a button; a pair that is not listed leaves everything as it is."""


def valid_in(phase: SessionPhase) -> tuple[Button, ...]:
    """List the buttons that act in a phase."""
    return tuple(button for button in Button if (phase, button) in AFTER)


@dataclass(frozen=True, slots=True)
class Commands:
    """The commands of one control period: a motion, and buttons in the order in which they were pressed.

    ``twist`` None: nobody is at the controls. The robot then receives no command and stops by its own watchdog.
    """

    twist: Twist | None = STILL
    buttons: tuple[Button, ...] = ()


@dataclass(frozen=True, slots=True)
class SessionStatus:
    """The state of a session, as the controls show it: phase, simulated ``time`` [s], and the views so far.

    ``count`` views were taken, ``view`` is the last of them, ``rate`` the number a minute of simulated time lately,
    ``moved`` the motion since the last. ``travelled`` is the length of the path by the odometer [m], ``twist`` the
    motion that the robot measured, ``stops`` its reasons not to move. ``note`` explains a button that did nothing.
    """

    time: float = 0.0
    phase: SessionPhase = SessionPhase.READY
    count: int = 0
    view: View | None = None
    rate: float = 0.0
    moved: Moved = field(default_factory=Moved)
    travelled: float = 0.0
    twist: Twist = field(default_factory=Twist)
    stops: tuple[Stop, ...] = ()
    note: str = ""


class CommandSource(Protocol):
    """A person or script at the controls: asked in each control period, and shown the status."""

    def commands(self, status: SessionStatus) -> Commands:
        """Return the commands of this control period."""
