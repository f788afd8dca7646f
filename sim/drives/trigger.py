"""Triggers of views: how far a robot has moved since the last one, and whether that calls for the next."""

from dataclasses import asdict, dataclass

import numpy as np

from refseq.planar import Pose, wrap
from refseq_bench.sim.drives.view_spacing import LEARNT_EVERY
from refseq_bench.sim.errors import SimError

ROUNDING = 1e-9
"""Share by which a sum of control periods may miss the time that they last: ten of 0.04 s make less than 0.4 s."""


@dataclass(frozen=True, slots=True)
class Trigger:
    """A view is taken when the odometer has gone ``distance`` [m] or turned ``turn`` [rad], or after ``time`` [s].

    None switches one off. Raises ``SimError`` when a threshold is not positive, or when all are off.
    """

    distance: float | None = LEARNT_EVERY
    turn: float | None = None
    time: float | None = None

    def __post_init__(self) -> None:
        given = asdict(self)
        if all(value is None for value in given.values()):
            raise SimError("trigger: distance, turn and time are all off; valid is at least one of them")
        for name, value in given.items():
            if value is not None and not 0 < value < np.inf:
                raise SimError(f"trigger: {name} = {value} is not positive and finite")

    def fires(self, moved: "Moved") -> bool:
        """True if so much motion calls for a view."""
        pairs = ((self.distance, moved.distance), (self.turn, abs(moved.turn)), (self.time, moved.time))
        return any(limit is not None and value >= limit * (1 - ROUNDING) for limit, value in pairs)


@dataclass(slots=True)
class Moved:
    """Motion by the odometer since the last view: path length [m], turn [rad], time [s]."""

    distance: float = 0.0
    turn: float = 0.0
    time: float = 0.0

    def add(self, before: Pose, after: Pose, elapsed: float) -> None:
        """Count one control period on."""
        self.distance += float(np.hypot(after.x - before.x, after.y - before.y))
        self.turn += wrap(after.heading - before.heading)
        self.time += elapsed
