"""Robots: one folder each with model, sources and Control layer; behaviours that any of them runs; SI units above."""

from collections.abc import Callable

from robots import robuter, segway_rmp
from robots.control import ControlLayer
from robots.errors import RobotsError
from robots.motion import DifferentialDrive, Limits, Twist, WheelSpeeds
from robots.planar import PlanarPose
from robots.robot import Robot, Shape
from robots.signals import Actuation, Inertial, LaserScan, Signals
from robots.state import Blocked, Cause, Motors, RobotState, Stop

__all__ = [
    "Actuation",
    "Blocked",
    "Cause",
    "ControlLayer",
    "DifferentialDrive",
    "Inertial",
    "LaserScan",
    "Limits",
    "Motors",
    "PlanarPose",
    "Robot",
    "RobotState",
    "RobotsError",
    "Shape",
    "Signals",
    "Stop",
    "Twist",
    "WheelSpeeds",
    "load",
    "names",
]

_LOADERS: dict[str, Callable[[], Robot]] = {
    "robuter": robuter.load,
    "segway_rmp": segway_rmp.load,
    "segway_rmp-tractor": segway_rmp.load_with_tail,
}


def names() -> tuple[str, ...]:
    """Names of all robots, in alphabetical order."""
    return tuple(sorted(_LOADERS))


def load(name: str) -> Robot:
    """Build a fresh robot by its name; raises ``RobotsError`` for an unknown one."""
    if name not in _LOADERS:
        raise RobotsError(f"unknown robot '{name}': valid are {', '.join(names())}")
    return _LOADERS[name]()
