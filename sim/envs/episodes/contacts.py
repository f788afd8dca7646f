"""What a robot touches that it does not roll on, by MuJoCo's contacts."""

import mujoco
import numpy as np

from sim.bench.bench import Bench
from sim.bench.contacts import ContactLog

ROOM = 0.05
"""A robot that is set down keeps so much from all things [m]; a choice."""


class ContactCheck:
    """Whether the robot of a bench touches anything, and whether it has room where it stands."""

    def __init__(self, bench: Bench) -> None:
        self._model, self._data, self._touches = bench.model, bench.data, ContactLog(bench)
        self._solid = (bench.model.geom_contype != 0) | (bench.model.geom_conaffinity != 0)
        self._reach = float(np.hypot(max(bench.robot.shape.ahead, bench.robot.shape.behind), 1.0))

    @property
    def now(self) -> bool:
        """Whether it touches anything at this moment."""
        return bool(self._touches.look())

    @property
    def has_room(self) -> bool:
        """Whether it touches nothing, and would not if it stood a little elsewhere."""
        if self.now:
            return False
        model, data = self._model, self._data
        here = data.geom_xpos[self._touches.own, :2].mean(axis=0)
        others = self._solid & ~self._touches.own & ~self._touches.floor
        away = np.hypot(*(data.geom_xpos[:, :2] - here).T) - model.geom_rbound
        near = np.flatnonzero(others & (away < self._reach + ROOM))
        mine = np.flatnonzero(self._touches.own & self._solid)
        return all(
            mujoco.mj_geomDistance(model, data, int(a), int(b), 2 * ROOM, None) > ROOM for a in mine for b in near
        )
