"""Speeds and turn rates of a robot, by how far it still has to go."""

import math

from refseq_bench.robots.motion import Limits
from refseq_bench.robots.planar import PlanarPose, wrapped

APPROACH = math.radians(30)
"""The steepest that a robot heads for its line: a choice."""
CONVERGENCE = 1.0
"""Gain of heading for it [rad/m]: with ``TURN_GAIN`` a damping ratio of 1 at 0.5 m/s, 0.7 at 1 m/s; a choice."""
TURN_GAIN = 2.0
"""Turn rate for an error of heading [rad/s per rad]: a choice."""
EASE = 0.5
"""Share of the robot's accelerations that behaviours brake with, so that it can follow: a choice."""
CRAWL = 0.03
"""The slowest that it still turns [rad/s], so that it arrives: a choice."""


def turn_rate_onto(error: PlanarPose, offset: float = 0.0) -> float:
    """Turn rate [rad/s] of a robot that is off its line by ``error`` and wants to be ``offset`` [m] to the left of it.

    It heads for the line at an angle that grows with the distance, up to ``APPROACH``.
    """
    wanted = min(max(CONVERGENCE * (offset - error.y), -APPROACH), APPROACH)
    return TURN_GAIN * wrapped(wanted - error.heading)


def speed_to_stop(distance: float, acceleration: float, reaction: float = 0.0) -> float:
    """The greatest speed [m/s, rad/s] from which the robot stops in ``distance`` [m, rad] at its ease.

    It brakes after a ``reaction`` time [s]: v·t + v²/2a = d.
    """
    way = EASE * acceleration * reaction
    return math.sqrt(way**2 + 2 * EASE * acceleration * max(distance, 0.0)) - way


def speed_for(limits: Limits, cruise: float, distance: float) -> float:
    """Speed [m/s] on a way that ends in ``distance`` [m]; close to its end it falls with the distance."""
    return min(cruise, limits.speed, speed_to_stop(distance, limits.acceleration), TURN_GAIN * max(distance, 0.0))


def turn_speed(limits: Limits, left: float) -> float:
    """Turn rate [rad/s] with ``left`` [rad] to go."""
    return max(min(limits.turn_rate, speed_to_stop(left, limits.angular_acceleration), 2.0 * left), CRAWL)
