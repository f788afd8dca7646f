"""Stepping MuJoCo so that a state which is no number stops the world instead of carrying it back to its beginning.

On such a state MuJoCo warns, resets all data to the model's initial state, time included, and goes on (its flag
``autoreset``). A robot would be back where its model was written, at time 0, and nobody would be told.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

import mujoco
import numpy as np

from refseq_bench.sim.errors import SimError

_KINDS = mujoco.mjtWarning
_BAD = [int(kind) for kind in (_KINDS.mjWARN_BADQPOS, _KINDS.mjWARN_BADQVEL, _KINDS.mjWARN_BADQACC)]
_NAMES = ("positions", "velocities", "accelerations")
_KEPT = mujoco.mjtState.mjSTATE_INTEGRATION
_FRAMES = (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight, mujoco.mj_comVel)


class Physics:
    """Steps ``data``; after a state that is no number, or huge, all stands still where it last was good.

    ``fault`` tells what was wrong and when; time goes on.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self.model, self.data = model, data
        self._warnings = data.warning.number  # a view: how often each was given
        self._timestep = float(model.opt.timestep)
        self._qpos, self._qvel = data.qpos, data.qvel  # views: by name they cost more than the look at them
        self._good = np.empty(mujoco.mj_stateSize(model, _KEPT))
        self.fault: str | None = None
        self.forgive()

    def forgive(self) -> None:
        """Take the present state for a good one; raises ``SimError`` where it is none."""
        if not self._finite():
            raise SimError("physics: positions and velocities must be finite")
        self._warnings[_BAD] = 0
        self.fault = None
        self._keep()

    def look(self) -> None:
        """Keep the present state, if it is good, before anybody reads it."""
        if self.fault is None and not self._finite():
            self._stand_still("positions or velocities", self.data.time)
        elif self.fault is None:
            self._keep()

    def update_frames(self) -> None:
        """Bring frames and velocities of bodies up to the positions: a step leaves them as they were at its beginning.

        The next step starts with the same reckoning, so it goes as it would have gone.
        """
        self.look()
        if self.fault is None:
            for stage in _FRAMES:
                stage(self.model, self.data)

    def step(self, count: int) -> None:
        """Go on by so many steps."""
        end = self.after(count)
        if self.fault is None:
            mujoco.mj_step(self.model, self.data, nstep=count)
        self.arrive(end)

    def after(self, count: int) -> float:
        """The time after so many steps [s], a whole number of them: sums of steps are 5 µs off after ten hours."""
        return (round(self.data.time / self._timestep) + count) * self._timestep

    def arrive(self, end: float) -> None:
        """Look at what ``data`` has come to by steps until ``end`` [s], whoever took them; with a fault none are."""
        self.data.time = end
        if self.fault is not None:
            return
        warnings = self._warnings
        if warnings[_BAD[0]] or warnings[_BAD[1]] or warnings[_BAD[2]]:  # in each tick: an array of three takes longer
            self._stand_still(" and ".join(np.array(_NAMES)[warnings[_BAD] > 0]), end)

    def _finite(self) -> bool:
        # They are few, and looked at in each tick: arrays would take four times as long.
        return all(map(math.isfinite, self._qpos.tolist())) and all(map(math.isfinite, self._qvel.tolist()))

    def _keep(self) -> None:
        mujoco.mj_getState(self.model, self.data, self._good, _KEPT)

    def _stand_still(self, what: str, time: float) -> None:
        mujoco.mj_setState(self.model, self.data, self._good, _KEPT)
        self.fault = f"physics: {what} were no numbers or huge after {self.data.time:.3f} s; all stands still since"
        self.data.time = time
        self.data.qvel[:], self.data.act[:], self.data.xfrc_applied[:] = 0.0, 0.0, 0.0
        mujoco.mj_forward(self.model, self.data)


T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Due:
    """So many ``steps`` of physics that somebody waits for."""

    physics: Physics
    steps: int

    def take(self) -> None:
        """Take them."""
        self.physics.step(self.steps)


def alone(run: Generator[Due, None, T]) -> T:
    """Let something go on to its end, and take the steps that it waits for; returns what it does."""
    while True:
        try:
            due = next(run)
        except StopIteration as end:
            result: T = end.value
            return result
        due.take()
