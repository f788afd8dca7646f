"""Sensors of an individual robot: a little higher, turned or longer-sighted than its drawing has them."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from refseq_bench.robots import Robot
from refseq_bench.robots.individual import Individual, MountError
from refseq_bench.sim.bench.assembly import prefix_of
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.camera import CameraModel


def own_cameras(settings: BenchSettings, individual: Individual) -> Mapping[str, CameraModel]:
    """The cameras of ``settings``, resolved, each with the focal length that its own lens has."""
    return {
        name: replace(model, lens=replace(model.lens, focal=model.lens.focal * (1 + individual.cameras[name].focal)))
        for name, model in settings.camera_models.items()
    }


def shift_mounts(model: mujoco.MjModel, robot: Robot, individual: Individual) -> None:
    """Move and turn the cameras and the laser of ``robot`` in ``model`` by the individual's errors."""
    prefix = prefix_of(robot)
    for name, error in individual.cameras.items():
        # MuJoCo's cameras look along −z with y up.
        _shift(model.camera(prefix + name), error.raised, (error.tilt, error.pan, -error.roll))
    error, laser = individual.laser, model.site(prefix + robot.laser)
    if error != MountError():
        # A site that is turned as its body is has its own turn ignored, unless told otherwise.
        model.site_sameframe[laser.id] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        _shift(laser, error.raised, (error.roll, -error.tilt, error.pan))


def _shift(mounted: Any, raised: float, turn: tuple[float, float, float]) -> None:
    """Raise a camera or a site [m] and turn it by a small rotation vector in its own frame [rad]."""
    mounted.pos[2] += raised
    if (angle := math.hypot(*turn)) > 0:
        by = np.zeros(4)
        mujoco.mju_axisAngle2Quat(by, np.array(turn) / angle, angle)
        mujoco.mju_mulQuat(mounted.quat, mounted.quat.copy(), by)
