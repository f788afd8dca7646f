"""The log of a mission: a line for each switch and for all that does not go as it should."""

from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """Weight of a line of the log: all is well; something is not as it should be; the mission ends by it."""

    INFO = "INFO"
    WARN = "WARN"
    ERROR = "ERROR"


@dataclass(frozen=True, slots=True)
class Touch:
    """First touch of a ``thing`` of the world, by its name, at a ``time`` [s] of the mission."""

    time: float
    thing: str

    def __str__(self) -> str:
        return f"touches {self.thing}"


@dataclass(frozen=True, slots=True)
class Entry:
    """A line of the log: when [s], where the robot believed itself to be [m along its way], and what happened."""

    time: float
    along: float
    what: str
    level: Level = Level.INFO

    def __str__(self) -> str:
        return f"{self.time:7.1f} s {self.along:z7.1f} m  {self.what}"
