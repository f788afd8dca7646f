"""One period's move, along an arc or about itself, as far as there is room for it."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import BehaviourStep, RobotDescription, waiting
from refseq_bench.robots.behaviours.sensing.room import LOOK, MARGIN, blocks_turn, free_ahead
from refseq_bench.robots.behaviours.steering import speed_for, speed_to_stop, turn_speed
from refseq_bench.robots.motion import Twist

CREEP = 0.03
"""The slowest that it still goes [m/s], so that it arrives: a choice."""
TIGHT = 3.0
"""Arcs that are tighter are looked at as this one [1/m]: a choice."""
STOP_SHORT = 0.02
"""With no more way free than this a robot does not set out [m]: a choice."""
REACTION = 0.5
"""Time before it brakes in which a robot has to see what stands there [s]: a scan's and a state's age, and the round of
the Robuter's sonars, which else would stop it first."""
EASED = (1.0, 0.5, 0.25, 0.1, 0.0)
"""Parts of the curvature that it tries: a choice."""
ENOUGH = 0.3
"""With so much way free it takes an arc [m]: a choice."""
SIDESTEP = 0.1
"""A robot whose way is blocked turns on the spot if it wants to turn faster than this [rad/s]: a choice."""

Points = NDArray[np.float64]
"""Points (n, 2) [m] in the robot's frame."""


def driven(robot: RobotDescription, points: Points, turn_rate: float, left: float) -> BehaviourStep:
    """Drive on with a turn rate [rad/s], as fast as the way that is ``left`` [m] and the ``points`` ahead let it.

    A robot that cannot turn so fast drives slower.
    """
    limits = robot.limits
    wanted = limits.limited(Twist(max(speed_for(limits, limits.speed, left), CREEP), turn_rate))
    return _clear(robot, points, wanted)


def fits_arc(robot: RobotDescription, points: Points, curvature: float) -> bool:
    """True where an arc of ``curvature`` [1/m] is free for as long as a robot needs to set out on it."""
    return free_ahead(points, robot.shape, curvature, LOOK) > ENOUGH


def turned(robot: RobotDescription, points: Points, left: float) -> BehaviourStep:
    """Turn on the spot with ``left`` [rad] to go, where the ``points`` let it."""
    near = blocks_turn(points, robot.shape, left)
    if len(near):
        return waiting(f"no room to turn by {math.degrees(left):.0f}°: {_place(near[0])}")
    return BehaviourStep(Twist(0.0, math.copysign(turn_speed(robot.limits, abs(left)), left)))


def _clear(robot: RobotDescription, points: Points, wanted: Twist) -> BehaviourStep:
    """The wanted motion, on a wider arc where its tail would swing into something, slower where something is ahead."""
    for part in EASED:
        eased = Twist(wanted.linear, part * wanted.angular)
        free = free_ahead(points, robot.shape, _curvature(eased), LOOK)
        if free > ENOUGH:
            break
    if free > STOP_SHORT:
        speed = min(eased.linear, speed_to_stop(free, robot.limits.acceleration, REACTION))
        return BehaviourStep(Twist(speed, eased.angular * speed / eased.linear))
    if abs(wanted.angular) > SIDESTEP and not len(blocks_turn(points, robot.shape, wanted.angular)):
        return BehaviourStep(Twist(0.0, wanted.angular))
    return waiting(f"way blocked {free + MARGIN:.2f} m ahead")


def _curvature(twist: Twist) -> float:
    """Curvature of an arc [1/m]; what is as good as a turn on the spot counts as a tight arc."""
    return min(max(twist.angular / max(twist.linear, CREEP), -TIGHT), TIGHT)


def _place(point: Points) -> str:
    x, y = point
    return f"something {math.hypot(x, y):.2f} m away at {math.degrees(math.atan2(y, x)):.0f}°"
