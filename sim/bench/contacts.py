"""What a robot touches: everything but the floor that it rolls on, by MuJoCo's contacts."""

import numpy as np

from sim.bench.bench import Bench


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
        self.own = model.body_rootid[model.geom_bodyid] == base
        """Which geoms are the robot's, (n,)."""
        # What rolls hangs on a joint of its own: wheels and casters.
        self._rolls = self.own & (model.geom_bodyid != base)
        self.floor = np.arange(model.ngeom) == model.geom("floor").id
        """Which geom is the floor, (n,)."""
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
        mine = self.own[pairs]
        rolling = (self._rolls[pairs] & self.floor[pairs][:, ::-1]).any(axis=1)
        met = pairs[(mine[:, 0] != mine[:, 1]) & ~rolling]
        now = frozenset(self._names[number] for number in met[~self.own[met]].tolist())
        self.begun += len(now - self._now)
        self._now = now
        self._found |= dict.fromkeys(sorted(now - self._found.keys()))
        return now
