"""Measures of the real robots, as sources give them, beside those of the models.

S: read in a source; C: computed from such data; the robots' READMEs name the sources. What no source tells is not here:
the heights of mast and cameras are choices.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from refseq_bench.scenarios.robot_checks.body import Body


class RobotMeasure(StrEnum):
    """Measures of a robot [m]; length, width and height are those of the vehicle without mast, cameras and laser."""

    WHEEL = "wheel diameter"
    WHEEL_WIDTH = "wheel width"
    TRACK = "track"
    LENGTH = "length"
    WIDTH = "width"
    HEIGHT = "height"
    BODY_LENGTH = "body length"
    BODY_WIDTH = "body width"
    BODY_HEIGHT = "body height"


VEHICLE = (RobotMeasure.LENGTH, RobotMeasure.WIDTH, RobotMeasure.HEIGHT)
BODY = (RobotMeasure.BODY_LENGTH, RobotMeasure.BODY_WIDTH, RobotMeasure.BODY_HEIGHT)


@dataclass(frozen=True, slots=True)
class Sourced:
    """A measure [m] and how it is known."""

    value: float
    tag: str


SOURCED: Mapping[str, Mapping[RobotMeasure, Sourced]] = {
    "robuter": {
        RobotMeasure.WHEEL: Sourced(0.24, "S"),
        RobotMeasure.WHEEL_WIDTH: Sourced(0.09, "S"),
        RobotMeasure.TRACK: Sourced(0.62, "C"),
        RobotMeasure.LENGTH: Sourced(1.031, "C"),
        RobotMeasure.WIDTH: Sourced(0.710, "C"),
        RobotMeasure.HEIGHT: Sourced(0.748, "C"),
        RobotMeasure.BODY_LENGTH: Sourced(0.79, "C"),
        RobotMeasure.BODY_WIDTH: Sourced(0.53, "C"),
        RobotMeasure.BODY_HEIGHT: Sourced(0.421, "C"),
    },
    "segway_rmp": {
        RobotMeasure.WHEEL: Sourced(0.48, "S"),
        RobotMeasure.TRACK: Sourced(0.54, "S"),
        RobotMeasure.LENGTH: Sourced(0.508, "S"),
        RobotMeasure.WIDTH: Sourced(0.61, "S"),
    },
}


def sourced(body: Body) -> Mapping[RobotMeasure, Sourced]:
    """Sourced measures of a robot; nothing for one of which none was found."""
    return SOURCED.get(body.robot.name, {})


def measures(body: Body) -> Mapping[RobotMeasure, float]:
    """All measures that can be taken of a model [m]."""
    wheel, chassis = body.wheel, body.chassis
    found = {
        RobotMeasure.WHEEL: float(wheel.size[2]),
        RobotMeasure.WHEEL_WIDTH: float(wheel.size[1]),
        RobotMeasure.TRACK: body.track,
        **dict(zip(VEHICLE, map(float, body.vehicle.size), strict=True)),
    }
    if chassis is not None:
        found |= dict(zip(BODY, map(float, chassis.size), strict=True))
    return found
