"""Robots by name, their Control layers in SI units, and behaviours that any of them runs.

    robot = load("robuter")
    control = robot.control(geometry)
    control.command(Twist(linear=0.3, angular=0.1))

A folder each holds a robot's model, the sources of its numbers and its Control layer; ``behaviours`` holds MA, MT, MO,
MW, MC and MN, which need no more than what any robot senses. The names below are imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq_bench.robots.behaviours.behaviour import (
        Behaviour,
        BehaviourOutcome,
        BehaviourStep,
        RobotDescription,
        Senses,
    )
    from refseq_bench.robots.behaviours.written import make_behaviour, parse_behaviour
    from refseq_bench.robots.catalogue import load, names
    from refseq_bench.robots.control import ControlLayer
    from refseq_bench.robots.errors import RobotsError
    from refseq_bench.robots.motion import DifferentialDrive, Limits, Twist, WheelSpeeds
    from refseq_bench.robots.planar import PlanarPose
    from refseq_bench.robots.robot import Robot, Shape
    from refseq_bench.robots.signals import Actuation, Inertial, LaserScan, Signals
    from refseq_bench.robots.state import Blocked, Cause, Motors, RobotState, Stop

if __name__ != "refseq_bench.robots":
    # In a checkout the path leads here too, under a name by which all classes would be there twice.
    raise ImportError(f"{__name__!r} is imported as 'refseq_bench.robots'")

_HOMES = {
    "behaviours.behaviour": ("Behaviour", "BehaviourOutcome", "BehaviourStep", "RobotDescription", "Senses"),
    "behaviours.written": ("make_behaviour", "parse_behaviour"),
    "catalogue": ("load", "names"),
    "control": ("ControlLayer",),
    "errors": ("RobotsError",),
    "motion": ("DifferentialDrive", "Limits", "Twist", "WheelSpeeds"),
    "planar": ("PlanarPose",),
    "robot": ("Robot", "Shape"),
    "signals": ("Actuation", "Inertial", "LaserScan", "Signals"),
    "state": ("Blocked", "Cause", "Motors", "RobotState", "Stop"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Actuation",
    "Behaviour",
    "BehaviourOutcome",
    "BehaviourStep",
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
    "RobotDescription",
    "RobotState",
    "RobotsError",
    "Senses",
    "Shape",
    "Signals",
    "Stop",
    "Twist",
    "WheelSpeeds",
    "load",
    "make_behaviour",
    "names",
    "parse_behaviour",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, *(name for name in globals() if name.startswith("__"))]
