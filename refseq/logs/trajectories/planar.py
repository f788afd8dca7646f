"""Planar poses of a trajectory in space: which way is up, which way the robot looks."""

import numpy as np
from numpy.typing import NDArray

CAMERA_TO_WORLD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation from a camera's axes (x right, y down, z ahead) to a robot's (x ahead, y left, z up)."""


def rotations_of(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4) in the order x, y, z, w."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def in_plane(positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Planar poses (n, 3) of positions (n, 3) [m] and rotations (n, 3, 3) in a world whose z is up.

    The robot looks along its x axis; where its z axis lies level, as that of a camera or upright sensor, along that.
    """
    upright = np.median(np.abs(rotations[:, 2, 2])) > np.sqrt(0.5)
    ahead = rotations[:, :, 0 if upright else 2]
    return np.column_stack([positions[:, :2], np.arctan2(ahead[:, 1], ahead[:, 0])])


def is_camera_frame(positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> bool:
    """Tell whether the world's axes are a camera's (KITTI: x right, y down, z ahead), or else z is up.

    A robot on a floor turns about the vertical and about nothing else; one that never turns moves across it.
    """
    about_y, about_z = (float(np.median(1 - rotations[:, axis, axis])) for axis in (1, 2))
    if min(about_y, about_z) < 0.5 and abs(about_y - about_z) > 1e-4:
        return about_y < about_z
    spread = np.ptp(positions, axis=0)
    return bool(spread[2] > spread[1])
