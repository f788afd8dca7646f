"""Motion blur of a picture: the shutter is open while camera or scene move.

Each point's path over the picture follows from its depth and from the velocities of camera and body; a pixel then is
the mean of the picture along the path through it.
"""

import math
from functools import lru_cache
from typing import NamedTuple, Self

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.cameras.lens import Optics, Plane

BLOCK = 16
"""Paths are reckoned for blocks of so many pixels and interpolated in between: rays cost time. Against the mean of
pictures rendered while the shutter is open, blocks of 8 are no better, in a hallway."""
FAR = 1e4
"""Depth of what no ray meets, as the sky [m]: only turning blurs it."""
NEAREST = 0.05
"""No point comes nearer than this to the camera [m]: the renderers' near plane."""
SHORTEST = 0.3
"""Paths shorter than this [pixels] are left alone: the lens blurs more."""
TAP = 1.5
"""Samples along a path are so far apart [pixels]: closer ones come no nearer to the truth, farther ones do worse."""
MOST_TAPS = 64
"""At most so many samples along a path: on longer ones they are sparser."""


class MocapPoses(NamedTuple):
    """Where a model's mocap bodies are: ``pos`` (nmocap, 3) [m] and ``quat`` (nmocap, 4), copies."""

    pos: NDArray[np.float64]
    quat: NDArray[np.float64]

    @classmethod
    def of(cls, data: mujoco.MjData) -> Self:
        """Return those of ``data``."""
        return cls(data.mocap_pos.copy(), data.mocap_quat.copy())


def paths(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, optics: Optics, shutter: float
) -> NDArray[np.float32]:
    """Motion (right, down) of the image of what each block shows in ``shutter`` [s], (rows, columns, 2) [pixels].

    ``data`` is the middle of that time. Bodies move as ``data`` says, and so does what the camera is mounted on.
    """
    u, v = block_centres(optics.size)
    x, y = optics.rays(u, v)
    rays = np.stack([x, -y, -np.ones_like(x)], axis=-1).reshape(-1, 3)  # MuJoCo: y up, looking along −z
    seen, rate = _seen(model, data, camera, rays)
    half = rate * (shutter / 2)
    (u0, v0), (u1, v1) = (_drawn(optics, point) for point in (seen - half, seen + half))
    return np.stack([u1 - u0, v1 - v0], axis=-1).reshape(*u.shape, 2).astype(np.float32)


def block_centres(size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixels (u, v) in the middle of each block of a picture of ``size`` (width, height), (rows, columns) each."""
    columns, rows = (math.ceil(n / BLOCK) for n in size)
    u, v = ((np.arange(n) + 0.5) * whole / n - 0.5 for n, whole in ((columns, size[0]), (rows, size[1])))
    return np.meshgrid(u, v)


def _seen(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, rays: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points that ``rays`` (n, 3) meet and their velocities, (n, 3) [m] and [m/s], all in the camera's own frame."""
    eye = data.camera(camera)
    T_world_camera = eye.xmat.reshape(3, 3)
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ T_world_camera.T
    geoms, distances = np.empty(len(rays), np.int32), np.empty(len(rays))
    drawn, farthest = mujoco.MjvOption().geomgroup, mujoco.mjMAXVAL
    mujoco.mj_multiRay(
        model, data, eye.xpos, rays.ravel(), drawn, True, -1, geoms, distances, None, len(rays), farthest
    )
    points = eye.xpos + rays * np.where(geoms < 0, FAR, distances)[:, None]
    bodies = np.where(geoms < 0, 0, model.geom_bodyid[geoms])
    rates = -_velocities(model, data, model.camera(camera).bodyid[0], points)
    for body in np.unique(bodies):
        on_it = bodies == body
        rates[on_it] += _velocities(model, data, body, points[on_it])
    return (points - eye.xpos) @ T_world_camera, rates @ T_world_camera


def _velocities(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Velocities of points (n, 3) that move with a body, (n, 3) [m/s]; all in the world's frame."""
    turning, linear = np.split(data.cvel[body], 2)  # of the point of the body at its tree's centre of mass
    return linear + np.cross(turning, points - data.subtree_com[model.body_rootid[body]])


def _drawn(optics: Optics, points: NDArray[np.float64]) -> tuple[Plane, Plane]:
    """Pixels (u, v) of points (n, 3) in MuJoCo's frame of the camera."""
    depth = np.maximum(-points[:, 2], NEAREST)
    return optics.pixels(points[:, 0] / depth, -points[:, 1] / depth)


def tell_velocities(model: mujoco.MjModel, data: mujoco.MjData, before: MocapPoses, elapsed: float) -> None:
    """Note in ``data.cvel`` how mocap bodies moved in ``elapsed`` [s], until MuJoCo's next step.

    They are put from place to place, so MuJoCo takes them to stand still.
    """
    bodies = np.flatnonzero(model.body_mocapid >= 0)
    for body, number in zip(bodies, model.body_mocapid[bodies], strict=True):
        turn = np.empty(3)
        mujoco.mju_subQuat(turn, data.mocap_quat[number], before.quat[number])  # in the body's frame
        turning = data.xmat[body].reshape(3, 3) @ turn / elapsed
        linear = (data.mocap_pos[number] - before.pos[number]) / elapsed
        arm = data.subtree_com[model.body_rootid[body]] - data.xpos[body]
        data.cvel[body] = [*turning, *(linear + np.cross(turning, arm))]


def smeared(picture: NDArray[np.float32], paths: NDArray[np.float32]) -> NDArray[np.float32]:
    """``picture`` (height, width) as it gets when all points run along their ``paths`` (rows, columns, 2) [pixels].

    Half of a path is before the picture's instant, half after. Past the picture's edge its last pixels are repeated.
    Where near things hide far ones, a pixel takes the path of what is in its middle: the edge of a near thing stays
    sharper than it should when the far side is still.
    """
    longest = float(np.hypot(paths[..., 0], paths[..., 1]).max())
    if longest < SHORTEST:
        return picture
    height, width = picture.shape
    along = cv2.resize(paths, (width, height), interpolation=cv2.INTER_LINEAR)
    here = _grid(width, height)
    taps = min(math.ceil(longest / TAP) + 2, MOST_TAPS)
    total = np.zeros_like(picture)
    for share in (np.arange(taps) + 0.5) / taps - 0.5:
        there = cv2.scaleAdd(along, float(share), here)
        moved = cv2.remap(picture, there, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)  # type: ignore[call-overload]
        cv2.accumulate(moved, total)
    total /= taps
    return total


@lru_cache(maxsize=4)
def _grid(width: int, height: int) -> NDArray[np.float32]:
    """Each pixel's own place (u, v), (height, width, 2), read-only: making it takes longer than some blurs."""
    grid = np.dstack(np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)))
    grid.setflags(write=False)
    return grid
