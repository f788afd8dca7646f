"""Mounts of a robot's sensors and its cameras' calibrations, as other software wants them beside a drive."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.logs.rig import SensorRig
from refseq.logs.source import CameraCalibration
from refseq.logs.transforms import Transform
from refseq.view import LASER
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.cameras.lens import Optics

_OPTICAL = np.diag([1.0, -1.0, -1.0])
"""MuJoCo's cameras look along −z with y up, ROS' along z with y down."""


def sensor_rig(bench: Bench) -> SensorRig:
    """Where a bench's sensors are on its robot as it stands now, and how its cameras see."""
    data = bench.data
    site = data.site(bench.named(bench.robot.laser))
    mounts = {LASER: _mount(bench, site.xpos, site.xmat.reshape(3, 3))}
    calibrations = {}
    for name in bench.cameras:
        camera = data.camera(bench.named(name))
        mounts[name] = _mount(bench, camera.xpos, camera.xmat.reshape(3, 3) @ _OPTICAL)
        calibrations[name] = _calibration(bench.camera_models[name].optics())
    return SensorRig(mounts, calibrations)


def _mount(bench: Bench, place: NDArray[np.float64], axes: NDArray[np.float64]) -> Transform:
    """The transform from the robot's frame, on the floor below the middle of its axle, to a sensor's."""
    pose = bench.pose
    cos, sin = np.cos(pose.heading), np.sin(pose.heading)
    to_robot = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    x, y, z = to_robot @ (place - (pose.x, pose.y, 0.0))
    w, qx, qy, qz = _quaternion(to_robot @ axes)
    return Transform("", "", (float(x), float(y), float(z)), (qx, qy, qz, w), static=True)


def _quaternion(axes: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """MuJoCo's quaternion, w first."""
    found = np.zeros(4)
    mujoco.mju_mat2Quat(found, axes.ravel())
    w, x, y, z = found.tolist()
    return w, x, y, z


def _calibration(optics: Optics) -> CameraCalibration:
    """The lens as OpenCV has it: radial distortion k1, k2, no other."""
    width, height = optics.size
    matrix = (optics.focal, 0.0, (width - 1) / 2, 0.0, optics.focal, (height - 1) / 2, 0.0, 0.0, 1.0)
    return CameraCalibration(width, height, "plumb_bob", (optics.lens.k1, optics.lens.k2, 0.0, 0.0, 0.0), matrix)
