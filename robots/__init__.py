"""Robots: one folder each with model and sources, and the motion interface in SI units."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco

from robots import head, robuter
from robots.errors import RobotsError
from robots.motion import DifferentialDrive, Twist, WheelSpeeds

__all__ = ["DifferentialDrive", "Robot", "RobotsError", "Twist", "WheelSpeeds", "load", "names"]


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot ready to be attached to a world.

    ``spec`` is fresh and belongs to the caller. The other names are those in ``spec``, before any prefix: ``base`` the
    body with the free joint, ``cameras``, the ``laser``'s site, and joints and actuators of the drive wheels as
    (left, right). ``pulses_per_turn`` is what an encoder counts in one turn of a wheel.
    """

    name: str
    spec: mujoco.MjSpec
    base: str
    drive: DifferentialDrive
    cameras: tuple[str, ...]
    laser: str
    wheel_joints: tuple[str, str]
    wheel_actuators: tuple[str, str]
    pulses_per_turn: int


def _robuter() -> Robot:
    return Robot(
        name="robuter",
        spec=robuter.get_spec(),
        base=robuter.BASE,
        drive=robuter.DRIVE,
        cameras=(head.CAMERA_FORWARD, head.CAMERA_LATERAL),
        laser=head.LASER_SITE,
        wheel_joints=robuter.WHEEL_JOINTS,
        wheel_actuators=robuter.WHEEL_ACTUATORS,
        pulses_per_turn=robuter.PULSES_PER_TURN,
    )


_LOADERS: dict[str, Callable[[], Robot]] = {"robuter": _robuter}


def names() -> tuple[str, ...]:
    """Names of all robots, in alphabetical order."""
    return tuple(sorted(_LOADERS))


def load(name: str) -> Robot:
    """Build a fresh robot by its name; raises ``RobotsError`` for an unknown one."""
    if name not in _LOADERS:
        raise RobotsError(f"unknown robot '{name}': valid are {', '.join(names())}")
    return _LOADERS[name]()
