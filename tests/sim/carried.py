"""A bare scanner that flies level at the height of walls, and places for it to measure."""

import math
from collections.abc import Iterable, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.sensors.beams import GLASS_GROUPS, SEEN_GROUPS, Hits, cast, sweep
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.sim.sensors.laser_echoes import LaserEchoes
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.sim.sensors.ray_scene import RayScene

ROOM = (8.0, 5.0)
REACH = 100.0
SITE, BODY = "laser", "carrier"
BEARINGS = np.radians(-90 + 0.5 * np.arange(361))


class Carried:
    """The scanner at the origin, looking along x, at rest."""

    def __init__(self, spec: mujoco.MjSpec) -> None:
        carrier = spec.worldbody.add_body(name=BODY)
        carrier.add_freejoint()
        carrier.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.05, 0, 0))
        carrier.add_site(name=SITE)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.place()

    def place(
        self, x: float = 0.0, y: float = 0.0, heading: float = 0.0, speed: Sequence[float] = (0, 0), turn: float = 0.0
    ) -> None:
        """Put it somewhere, moving with ``speed`` (2,) [m/s] in the world's axes and ``turn`` [rad/s]."""
        self.data.qpos[:] = (x, y, 0, math.cos(heading / 2), 0, 0, math.sin(heading / 2))
        self.data.qvel[:] = (*speed, 0, 0, 0, turn)
        mujoco.mj_forward(self.model, self.data)

    def cast(self, rays: NDArray[np.float64], glass: bool = False) -> Hits:
        groups = GLASS_GROUPS if glass else SEEN_GROUPS
        looks = sweep(self.model, self.data, SITE)
        return cast(RayScene(self.model), self.data, looks, rays, groups, self.model.body(BODY).id, REACH)

    def echoes(self) -> LaserEchoes:
        laser = Laser(LaserModel(), np.random.default_rng(0))
        return laser.echoes(self.model, self.data, SITE, BODY)


def boxes(*centres_and_halves: tuple[Sequence[float], Sequence[float]], **how: object) -> mujoco.MjSpec:
    """Upright boxes: centre (2,) and half size (2,) [m], of 2 m half height."""
    spec = mujoco.MjSpec()
    spec.nuser_geom = 1
    spec.compiler.degree = False
    for centre, half in centres_and_halves:
        add_box(spec, centre, half, **how)
    return spec


def add_box(spec: mujoco.MjSpec, centre: Iterable[float], half: Iterable[float], **how: object) -> None:
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=(*centre, 0.0), size=(*half, 2.0), **how)


def room() -> mujoco.MjSpec:
    """Four walls, whose inner faces are ``ROOM`` apart."""
    x, y = ROOM[0] / 2, ROOM[1] / 2
    across = [((side * (x + 0.1), 0.0), (0.1, y + 0.2)) for side in (-1, 1)]
    along = [((0.0, side * (y + 0.1)), (x + 0.2, 0.1)) for side in (-1, 1)]
    return boxes(*across, *along)


def wall_at(x: float, half_width: float = 500.0, **how: object) -> mujoco.MjSpec:
    """A wall whose face is at ``x``, square to the x axis."""
    return boxes(((x + 0.1, 0.0), (0.1, half_width)), **how)


def room_distances(
    x: float | NDArray[np.float64], y: float | NDArray[np.float64], angles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distances to the walls of the room from a point in it along ``angles`` of the world, by hand."""
    with np.errstate(divide="ignore", over="ignore"):
        across = (np.copysign(ROOM[0] / 2, np.cos(angles)) - x) / np.cos(angles)
        along = (np.copysign(ROOM[1] / 2, np.sin(angles)) - y) / np.sin(angles)
    return np.minimum(across, along)
