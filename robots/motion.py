"""Motion in SI units, free of any platform, and the kinematics that turn it into wheel speeds (card R3)."""

import math
from dataclasses import dataclass, fields

from refseq_bench.robots.errors import RobotsError

WHEELS = ("left", "right")
"""The drive wheels, in the order of all pairs: of joints, of actuators, of speeds."""


@dataclass(frozen=True, slots=True)
class Twist:
    """Velocity in the plane: ``linear`` [m/s] forward and ``angular`` [rad/s] counter-clockwise.

    Raises ``RobotsError`` when a value is not finite.
    """

    linear: float = 0.0
    angular: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.linear) and math.isfinite(self.angular)):
            raise RobotsError(
                f"twist ({self.linear} m/s, {self.angular} rad/s) cannot be driven: both values must be finite"
            )


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a robot's motion: ``speed`` [m/s], ``turn_rate`` [rad/s], and how fast they change [m/s², rad/s²].

    Raises ``RobotsError`` for values that are not positive.
    """

    speed: float
    turn_rate: float
    acceleration: float
    angular_acceleration: float

    def __post_init__(self) -> None:
        _check_positive(self, "limits")

    def limited(self, twist: Twist) -> Twist:
        """Return ``twist``, or where it is too fast, a slower one along the same arc."""
        scale = max(1.0, abs(twist.linear) / self.speed, abs(twist.angular) / self.turn_rate)
        return Twist(twist.linear / scale, twist.angular / scale)

    def approached(self, now: Twist, wanted: Twist, elapsed: float) -> Twist:
        """Return what ``now`` may have become after ``elapsed`` [s], on its way to ``wanted``."""
        return Twist(
            towards(now.linear, wanted.linear, self.acceleration * elapsed),
            towards(now.angular, wanted.angular, self.angular_acceleration * elapsed),
        )


def within(value: float, most: float) -> float:
    """``value``, or the nearest to it between −``most`` and ``most``."""
    return min(max(value, -most), most)


def towards(value: float, target: float, most: float) -> float:
    """``value``, moved towards ``target`` by at most ``most``."""
    return value + within(target - value, most)


def _check_positive(given: object, what: str) -> None:
    for item in fields(given):  # type: ignore[arg-type]
        value = getattr(given, item.name)
        if not (math.isfinite(value) and value > 0):
            raise RobotsError(f"{what}: {item.name} = {value} must be positive and finite")


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Angular velocity of the drive wheels [rad/s], positive when the wheel rolls forward."""

    left: float
    right: float


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two driven wheels on one axle.

    ``track`` [m] is the distance between the wheels' contact points, ``wheel_radius`` [m] their radius, and
    ``max_wheel_speed`` [rad/s] the fastest that either can turn. Raises ``RobotsError`` for values that are not
    positive.
    """

    track: float
    wheel_radius: float
    max_wheel_speed: float

    def __post_init__(self) -> None:
        _check_positive(self, "differential drive")

    def wheel_speeds(self, twist: Twist) -> WheelSpeeds:
        """Return wheel speeds for ``twist``; one that is too fast is slowed with its curvature kept."""
        half = twist.angular * self.track / 2
        left, right = (twist.linear - half) / self.wheel_radius, (twist.linear + half) / self.wheel_radius
        # Scaling both wheels alike keeps the path's shape; clipping one of them would bend it.
        scale = min(1.0, self.max_wheel_speed / max(abs(left), abs(right), self.max_wheel_speed))
        return WheelSpeeds(left * scale, right * scale)

    def twist(self, speeds: WheelSpeeds) -> Twist:
        """Return the motion of a robot whose wheels roll with ``speeds`` and do not slip."""
        left, right = speeds.left * self.wheel_radius, speeds.right * self.wheel_radius
        return Twist((left + right) / 2, (right - left) / self.track)

    def limited(self, twist: Twist) -> Twist:
        """Return ``twist`` as the wheels can drive it: itself, or slower along the same arc."""
        return self.twist(self.wheel_speeds(twist))
