"""States of a mission, and the table of the transitions between them (drawn in docs/missions.md)."""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType


class Status(Enum):
    """State of a mission."""

    LOCALISING = "localising"
    """It stands until a view tells where it begins."""
    TRAVELLING = "travelling"
    """It runs a behaviour that lasts until a landmark is reached."""
    APPROACHING = "approaching"
    """It goes the last metres to a landmark by the odometer."""
    MANOEUVRING = "manoeuvring"
    """It runs a behaviour that ends by itself: a turn, a crossing, a set point."""
    AT_TASK = "at a task"
    """It stands and does the tasks of a landmark."""
    LOST = "lost"
    """It stands until views agree on where it is."""
    PAUSED = "paused"
    """It stands until somebody lets it go on."""
    COMPLETED = "completed"
    FAILED = "failed"
    ABORTED = "aborted"

    @property
    def moving(self) -> bool:
        """True while the robot runs a behaviour."""
        return self in MOVING

    @property
    def over(self) -> bool:
        """True once nothing comes any more."""
        return not TRANSITIONS[self]

    @property
    def completed(self) -> bool:
        """True where all was done."""
        return self is Status.COMPLETED


MOVING = (Status.TRAVELLING, Status.APPROACHING, Status.MANOEUVRING)
"""The robot runs a behaviour; in all other states it stands."""

_ORDER = dict.fromkeys(MOVING, "order") | {Status.AT_TASK: "tasks", Status.FAILED: "behind the goal"}
"""An order begins: with its tasks, where any are due; a place behind the goal has none."""
_RESUMED = dict.fromkeys((Status.LOCALISING, *MOVING, Status.AT_TASK, Status.LOST), "resume")
_STOPPED = {Status.PAUSED: "pause", Status.ABORTED: "abort"}

TRANSITIONS: Mapping[Status, Mapping[Status, str]] = MappingProxyType(
    {
        Status.LOCALISING: _ORDER | _STOPPED | {Status.FAILED: "patience over, behind the goal"},
        Status.TRAVELLING: _ORDER
        | _STOPPED
        | {
            Status.APPROACHING: "landmark near",
            Status.LOST: "views disagree",
            Status.FAILED: "behaviour failed, timeout, landmark missed",
        },
        Status.APPROACHING: _ORDER
        | _STOPPED
        | {
            Status.LOST: "views disagree",
            Status.COMPLETED: "goal reached",
            Status.FAILED: "behaviour failed, timeout",
        },
        Status.MANOEUVRING: _ORDER
        | _STOPPED
        | {Status.COMPLETED: "goal reached", Status.FAILED: "behaviour failed, timeout"},
        Status.AT_TASK: _ORDER | _STOPPED | {Status.COMPLETED: "goal's tasks done"},
        Status.LOST: _ORDER | _STOPPED | {Status.FAILED: "patience over, behind the goal"},
        Status.PAUSED: _RESUMED | {Status.ABORTED: "abort"},
        Status.COMPLETED: {},
        Status.FAILED: {},
        Status.ABORTED: {},
    }
)
"""For each state those that may follow it, and the event that leads there."""
