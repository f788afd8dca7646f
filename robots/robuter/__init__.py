"""Robosoft Robuter: the thesis' indoor robot, with LMS 200 and two cameras. Sources of its numbers: ``README.md``."""

from pathlib import Path

import mujoco

from refseq_bench.robots.motion import DifferentialDrive, Limits
from refseq_bench.robots.robot import Robot, Shape
from refseq_bench.robots.robuter.control import RobuterControl
from refseq_bench.robots.robuter.sonars import FRONT_SONARS, SONARS, add_sonars
from refseq_bench.robots.sensor_mast import (
    CAMERA_FORWARD,
    CAMERA_LATERAL,
    LASER_SITE,
    LATERAL_HEIGHT,
    add_camera_mast,
    add_laser_scanner,
)

BASE = "base"
WHEEL_JOINTS = ("wheel-left", "wheel-right")
WHEEL_ACTUATORS = ("wheel-left", "wheel-right")
BUMPERS = {"front": "bumper-front", "rear": "bumper-rear"}
DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
PULSES_PER_TURN = 8024
# What people drive the rebuilt one with [m/s, rad/s]; accelerations [m/s², rad/s²] are choices.
LIMITS = Limits(speed=0.5, turn_rate=0.5, acceleration=0.5, angular_acceleration=1.0)

# Where the sensors stand [m]: on the front module, and at the front of the top plate.
LASER_FOOT = (0.25, 0.0, 0.26)
MAST_FOOT = (0.08, 0.0, 0.748)
# A rubber rail before the front module: the laser's box stands out 4 cm, and would touch first.
RAIL_REACH = 0.335
RAIL_BACK, RAIL_LOW, RAIL_HIGH, RAIL_HALF_WIDTH = 0.29, 0.11, 0.21, 0.265
SHAPE = Shape(ahead=RAIL_REACH, behind=0.74, half_width=0.355, height=LATERAL_HEIGHT + 0.05)

_MODEL = Path(__file__).with_name("robuter.xml")


def get_spec() -> mujoco.MjSpec:
    """Build a fresh model of the robot with its sensors mounted; nobody else holds a reference to it."""
    spec = mujoco.MjSpec.from_file(str(_MODEL))
    base = spec.body(BASE)
    add_sonars(spec, base)
    _add_bumper_rail(spec, base)
    add_laser_scanner(spec, base, LASER_FOOT)
    add_camera_mast(spec, base, MAST_FOOT)
    return spec


def _add_bumper_rail(spec: mujoco.MjSpec, base: mujoco.MjsBody) -> None:
    """Set the front bumper before the module, below the sonars; its mass is in the module's."""
    pos = ((RAIL_BACK + RAIL_REACH) / 2, 0.0, (RAIL_LOW + RAIL_HIGH) / 2)
    size = ((RAIL_REACH - RAIL_BACK) / 2, RAIL_HALF_WIDTH, (RAIL_HIGH - RAIL_LOW) / 2)
    for part, name in (("robuter-visual", ""), ("robuter-collision", BUMPERS["front"])):
        kind, rubber = mujoco.mjtGeom.mjGEOM_BOX, "robuter-rubber"
        base.add_geom(spec.find_default(part), name=name, type=kind, pos=pos, size=size, material=rubber)


def load() -> Robot:
    """Build a fresh robot."""
    return Robot(
        name="robuter",
        spec=get_spec(),
        base=BASE,
        drive=DRIVE,
        limits=LIMITS,
        shape=SHAPE,
        cameras=(CAMERA_FORWARD, CAMERA_LATERAL),
        laser=LASER_SITE,
        wheel_joints=WHEEL_JOINTS,
        wheel_actuators=WHEEL_ACTUATORS,
        pulses_per_turn=PULSES_PER_TURN,
        bumpers=BUMPERS,
        sonars=SONARS,
        control=lambda believed: RobuterControl(DRIVE, LIMITS, PULSES_PER_TURN, FRONT_SONARS, believed),
    )
