"""A person who leads the robot along a route with a joystick: sees where it is, and is not perfect.

Steering is pure pursuit (Coulter 1992: curvature = 2 sin α / L towards a point L ahead) of a route that wanders to the
side; wander, heading error and speed are Ornstein–Uhlenbeck processes, the first two over path length, the last over
time.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose, wrap
from refseq_bench.robots import Twist
from refseq_bench.robots.motion import Limits
from refseq_bench.robots.wandering import Wandering
from refseq_bench.sim.bench.polyline import Polyline, polyline
from refseq_bench.sim.errors import SimError

REVERSAL = math.radians(100)
"""A route that bends by more than this is left at a stop, after which the robot turns on the spot."""

WIDEST = 1.0
"""Farthest lane beside a route [m]: a choice, about half a wide corridor."""

UNEVEN = 5.0
"""Greatest strength of a person's imperfections: a choice. From about 8 on speeds spread by their mean, and the robot
stands or turns round more than it drives."""

REACH = 1.0
"""Distance along a leg within which the robot is looked for again [m]: a choice, the same pass of a route that comes by
twice."""

ARRIVED = 0.03
"""Distance from the end of a leg at which it counts as done [m]."""

PATIENCE = 3600.0
"""For how long the operator tries to get to the end, where nothing else is asked for [s of simulated time]."""


@dataclass(frozen=True, slots=True)
class OperatorStyle:
    """Style of somebody who drives; raises ``SimError`` for values that nobody could drive with.

    ``strength`` scales all imperfections: 0 is perfect, 1 a careful person. ``side`` [m] is the lane, to the
    left of the route. ``wander`` [m] to the side is correlated
    over ``wander_length`` [m] and never more than ``wander_limit`` [m]; ``heading_error`` [rad] over ``heading_length``
    [m]; ``speed_error`` [m/s] over ``speed_time`` [s]. ``speed`` [m/s] is the mean; ``lookahead`` [m] is how far ahead
    the person looks. Limits [m/s, rad/s, m/s², rad/s²] are those of the rebuilt robot's teleoperation, accelerations
    are choices.
    """

    strength: float = 1.0
    speed: float = 0.4
    speed_error: float = 0.05
    speed_time: float = 3.0
    wander: float = 0.08
    wander_length: float = 4.0
    wander_limit: float = 0.2
    heading_error: float = math.radians(1.5)
    heading_length: float = 1.5
    side: float = 0.0
    lookahead: float = 0.7
    max_speed: float = 0.5
    max_angular: float = 0.5
    acceleration: float = 0.3
    angular_acceleration: float = 0.8

    def __post_init__(self) -> None:
        for key in ("strength", "speed_error", "wander", "heading_error"):
            if not 0 <= getattr(self, key) < math.inf:
                raise SimError(f"operator: {key} = {getattr(self, key)} must be 0 or more, and finite")
        if not abs(self.side) <= WIDEST:
            raise SimError(f"operator: side = {self.side} m must be within ±{WIDEST:g} m")
        ways = ("wander_length", "wander_limit", "heading_length", "lookahead")
        limits = ("max_speed", "max_angular", "acceleration", "angular_acceleration")
        for key in ("speed", "speed_time", *ways, *limits):
            if not 0 < getattr(self, key) < math.inf:
                raise SimError(f"operator: {key} = {getattr(self, key)} must be positive and finite")

    @property
    def limits(self) -> Limits:
        """The greatest speeds that this person drives at, and changes of them."""
        return Limits(self.max_speed, self.max_angular, self.acceleration, self.angular_acceleration)


STYLES: Mapping[str, OperatorStyle] = {
    "careful": OperatorStyle(),
    "weaving": OperatorStyle(wander=0.3, wander_limit=0.45, heading_error=math.radians(10)),
}
"""People by name: who weaves is 0.3 m beside the lane and looks 10° aside, one standard deviation each."""


def style_named(name: str) -> OperatorStyle:
    """Find a style by its name. Raises ``SimError`` for an unknown one."""
    if name not in STYLES:
        raise SimError(f"unknown operator style {name!r}: valid are {', '.join(STYLES)}")
    return STYLES[name]


class Operator:
    """Leads the robot along ``route`` (n, 2) [m] from its first point to its last; ask for a command at a steady rate.

    Raises ``SimError`` for a route that is no polyline in the plane.
    """

    def __init__(self, route: NDArray[np.float64], style: OperatorStyle, rng: np.random.Generator) -> None:
        self._style = style
        self._legs = [Polyline(part) for part in _split_at_reversals(polyline(route))]
        self._leg = 0
        self._along = 0.0
        self._turning = False
        self._time: float | None = None
        self._last = Twist()
        self._wander = Wandering(style.strength * style.wander, style.wander_length, rng)
        self._heading = Wandering(style.strength * style.heading_error, style.heading_length, rng)
        self._speed = Wandering(style.strength * style.speed_error, style.speed_time, rng)

    @property
    def length(self) -> float:
        """Length of the route [m]."""
        return sum(leg.length for leg in self._legs)

    @property
    def progress(self) -> float:
        """Way along the route that the robot has come [m]."""
        return sum(leg.length for leg in self._legs[: self._leg]) + self._along

    @property
    def finished(self) -> bool:
        """True once the robot has come to the end of the route; commands from then on bring it to a halt."""
        return self._leg == len(self._legs)

    def carried(self, progress: float) -> Pose:
        """Go on from ``progress`` [m along the route], where the robot is set down at rest; returns that pose.

        Raises ``SimError`` for a place that is not on the route.
        """
        if not 0 <= progress <= self.length:
            raise SimError(f"operator: {progress} m is not on the route of {self.length:.1f} m")
        self._leg, self._along = 0, progress
        while self._leg + 1 < len(self._legs) and self._along > self._legs[self._leg].length:
            self._along -= self._legs[self._leg].length
            self._leg += 1
        self._turning, self._last = False, Twist()
        return self._legs[self._leg].pose(self._along)

    def command(self, time: float, pose: Pose) -> Twist:
        """Return the twist to drive with from ``time`` [s] on, seeing the robot at ``pose``."""
        elapsed = self._elapsed(time)
        self._advance(pose, elapsed)
        wanted = Twist() if self.finished else self._steer(pose)
        self._last = self._style.limits.approached(self._last, wanted, elapsed)
        return self._last

    def _elapsed(self, time: float) -> float:
        """Return the time since the last command [s]."""
        if self._time is not None and time < self._time:
            raise SimError(f"operator: time {time} s is before the last command's {self._time} s")
        elapsed = 0.0 if self._time is None else time - self._time
        self._time = time
        return elapsed

    def _advance(self, pose: Pose, elapsed: float) -> None:
        """Follow the robot along the route and let the imperfections run on."""
        self._speed.advance(elapsed)
        if self.finished:
            return
        leg = self._legs[self._leg]
        along = leg.project(pose, self._along, REACH).along
        travelled = max(0.0, along - self._along)
        self._wander.advance(travelled)
        self._heading.advance(travelled)
        self._along = along
        if leg.length - along < ARRIVED:
            self._leg, self._along = self._leg + 1, 0.0

    def _steer(self, pose: Pose) -> Twist:
        """Pursue a point ahead on the wandering route."""
        style, leg = self._style, self._legs[self._leg]
        ahead = self._along + style.lookahead
        side = style.wander_limit * math.tanh(self._wander.value / style.wander_limit)
        aim = leg.pose(ahead, style.side + side)
        distance = math.hypot(aim.x - pose.x, aim.y - pose.y)
        alpha = wrap(math.atan2(aim.y - pose.y, aim.x - pose.x) + self._heading.value - pose.heading)
        self._turning = abs(alpha) > (math.radians(10) if self._turning else math.radians(60))
        if self._turning:
            return Twist(0.0, math.copysign(style.max_angular, alpha))
        curvature = 2 * math.sin(alpha) / max(distance, style.lookahead / 2)
        speed = min(self._wanted_speed(leg.length - self._along), style.max_angular / max(abs(curvature), 1e-9))
        return Twist(speed, curvature * speed)

    def _wanted_speed(self, remaining: float) -> float:
        """Choose an uneven speed, from which the robot can still stop at the end of the leg [m/s]."""
        style = self._style
        uneven = min(max(style.speed + self._speed.value, style.speed / 3), style.max_speed)
        return min(uneven, math.sqrt(2 * style.acceleration * remaining))


def _split_at_reversals(points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the parts of a polyline between bends that are too sharp to be driven through."""
    steps = np.diff(points, axis=0)
    bends = np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))
    cuts = [0, *(np.flatnonzero(np.abs(bends) > REVERSAL) + 1), len(points) - 1]
    return [points[a : b + 1] for a, b in itertools.pairwise(cuts)]
