"""Pose and frustum of a camera, its far plane just behind what is there."""

import mujoco
import numpy as np

from refseq_bench.sim.errors import SimError

CLIP_NEAR = 0.05
"""Nothing nearer to a camera [m] is drawn; a choice. MuJoCo's own limit grows with the size of the world."""
WIDTH_TO_HEIGHT = 4 / 3
"""Shape of a picture of which nothing else is said."""
RAYS = (33, 25)
"""Rays across and down that look for the farthest thing in a picture: one every 20 pixels."""
NEARBY = 10.0
"""Only a picture in which all rays end nearer than this [m] gets a far plane of its own. In a deep one, as down a
hallway, the farthest things are the smallest, and a grid of rays would miss them."""


def farthest(
    model: mujoco.MjModel, data: mujoco.MjData, seen: mujoco.MjvGLCamera, shape: float = WIDTH_TO_HEIGHT
) -> float:
    """Distance of the farthest thing that a grid of rays through the picture meets [m]; infinite if one meets nothing.

    A shadow map is spread over all that lies before the far plane, so a far plane just behind what is there makes sun
    patches sharp: a camera that faces a wall at 1 m needs none of the 100 m beside it.
    """
    right = np.cross(seen.forward, seen.up)
    half_height = (seen.frustum_top - seen.frustum_bottom) / 2 / seen.frustum_near
    # MuJoCo leaves the width at 0 where the picture's own shape sets it.
    half_width = seen.frustum_width / seen.frustum_near or shape * half_height
    across, down = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, RAYS[0]), np.linspace(-1, 1, RAYS[1])))
    rays = (
        np.asarray(seen.forward)[None, :]
        + half_width * across[:, None] * right[None, :]
        + half_height * down[:, None] * np.asarray(seen.up)[None, :]
    )
    lengths = np.linalg.norm(rays, axis=1)
    distances, geoms = np.empty(len(rays)), np.empty(len(rays), np.int32)
    mujoco.mj_multiRay(
        model,
        data,
        np.asarray(seen.pos, float),
        (rays / lengths[:, None]).ravel(),
        mujoco.MjvOption().geomgroup,  # only what is drawn: what lies behind a window's pane is seen
        1,
        -1,
        geoms,
        distances,
        None,
        len(rays),
        mujoco.mjMAXVAL,
    )
    return float(np.inf if (distances < 0).any() else (distances / lengths).max())


def frustum(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, shape: float = WIDTH_TO_HEIGHT
) -> mujoco.MjvGLCamera:
    """See ``eye_of``; the far plane is just behind what is there. ``shape`` is width to height of the picture."""
    seen = eye_of(model, data, camera)
    reach = farthest(model, data, seen, shape)
    if reach < NEARBY:
        # Twice as far, and a little more: what shows in a gap between two rays must not be cut off.
        seen.frustum_far = min(seen.frustum_far, 2.0 * reach + 2.0)
    return seen


def eye_of(model: mujoco.MjModel, data: mujoco.MjData, camera: str) -> mujoco.MjvGLCamera:
    """Pose and frustum of a named camera, its near plane at ``CLIP_NEAR``. Raises ``SimError`` for an unknown name."""
    names = [model.camera(i).name for i in range(model.ncam)]
    if camera not in names:
        raise SimError(f"unknown camera '{camera}': the model has {', '.join(names) or 'none'}")
    view = mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera(camera).id
    seen = mujoco.mjv_camera2GLCamera(model, data, view)
    scale = CLIP_NEAR / seen.frustum_near
    seen.frustum_near = CLIP_NEAR
    for side in ("frustum_bottom", "frustum_top", "frustum_center", "frustum_width"):
        setattr(seen, side, scale * getattr(seen, side))
    return seen
