"""Somebody who stands by and takes pictures of a robot from outside; it changes nothing that happens."""

import math
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.bench.bench import Bench
from refseq_bench.worlds.build import World

CAMERA = "chase-camera"
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
POINTS = ((-0.35, 0.15), (-0.35, MIDDLE), (0.0, 0.15), (0.0, MIDDLE), (0.0, 1.2), (0.35, 0.15), (0.35, MIDDLE))
"""Points of a robot that are to be seen: to the side of its middle and above the floor [m]; a choice."""
EXPOSED = 0.65
"""Share of white that the median brightness of a picture gets; a choice."""
GAMMA = 2.2
WHITE = 1.5
"""Brightness over a screen's white, at that exposure, that is drawn white; a choice."""


def with_chase_camera(world: World) -> World:
    """Add the chase camera to a fresh ``world``, and return it."""
    world.spec.worldbody.add_camera(name=CAMERA, pos=(0, 0, EYES), fovy=FOVY, resolution=SIZE)
    picture = world.spec.visual.global_
    picture.offwidth, picture.offheight = max(picture.offwidth, SIZE[0]), max(picture.offheight, SIZE[1])
    return world


class _Hit(NamedTuple):
    """Hit of a ray: at which distance [m], and whether it is the robot."""

    distance: float
    robot: bool


class ChaseCamera:
    """Looks at the robot of a ``bench`` from ``bearing`` [rad, 0 is ahead of it] and ``distance`` [m].

    Where something is in the way, it goes round to the nearest place from which it sees the robot.
    """

    def __init__(self, bench: Bench, bearing: float = -math.pi / 2, distance: float = 3.2, eyes: float = EYES) -> None:
        self._bench, self._bearing, self._distance, self._eyes = bench, bearing, distance, eyes

    def look(self) -> NDArray[np.uint8]:
        """A picture (height, width) of the robot as it is now."""
        bench = self._bench
        self._stand(*self._place())
        bench.renderer.light_around(partial(bench.world.ambient.at, bench.data.camera(CAMERA).xpos))
        return developed(bench.renderer.radiance(bench.data, CAMERA, *SIZE))

    def _place(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where it stands and what it looks at, (3,) each [m]: the first place from which all is seen, or the best."""
        pose = self._bench.pose
        target = np.array([pose.x, pose.y, MIDDLE])
        turns = [sign * step for step in np.linspace(0.0, math.pi, BEARINGS // 2 + 1) for sign in (1, -1)]
        best, chosen = -1.0, target
        for turn in turns:
            way = self._way(pose.heading + self._bearing + turn)
            back = min(self._distance, self._free(target, way))
            worth = self._seen_from(target + back * way) * back / self._distance
            if worth > best + 1e-9:
                best, chosen = worth, target + back * way
            if best >= 1.0:
                break
        return chosen, target

    def _way(self, bearing: float) -> NDArray[np.float64]:
        """Unit vector from what it looks at to its eyes, (3,)."""
        rise = (self._eyes - MIDDLE) / self._distance
        level = math.sqrt(max(1 - rise * rise, 0.0))
        return np.array([level * math.cos(bearing), level * math.sin(bearing), rise])

    def _free(self, target: NDArray[np.float64], way: NDArray[np.float64]) -> float:
        """Distance that one may stand back along ``way`` [m] before something is in it."""
        clear = self._bench.robot.shape.swing  # there its own parts have ended
        hit = self._ray(target + clear * way, way)
        return clear + hit.distance - APART

    def _seen_from(self, eyes: NDArray[np.float64]) -> float:
        """Share of some points of the robot that are seen from there."""
        pose, seen = self._bench.pose, 0
        side = np.array([eyes[1] - pose.y, pose.x - eyes[0]]) / math.hypot(eyes[0] - pose.x, eyes[1] - pose.y)
        for across, height in POINTS:
            point = np.array([pose.x + across * side[0], pose.y + across * side[1], height])
            far = float(np.linalg.norm(point - eyes))
            hit = self._ray(eyes, (point - eyes) / far)
            seen += hit.robot or hit.distance >= far
        return seen / len(POINTS)

    def _ray(self, begin: NDArray[np.float64], way: NDArray[np.float64]) -> "_Hit":
        bench, geom = self._bench, np.zeros(1, np.int32)
        found = mujoco.mj_ray(bench.model, bench.data, begin, way, None, 1, -1, geom)
        if found < 0:
            return _Hit(math.inf, robot=False)
        root = bench.model.body_rootid[bench.model.geom_bodyid[geom[0]]]
        return _Hit(found, robot=root == bench.model.body(bench.named(bench.robot.base)).id)

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
