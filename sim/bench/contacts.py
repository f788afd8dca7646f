"""Contacts of a robot with anything but the floor that it rolls on, and its room, by MuJoCo's collision geometry."""

import mujoco
import numpy as np

from refseq_bench.sim.bench.bench import Bench

ROOM = 0.05
"""A robot that is set down keeps so much from all things [m]; a choice."""


class ContactLog:
    """Things of the world that the robot has touched since it is watched, by name, in the order of the first time.

    The floor is one of them where something else than its wheels is on it. ``begun`` counts the times that a touch
    began: of the same thing once until it is let go.
    """

    def __init__(self, bench: Bench) -> None:
        model, prefix = bench.model, f"{bench.robot.name}/"
        self._bench = bench
        self._names = [model.geom(number).name for number in range(model.ngeom)]
        base = model.body(prefix + bench.robot.base).id
        self._own = model.body_rootid[model.geom_bodyid] == base
        # What rolls hangs on a joint of its own: wheels and casters.
        self._rolls = self._own & (model.geom_bodyid != base)
        self._floor = np.arange(model.ngeom) == model.geom("floor").id
        self._solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        self._reach = float(np.hypot(max(bench.robot.shape.ahead, bench.robot.shape.behind), 1.0))
        self._now: frozenset[str] = frozenset()
        self._found: dict[str, None] = {}
        self.begun = 0

    @property
    def found(self) -> tuple[str, ...]:
        """All of them."""
        return tuple(self._found)

    def look(self) -> frozenset[str]:
        """Look at this moment, and tell what is touched now."""
        pairs = self._bench.data.contact.geom
        mine = self._own[pairs]
        rolling = (self._rolls[pairs] & self._floor[pairs][:, ::-1]).any(axis=1)
        met = pairs[(mine[:, 0] != mine[:, 1]) & ~rolling]
        now = frozenset(self._names[number] for number in met[~self._own[met]].tolist())
        self.begun += len(now - self._now)
        self._now = now
        self._found |= dict.fromkeys(sorted(now - self._found.keys()))
        return now

    @property
    def has_room(self) -> bool:
        """True if it touches nothing, and would not if it stood a little elsewhere."""
        if self.look():
            return False
        model, data = self._bench.model, self._bench.data
        here = data.geom_xpos[self._own, :2].mean(axis=0)
        others = self._solid & ~self._own & ~self._floor
        away = np.hypot(*(data.geom_xpos[:, :2] - here).T) - model.geom_rbound
        near = np.flatnonzero(others & (away < self._reach + ROOM))
        mine = np.flatnonzero(self._own & self._solid)
        return all(
            mujoco.mj_geomDistance(model, data, int(a), int(b), 2 * ROOM, None) > ROOM for a in mine for b in near
        )
