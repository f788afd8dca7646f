"""The Control layer's one interface to those above (card R3): SI units in and out, whatever the robot speaks below."""

from typing import Protocol

from refseq_bench.robots.motion import Twist
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.signals import Actuation, Signals
from refseq_bench.robots.state import RobotState


class ControlLayer(Protocol):
    """The robot's electronics and the program on its computer that speaks with them.

    ``period`` [s] is the time between two ticks of the electronics; ``needs_scan`` tells whether they look at the
    laser. Nothing that comes in with the signals makes it raise: what is wrong is told in the state.
    """

    period: float
    needs_scan: bool

    @property
    def state(self) -> RobotState:
        """The state that was last heard from the robot."""

    @property
    def odometry(self) -> PlanarPose:
        """The odometer at this moment; a state may be a tenth of a second old."""

    def command(self, twist: Twist) -> None:
        """Ask for a motion; it holds until the next command, or until the robot hears none for too long."""

    def emergency_stop(self) -> None:
        """Kill all motion and hold it, until ``release``."""

    def release(self) -> None:
        """Clear all stops whose reason has gone."""

    def rest(self) -> None:
        """Begin anew from rest: somebody has set the robot down. Stops stay, and the odometer."""

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass: hear the sensors, tell the motors."""
