"""Declared faults of sensors: which sensor, what is wrong with it, since which view, and by what evidence."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

ODOMETRY, CLOCK = "odometry", "clock"
"""Names of the odometer and of the stamps where faults are told; the other names are those of a view's sensors."""


class FaultKind(StrEnum):
    """Faults that are declared."""

    BLANK = "blank"
    """A camera's pictures show nothing: covered, unplugged, overexposed."""
    FROZEN = "frozen"
    """A sensor repeats its last measurement while the robot moves; an odometer stands while the robot moves."""
    BLIND = "blind"
    """Many beams of a laser come back no more: dazzled, covered."""
    MIRRORED = "mirrored"
    """A laser is upside down: left and right are exchanged."""
    LOST = "lost"
    """The odometer tells nothing, or nothing any more."""
    DOUBLED = "doubled"
    """The odometer counts twice the way."""
    REVERSED = "reversed"
    """The odometer's way, its turns or both have the wrong sign."""
    SLIPPING = "slipping"
    """The odometer counts a way while the robot stands."""
    JUMPING = "jumping"
    """Stamps go back, stand still, or go on faster than any pause or any robot explains."""
    EXCHANGED = "exchanged"
    """Two cameras' pictures have changed places."""


@dataclass(frozen=True, slots=True)
class DeclaredFault:
    """A fault that stands: ``sensor`` is ill in this way ``since`` a view (counted from 0), stamped ``time`` [s].

    ``evidence`` is the log-likelihood ratio of the fault against health when it was declared [nats].
    """

    sensor: str
    kind: FaultKind
    since: int
    time: float
    evidence: float

    def __str__(self) -> str:
        return f"{self.sensor} {self.kind} since view {self.since}"


def declared_in(faults: Iterable[Iterable[DeclaredFault]]) -> tuple[DeclaredFault, ...]:
    """Each fault that stood in some of the views once, in the order in which they were declared."""
    return tuple(dict.fromkeys(fault for at_view in faults for fault in at_view))
