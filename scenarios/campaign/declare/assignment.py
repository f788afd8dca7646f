"""Assignment of a mission: what a robot is to do, and who can lead it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq.missions.lamp import LampStage
    from refseq_bench.scenarios.missions.file import Asked

ODOMETRY, LAMP = "odometry", "lamp"
LEADERS = (ODOMETRY, LAMP)
"""Leaders of a robot beside the methods that know places: its odometer alone, and a program of sonars and odometry."""


@dataclass(frozen=True, slots=True)
class Target:
    """A place by the path that it is on: so far ``along`` it [m], None: at its end."""

    path: str
    along: float | None


@dataclass(frozen=True)
class Assignment:
    """Task of a robot: ``asked``, or to go to the ``target``, or, without these, what was learnt; and a program.

    ``goal`` [m] is where that ends, None: where the plan does on what was learnt.
    """

    asked: "Asked | None"
    target: Target | None
    stages: "tuple[LampStage, ...]"
    goal: tuple[float, float] | None
