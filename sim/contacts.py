"""What a robot touches: everything but the floor that it stands on."""

import numpy as np

from sim.bench import Bench

FLOOR = "floor"


class Touches:
    """Things of the world that the robot has touched since it is watched, by name, in the order of the first time.

    ``begun`` counts the times that a touch began: of the same thing once until it is let go.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench, prefix = bench, f"{bench.robot.name}/"
        self._names = [bench.model.geom(number).name for number in range(bench.model.ngeom)]
        self._own = np.array([bench.model.body(int(body)).name.startswith(prefix) for body in bench.model.geom_bodyid])
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
        met = pairs[mine[:, 0] != mine[:, 1]]
        others = met[~self._own[met]]
        now = frozenset(self._names[number] for number in others.tolist()) - {FLOOR}
        self.begun += len(now - self._now)
        self._now = now
        self._found |= dict.fromkeys(sorted(now - self._found.keys()))
        return now
