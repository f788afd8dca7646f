"""Contacts of a robot with anything but the floor that it rolls on, and its room, by MuJoCo's collision geometry."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from refseq.planar import wrap
from refseq_bench.sim.bench.bench import Bench

AHEAD = math.radians(45.0)
"""Bearing from which on a thing stands beside a robot, and not ahead of it [rad]; a choice."""
ROOM = 0.05
"""A robot that is set down keeps so much from all things [m]; a choice."""


class NearThing(NamedTuple):
    """A solid of the world by its name, near a part of the robot.

    ``gap`` is between the two [m], below 0 where they meet; ``bearing`` [rad] that of its nearest point from the
    robot's middle, to the left of where it looks.
    """

    name: str
    gap: float
    bearing: float


def thing_in_words(geom: str) -> str:
    """The thing that a solid is part of, as ``wall 'n1'`` for ``wall:n1:0``."""
    kind, _, name = geom.partition(":")
    return f"{kind} '{name.partition(':')[0]}'" if name else f"'{geom}'"


class ContactLog:
    """Things of the world that the robot has touched since it is watched, by name, in the order of the first time.

    The floor is one of them where something else than its wheels is on it. ``begun`` counts the times that a touch
    began: of the same thing once until it is let go.
    """

    def __init__(self, bench: Bench) -> None:
        model = bench.model
        self._bench = bench
        self._names = [model.geom(number).name for number in range(model.ngeom)]
        base = model.body(bench.named(bench.robot.base)).id
        self._own = model.body_rootid[model.geom_bodyid] == base
        # What rolls hangs on a joint of its own: wheels and casters.
        self._rolls = self._own & (model.geom_bodyid != base)
        self._floor = np.arange(model.ngeom) == model.geom("floor").id
        self._solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
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
        return not self.look() and all(thing.gap > ROOM for thing in self._gaps(2 * ROOM))

    def nearest_ahead(self, within: float) -> NearThing | None:
        """The thing ahead that is nearest to the robot, no farther than ``within`` [m]; None: nothing is."""
        ahead = (thing for thing in self._gaps(within) if thing.gap < within and abs(thing.bearing) < AHEAD)
        return min(ahead, key=lambda thing: thing.gap, default=None)

    def _gaps(self, within: float) -> Iterator[NearThing]:
        """Gaps between each part of the robot and each thing near it; ``within`` stands for all that is farther."""
        model, data, pose = self._bench.model, self._bench.data, self._bench.pose
        here, ends = data.geom_xpos[self._own, :2].mean(axis=0), np.zeros(6)
        others = self._solid & ~self._own & ~self._floor
        away = np.hypot(*(data.geom_xpos[:, :2] - (pose.x, pose.y)).T) - model.geom_rbound
        near = np.flatnonzero(others & (away < self._bench.robot.shape.swing + within))
        mine = np.flatnonzero(self._own & self._solid)
        for a in mine.tolist():
            for b in near.tolist():
                gap = mujoco.mj_geomDistance(model, data, a, b, within, ends)
                bearing = wrap(math.atan2(ends[4] - here[1], ends[3] - here[0]) - pose.heading)
                yield NearThing(self._names[b], gap, bearing)
