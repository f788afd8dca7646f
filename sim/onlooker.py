"""Somebody who stands by and takes pictures of a robot from outside; it changes nothing that happens."""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.bench import Bench
from worlds.build import World

CAMERA = "onlooker"
SIZE = (640, 480)
"""Size of a picture [px]."""
FOVY = 45.0
"""Its camera's field of view from top to bottom [deg]; a choice."""
MIDDLE = 0.65
"""Height that it looks at [m]."""
EYES = 1.6
"""Height of its eyes [m]."""
APART = 0.3
"""It keeps so far from walls [m]."""
BEARINGS = 24
"""Directions that it tries for a place to stand."""
EXPOSED = 0.8
"""What is as bright as half of a picture gets so much of white; a choice."""
GAMMA = 2.2
WHITE = 3.0
"""What is so much brighter than a screen's white at that exposure is white; a choice."""


def with_onlooker(world: World) -> World:
    """Add the onlooker's camera to a fresh ``world``, and return it."""
    world.spec.worldbody.add_camera(name=CAMERA, pos=(0, 0, EYES), fovy=FOVY, resolution=SIZE)
    picture = world.spec.visual.global_
    picture.offwidth, picture.offheight = max(picture.offwidth, SIZE[0]), max(picture.offheight, SIZE[1])
    return world


class Onlooker:
    """Looks at the robot of a ``bench`` from ``bearing`` [rad, 0 is ahead of it] and ``distance`` [m].

    Where a wall is in the way, it goes round to the nearest place from which it sees the robot.
    """

    def __init__(self, bench: Bench, bearing: float = -math.pi / 2, distance: float = 3.2, eyes: float = EYES) -> None:
        self._bench, self._bearing, self._distance, self._eyes = bench, bearing, distance, eyes

    def look(self) -> NDArray[np.uint8]:
        """A picture (height, width) of the robot as it is now."""
        bench = self._bench
        self._stand(*self._place())
        bench.renderer.light_around(bench.world.ambient.at(bench.data.camera(CAMERA).xpos))
        return developed(bench.renderer.radiance(bench.data, CAMERA, *SIZE))

    def _place(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where it stands and what it looks at, (3,) each [m]."""
        pose = self._bench.pose
        target = np.array([pose.x, pose.y, MIDDLE])
        turns = np.linspace(0.0, math.pi, BEARINGS // 2 + 1)
        tried = []
        for turn in (sign * step for step in turns for sign in (1, -1)):
            way = self._way(pose.heading + self._bearing + turn)
            free = self._free(target, way)
            if free >= self._distance:
                return target + self._distance * way, target
            tried.append((free, way))
        free, way = max(tried, key=lambda each: each[0])
        return target + free * way, target

    def _way(self, bearing: float) -> NDArray[np.float64]:
        """Unit vector from what it looks at to its eyes, (3,)."""
        rise = (self._eyes - MIDDLE) / self._distance
        level = math.sqrt(max(1 - rise * rise, 0.0))
        return np.array([level * math.cos(bearing), level * math.sin(bearing), rise])

    def _free(self, target: NDArray[np.float64], way: NDArray[np.float64]) -> float:
        """How far one may stand back along ``way`` [m] before something is in the way."""
        bench = self._bench
        begin = self.clear
        hit, base = np.zeros(1, np.int32), bench.model.body(f"{bench.robot.name}/{bench.robot.base}").id
        found = mujoco.mj_ray(bench.model, bench.data, target + begin * way, way, None, 1, base, hit)
        return math.inf if found < 0 else begin + found - APART

    @property
    def clear(self) -> float:
        """Distance from the robot's middle at which its own parts have ended [m]."""
        shape = self._bench.robot.shape
        return math.hypot(max(shape.ahead, shape.behind), shape.half_width)

    def _stand(self, eyes: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        bench = self._bench
        back = (eyes - target) / np.linalg.norm(eyes - target)
        right = np.cross((0.0, 0.0, 1.0), back)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(back, right), back], axis=1)  # camera: right, up, back
        camera, turn = bench.model.camera(CAMERA), np.zeros(4)
        mujoco.mju_mat2Quat(turn, axes.ravel())
        camera.pos[:], camera.quat[:] = eyes, turn
        mujoco.mj_camlight(bench.model, bench.data)


def developed(luminance: NDArray[np.float32]) -> NDArray[np.uint8]:
    """A picture for people from luminance [cd/m²], uint8; light that is much brighter than the middle fades to white.

    The curve is Reinhard's (2002) with a white point: L (1 + L / W²) / (1 + L).
    """
    seen = luminance[luminance > 0]
    middle = float(np.median(seen)) if seen.size else 1.0
    light = EXPOSED**GAMMA * luminance / middle
    shown = light * (1 + light / WHITE**2) / (1 + light)
    return (255 * np.clip(shown, 0, 1) ** (1 / GAMMA)).astype(np.uint8)
