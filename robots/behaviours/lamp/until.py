"""Ends of a motion of LAMP: an angle turned, a length gone, or what one sonar reads.

Each counts from its first look, so that nothing of an earlier motion's odometry is left in it.
"""

import math
from typing import Protocol

from refseq_bench.robots.behaviours.behaviour import RobotDescription, Senses
from refseq_bench.robots.behaviours.phases import TURNED, Settled, Travelled
from refseq_bench.robots.behaviours.sensing.sonar_filter import SonarFilter
from refseq_bench.robots.behaviours.steering import speed_for, turn_speed
from refseq_bench.robots.motion import Limits, Twist

ARRIVED = 0.003
"""A length is gone when no more than this is left of it [m]: a choice, half of what 20 mm/s go between two commands."""


class Until(Protocol):
    """One end of a motion."""

    def reached(self, senses: Senses) -> str:
        """Say in one line what has ended the motion; nothing while it goes on."""

    def eased(self, twist: Twist, limits: Limits) -> Twist:
        """Return how to move now by the last look, where ``twist`` is the motion at its full speed."""


class Turned:
    """The odometer has turned by ``angle`` [rad], to the left where it is positive, and stays there."""

    def __init__(self, angle: float) -> None:
        self._angle, self._left = angle, angle
        self._start: float | None = None
        self._settled = Settled()

    def reached(self, senses: Senses) -> str:
        """Say that it has turned."""
        heading = senses.pose.heading
        if self._start is None:
            self._start = heading
        self._left = self._angle - (heading - self._start)
        if not self._settled.look(self._left, senses.now):
            return ""
        turned, asked = (math.degrees(angle) for angle in (heading - self._start, self._angle))
        return f"turned by {turned:.1f}° of {asked:.0f}° by the odometer"

    def eased(self, twist: Twist, limits: Limits) -> Twist:
        """Turn towards the angle; a motion along an arc keeps its arc."""
        if abs(self._left) < TURNED:
            return Twist()
        rate = min(abs(twist.angular), turn_speed(limits, abs(self._left)))
        return Twist(twist.linear * rate / abs(twist.angular), math.copysign(rate, self._left))


class Gone:
    """The odometer has gone ``length`` [m], forwards or backwards."""

    def __init__(self, length: float) -> None:
        self._length, self._left = length, length
        self._travelled = Travelled()

    def reached(self, senses: Senses) -> str:
        """Say that it has gone so far."""
        gone = abs(self._travelled.so_far(senses))
        self._left = self._length - gone
        return f"gone {gone:.3f} m of {self._length:g} m by the odometer" if self._left < ARRIVED else ""

    def eased(self, twist: Twist, limits: Limits) -> Twist:
        """Slow down at the end, along the same arc."""
        part = min(speed_for(limits, abs(twist.linear), self._left) / abs(twist.linear), 1.0)
        return Twist(twist.linear * part, twist.angular * part)


class Near:
    """The sonar of a number reads less than ``near`` [m], by the middle of its last readings."""

    def __init__(self, robot: RobotDescription, sonar: int, near: float) -> None:
        self._sonar, self._near = sonar, near
        self._filter = SonarFilter(robot.sonars)

    def reached(self, senses: Senses) -> str:
        """Say what it reads."""
        self._filter.look(senses)
        if not self._filter.steady:
            return ""
        reads = float(self._filter.ranges[self._sonar])
        return f"sonar {self._sonar} reads {reads:.2f} m, less than {self._near:g} m" if reads < self._near else ""

    def eased(self, twist: Twist, limits: Limits) -> Twist:
        """Go on as fast as before: what is ahead, the robot's own watch stops it from."""
        return twist
