"""Motion in SI units, free of any platform, and the kinematics that turn it into wheel speeds (card R3)."""

import math
from dataclasses import dataclass

from robots.errors import RobotsError


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
        for key in ("track", "wheel_radius", "max_wheel_speed"):
            value = getattr(self, key)
            if not (math.isfinite(value) and value > 0):
                raise RobotsError(f"{key} = {value} is no differential drive: it must be positive and finite")

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
