"""What a robot touches that it does not roll on, by MuJoCo's contacts."""

import mujoco
import numpy as np

from sim.bench import Bench

ROOM = 0.05
"""A robot that is set down keeps so much from all things [m]; a choice."""


class Touching:
    """Looks at the robot of a bench: contacts of its own geoms with others, but those of what rolls with the floor."""

    def __init__(self, bench: Bench) -> None:
        self._model, self._data = bench.model, bench.data
        model, prefix = bench.model, f"{bench.robot.name}/"
        base = model.body(prefix + bench.robot.base).id
        bodies = model.geom_bodyid
        self._own = model.body_rootid[bodies] == base
        # What rolls hangs on a joint of its own: wheels and casters.
        self._rolls = self._own & (bodies != base)
        self._floor = np.zeros(model.ngeom, bool)
        self._floor[model.geom("floor").id] = True
        self._solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        self._reach = float(np.hypot(max(bench.robot.shape.ahead, bench.robot.shape.behind), 1.0))

    @property
    def now(self) -> bool:
        """Whether it touches anything at this moment."""
        pairs = self._data.contact.geom
        own, rolls, floor = self._own[pairs], self._rolls[pairs], self._floor[pairs]
        on_floor = (rolls & floor[:, ::-1]).any(axis=1)
        return bool(((own[:, 0] != own[:, 1]) & ~on_floor).any())

    @property
    def has_room(self) -> bool:
        """Whether it touches nothing, and would not if it stood a little elsewhere."""
        if self.now:
            return False
        model, data = self._model, self._data
        here = data.geom_xpos[self._own, :2].mean(axis=0)
        others = self._solid & ~self._own & ~self._floor
        away = np.hypot(*(data.geom_xpos[:, :2] - here).T) - model.geom_rbound
        near = np.flatnonzero(others & (away < self._reach + ROOM))
        mine = np.flatnonzero(self._own & self._solid)
        return all(
            mujoco.mj_geomDistance(model, data, int(a), int(b), 2 * ROOM, None) > ROOM for a in mine for b in near
        )
