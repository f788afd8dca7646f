"""A bystander, who takes pictures of a mission."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.missions import Executor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.chase_camera import ChaseCamera


@dataclass(frozen=True, slots=True)
class MissionFrame:
    """A bystander's picture at a ``time`` [s], where the robot believes itself to be, and what it does."""

    time: float
    along: float
    doing: str
    image: NDArray[np.uint8]


class Bystander:
    """Looks at a mission every so many seconds of it, and whenever the robot begins with something else."""

    def __init__(self, every: float) -> None:
        self._every = every
        self._chase_camera: ChaseCamera | None = None
        self._doing = ""
        self._due = 0.0
        self.frames: list[MissionFrame] = []

    def __call__(self, executor: Executor, bench: Bench) -> None:
        """A control period has gone by."""
        doing = executor.doing or executor.status.value
        if bench.time < self._due and doing == self._doing:
            return
        self._chase_camera = self._chase_camera or ChaseCamera(bench)
        self.frames.append(MissionFrame(bench.time, executor.along, doing, self._chase_camera.look()))
        self._doing, self._due = doing, bench.time + self._every
