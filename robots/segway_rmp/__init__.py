"""Segway RMP 200: the thesis' outdoor robot, on two wheels. Sources of its numbers: ``README.md``."""

import math
from functools import cache
from pathlib import Path

import mujoco

from refseq_bench.robots.motion import DifferentialDrive, Limits
from refseq_bench.robots.mounting import Mounting
from refseq_bench.robots.odometry import Geometry
from refseq_bench.robots.robot import Robot, Shape
from refseq_bench.robots.segway_rmp.control import SegwayControl
from refseq_bench.robots.segway_rmp.firmware import Build
from refseq_bench.robots.segway_rmp.plant import plant_of
from refseq_bench.robots.segway_rmp.protocol import COUNTS_PER_METRE, GainSet, Mode
from refseq_bench.robots.sensor_mast import (
    CAMERA_FORWARD,
    CAMERA_LATERAL,
    LASER_SITE,
    LATERAL_HEIGHT,
    SCAN_HEIGHT,
    add_camera_mast,
    add_laser_scanner,
)

BASE = "base"
WHEEL_JOINTS = ("wheel-left", "wheel-right")
WHEEL_ACTUATORS = ("wheel-left", "wheel-right")
DRIVE = DifferentialDrive(track=0.54, wheel_radius=0.24, max_wheel_speed=3.54 / 0.24)
PULSES_PER_TURN = round(2 * math.pi * DRIVE.wheel_radius * COUNTS_PER_METRE)
# Missions [m/s, rad/s, m/s², rad/s²]: choices; 0.5 m/s² leans the machine by 6°.
LIMITS = Limits(speed=1.0, turn_rate=1.0, acceleration=0.5, angular_acceleration=1.5)

# Where the sensors stand [m]: on the front of the deck, and on the rack.
LASER_FOOT = (0.17, 0.0, 0.50)
MAST_FOOT = (0.0, 0.0, 1.008)
SHAPE = Shape(ahead=0.254, behind=0.254, half_width=0.305, height=LATERAL_HEIGHT + 0.05)
SHAPE_WITH_TAIL = Shape(ahead=0.254, behind=0.58, half_width=0.305, height=SHAPE.height)
MOUNTING = Mounting(LASER_FOOT[0], LASER_FOOT[2] + SCAN_HEIGHT, DRIVE.wheel_radius)

_MODEL = Path(__file__).with_name("segway_rmp.xml")
_TAIL = Path(__file__).with_name("tail.xml")


def get_spec(*, tail: bool = False) -> mujoco.MjSpec:
    """Build a fresh model of the robot with its sensors mounted, and its ``tail`` where that is wanted."""
    spec = mujoco.MjSpec.from_file(str(_MODEL))
    base = spec.body(BASE)
    add_laser_scanner(spec, base, LASER_FOOT)
    add_camera_mast(spec, base, MAST_FOOT)
    if tail:
        spec.attach(mujoco.MjSpec.from_file(str(_TAIL)), frame=base.add_frame(), prefix="tail-")
    return spec


@cache
def build(*, tail: bool) -> Build:
    """Read the machine, as its own electronics take it, from its compiled model."""
    plant = plant_of(get_spec(tail=tail).compile(), WHEEL_JOINTS)
    return Build(plant, PULSES_PER_TURN, Mode.TRACTOR if tail else Mode.BALANCE, GainSet.TALL)


def load() -> Robot:
    """Build a fresh robot that balances."""
    return _load("segway_rmp", SHAPE, tail=False)


def load_with_tail() -> Robot:
    """Build a fresh robot that stands on its tail, in tractor mode."""
    return _load("segway_rmp-tractor", SHAPE_WITH_TAIL, tail=True)


def _load(name: str, shape: Shape, *, tail: bool) -> Robot:
    def control(believed: Geometry) -> SegwayControl:
        return SegwayControl(build(tail=tail), LIMITS, shape, MOUNTING, believed)

    return Robot(
        name=name,
        spec=get_spec(tail=tail),
        base=BASE,
        drive=DRIVE,
        limits=LIMITS,
        shape=shape,
        cameras=(CAMERA_FORWARD, CAMERA_LATERAL),
        laser=LASER_SITE,
        wheel_joints=WHEEL_JOINTS,
        wheel_actuators=WHEEL_ACTUATORS,
        pulses_per_turn=PULSES_PER_TURN,
        control=control,
        bumpers={},
    )
