"""Description of a robot for whoever puts it into a world: model, names in it, size and limits, its Control layer."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from refseq_bench.robots.control import ControlLayer
from refseq_bench.robots.motion import DifferentialDrive, Limits
from refseq_bench.robots.odometry import Geometry

if TYPE_CHECKING:  # behaviours know a robot's shape, and need no physics
    import mujoco


@dataclass(frozen=True, slots=True)
class Shape:
    """Room that a robot takes [m]: how far it reaches ahead of its axle and behind it, and to either side.

    ``height`` [m] is that of all above the floor.
    """

    ahead: float
    behind: float
    half_width: float
    height: float

    @property
    def swing(self) -> float:
        """Radius [m] of the circle that a robot takes which turns on the spot."""
        return math.hypot(max(self.ahead, self.behind), self.half_width)


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot ready to be put into any number of worlds.

    ``spec`` is fresh and belongs to the caller; a bench attaches a copy of it. The other names are those in ``spec``,
    before any prefix: ``base`` the body with the free joint, ``cameras``, the ``laser``'s site, joints and actuators of
    the drive wheels as (left, right), ``bumpers`` the geom of each bumper by its name, ``sonars`` sites of which x
    looks along the beam, in the order of the readings. ``pulses_per_turn`` is what an encoder counts in one turn of a
    wheel, ``limits`` are those of the Control layer, which ``control`` makes for a robot that believes in a geometry of
    its wheels.
    """

    name: str
    spec: "mujoco.MjSpec"
    base: str
    drive: DifferentialDrive
    limits: Limits
    shape: Shape
    cameras: tuple[str, ...]
    laser: str
    wheel_joints: tuple[str, str]
    wheel_actuators: tuple[str, str]
    pulses_per_turn: int
    control: Callable[[Geometry], ControlLayer]
    bumpers: Mapping[str, str]
    sonars: tuple[str, ...] = ()
