"""UMBmark: squares in both directions, driven by the odometer, that tell an odometer's two systematic errors apart.

J. Borenstein and L. Feng, 'Measurement and correction of systematic odometry errors in mobile robots', IEEE
Transactions on Robotics and Automation 12 (1996). A wrong track makes every turn too short or too long, whichever way
round (type A, angle α); unequal wheels bend every side the same way (type B, angle β). Returning from a square of side
L is off by −2L(α + β) along both axes where it went clockwise, by −2L(α − β) and 2L(α − β) where it did not. So each
direction alone may look well calibrated when the errors cancel, and both together tell them apart.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from refseq.planar import Pose, relative_pose, wrap
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.behaviours.steering import speed_to_stop
from refseq_bench.robots.motion import within
from refseq_bench.robots.odometry import Geometry
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import RendererKind

SIDE, RUNS = 4.0, 5
"""Side of the square [m] and runs in each direction: the paper's."""
MOST_SIDE = 15.0
"""A larger square would leave the floor [m]."""
SHARE = 0.6
"""Share of the robot's limits that is used: a choice; slow, so that the wheels slip little."""
CREEP = 0.1
"""Share of that at which a side or a turn ends: a choice."""
STANDING = 2.0
"""Time to come to rest at each corner [s]: a choice."""
HEADING_GAIN, ASIDE_GAIN = 1.0, 1.5
"""Turn rate by heading error [1/s] and by distance from the side [rad/s/m]: choices; damped well at 0.3 m/s."""
PATIENCE = 4.0
"""A side or a turn that takes so many times as long as it should has failed: a choice."""


class Direction(Enum):
    """Sense in which a square is driven; the value is the sign of its turns."""

    CLOCKWISE = -1
    COUNTER_CLOCKWISE = 1


class Point(NamedTuple):
    """A place or an error in the plane [m]."""

    x: float
    y: float

    @property
    def size(self) -> float:
        """Distance from the origin [m]."""
        return math.hypot(*self)


@dataclass(frozen=True, slots=True)
class Return:
    """One square: the true pose at its end less the odometer's, seen from where it began: x, y [m], heading [rad]."""

    direction: Direction
    x: float
    y: float
    heading: float


@dataclass(frozen=True, slots=True)
class Umbmark:
    """Result of squares of ``side`` [m], driven by a robot that ``believed`` in a geometry of its wheels."""

    robot: str
    side: float
    believed: Geometry
    returns: tuple[Return, ...]

    def centre(self, direction: Direction) -> Point:
        """Centre of gravity of the errors of all runs in a direction [m]."""
        mine = [run for run in self.returns if run.direction is direction]
        return Point(sum(run.x for run in mine) / len(mine), sum(run.y for run in mine) / len(mine))

    def spread(self, direction: Direction) -> float:
        """Distance of the runs in a direction from their centre, root mean square [m]."""
        centre = self.centre(direction)
        mine = [run for run in self.returns if run.direction is direction]
        return math.sqrt(sum((run.x - centre.x) ** 2 + (run.y - centre.y) ** 2 for run in mine) / len(mine))

    @property
    def worst(self) -> float:
        """The systematic error E_max,syst: how far the farther centre is off [m]."""
        return max(self.centre(direction).size for direction in Direction)

    @property
    def alpha(self) -> float:
        """By how much each turn is too short, whichever way round [rad]: a type A error."""
        cw, ccw = self.centre(Direction.CLOCKWISE), self.centre(Direction.COUNTER_CLOCKWISE)
        return (cw.x + ccw.x + cw.y - ccw.y) / (-8 * self.side)

    @property
    def beta(self) -> float:
        """By how much each side bends to the left [rad]: a type B error."""
        cw, ccw = self.centre(Direction.CLOCKWISE), self.centre(Direction.COUNTER_CLOCKWISE)
        return (cw.x - ccw.x + cw.y + ccw.y) / (-8 * self.side)

    @property
    def track_ratio(self) -> float:
        """E_b: the true track over the believed one."""
        return math.pi / 2 / (math.pi / 2 - self.alpha)

    @property
    def wheel_ratio(self) -> float:
        """E_d: the right wheel's diameter over the left one's, in units of what is believed of each."""
        bend = math.sin(self.beta / 2) * self.believed.track / self.side  # track / 2R on a side of radius R
        return (1 + bend) / (1 - bend)

    @property
    def corrected(self) -> Geometry:
        """The geometry to believe in: the same mean size of its wheels, their ratio and the track put right."""
        left, right = self.believed.left_radius, self.believed.right_radius * self.wheel_ratio
        size = (self.believed.left_radius + self.believed.right_radius) / (left + right)
        return Geometry(left * size, right * size, self.believed.track * self.track_ratio)


def umbmark(
    robot: str, believed: Geometry | None = None, *, side: float = SIDE, runs: int = RUNS, seed: int = 0
) -> Umbmark:
    """Drive ``runs`` squares of ``side`` [m] in each direction on an empty floor.

    The robot believes in the geometry ``believed``, by default that of the bench's unit 1. Raises ``SimError`` for a
    square that does not fit or is not finished, ``RobotsError`` for an unknown robot.
    """
    if not 0 < side <= MOST_SIDE:
        raise SimError(f"umbmark: side = {side} m must be above 0 and at most {MOST_SIDE:g} m")
    if runs < 1:
        raise SimError(f"umbmark: runs = {runs} must be 1 or more")
    settings, machine = BenchSettings(renderer=RendererKind.NONE), robots.load(robot)
    with Bench(empty_floor(), machine, seed=seed, settings=settings) as bench:
        if believed is None:
            believed = bench.believed
        else:
            bench.control = bench.robot.control(believed)
        returns = [_square(bench, direction, side) for direction in Direction for _ in range(runs)]
    return Umbmark(robot, side, believed, tuple(returns))


def _square(bench: Bench, direction: Direction, side: float) -> Return:
    """Drive one square from rest to rest."""
    bench.place(Pose(0.0, 0.0, 0.0))
    _stand(bench)
    truth, square = bench.pose, _Square(bench, direction, side)
    for number in range(4):
        square.follow_side(number)
        square.turn(number)
    end, believed = relative_pose(bench.pose, truth), square.seen
    heading = wrap(end.heading - believed.heading)
    return Return(direction, end.x - believed.x, end.y - believed.y, heading)


class _Square:
    """A square that begins where the robot stands, and the robot that drives it by its odometer alone."""

    def __init__(self, bench: Bench, direction: Direction, side: float) -> None:
        self._bench, self._way, self._side = bench, direction.value, side
        self._origin = bench.odometry
        limits = bench.robot.limits
        self._speed, self._acceleration = SHARE * limits.speed, SHARE * limits.acceleration
        self._turn_rate, self._angular_acceleration = SHARE * limits.turn_rate, SHARE * limits.angular_acceleration

    @property
    def seen(self) -> Pose:
        """The odometer's pose since the start."""
        return relative_pose(self._bench.odometry, self._origin)

    def follow_side(self, number: int) -> None:
        """Follow a side to its end, and stand."""
        x, y = ((0.0, 0.0), (self._side, 0.0), (self._side, self._side), (0.0, self._side))[number]
        start = Pose(x, self._way * y, self._way * number * math.pi / 2)
        patience = self._patience(self._side / self._speed)
        while (left := self._side - (here := relative_pose(self.seen, start)).x) > 0:
            steer = -HEADING_GAIN * here.heading - ASIDE_GAIN * here.y
            pace = _eased(self._speed, self._acceleration, left)
            self._bench.drive(Twist(pace, within(steer, self._turn_rate)))
            patience.check()
        _stand(self._bench)

    def turn(self, number: int) -> None:
        """Turn on the spot towards the next side, and stand."""
        heading = (number + 1) * math.pi / 2
        patience = self._patience(math.pi / 2 / self._turn_rate)
        while (left := heading - self._way * self.seen.heading) > 0:
            rate = _eased(self._turn_rate, self._angular_acceleration, left)
            self._bench.drive(Twist(0.0, self._way * rate))
            patience.check()
        _stand(self._bench)

    def _patience(self, seconds: float) -> "_Patience":
        return _Patience(self._bench, self._bench.time + PATIENCE * (seconds + STANDING))


@dataclass(frozen=True, slots=True)
class _Patience:
    """Ends a part that is not done ``until`` [s]."""

    bench: Bench
    until: float

    def check(self) -> None:
        """Raise ``SimError`` when the time is up."""
        if self.bench.time > self.until:
            why = "; ".join(map(str, self.bench.state.stops))
            raise SimError(
                f"umbmark: {self.bench.robot.name} did not finish a side or a turn by {self.until:.1f} s "
                f"({why or 'it moves too slowly'})"
            )


def _eased(speed: float, braking: float, left: float) -> float:
    """The speed at which the robot still stops at its ease within what is ``left``, and goes on at the end."""
    return max(CREEP * speed, min(speed, speed_to_stop(left, braking)))


def _stand(bench: Bench) -> None:
    until = bench.time + STANDING
    while bench.time < until - 1e-9:
        bench.drive(Twist())
