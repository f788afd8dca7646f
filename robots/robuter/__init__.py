"""Robosoft Robuter: the thesis' indoor robot, with LMS 200 and two cameras. Sources of its numbers: ``README.md``."""

from pathlib import Path

import mujoco

from robots.head import add_camera_mast, add_laser_scanner
from robots.motion import DifferentialDrive

BASE = "base"
WHEEL_JOINTS = ("wheel-left", "wheel-right")
WHEEL_ACTUATORS = ("wheel-left", "wheel-right")
DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
PULSES_PER_TURN = 8024

# Where the sensors stand [m]: on the front module, and at the front of the top plate.
LASER_FOOT = (0.25, 0.0, 0.26)
MAST_FOOT = (0.08, 0.0, 0.748)

_MODEL = Path(__file__).with_name("robuter.xml")


def get_spec() -> mujoco.MjSpec:
    """Build a fresh model of the robot with its sensors mounted; nobody else holds a reference to it."""
    spec = mujoco.MjSpec.from_file(str(_MODEL))
    base = spec.body(BASE)
    add_laser_scanner(spec, base, LASER_FOOT)
    add_camera_mast(spec, base, MAST_FOOT)
    return spec
