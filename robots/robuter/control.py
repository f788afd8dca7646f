"""The Robuter's Control layer: what its computer does."""

from robots.motion import DifferentialDrive, Limits, Pose, Twist
from robots.odometry import Encoders, Geometry, Odometry
from robots.signals import Actuation, Signals
from robots.state import RobotState


class RobuterControl:
    """Drives by wheel speeds."""

    period = 0.02
    needs_scan = False

    def __init__(self, drive: DifferentialDrive, limits: Limits, pulses_per_turn: int, believed: Geometry) -> None:
        self._drive, self._limits = drive, limits
        self._odometry = Odometry(believed, Encoders(pulses_per_turn))
        self._wanted = Twist()
        self._state = RobotState()

    @property
    def state(self) -> RobotState:
        """What was last heard from the robot."""
        return self._state

    @property
    def odometry(self) -> Pose:
        """The odometer at this moment."""
        return self._odometry.pose

    def command(self, twist: Twist) -> None:
        """Ask for a motion."""
        self._wanted = twist

    def emergency_stop(self) -> None:
        """Kill all motion."""

    def release(self) -> None:
        """Clear all stops."""

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass."""
        self._odometry.update(signals.pulses)
        self._state = RobotState(signals.time, self._odometry.pose, self._odometry.distance)
        speeds = self._drive.wheel_speeds(self._wanted)
        return Actuation(speeds.left, speeds.right)
