"""MO: turn until the nearest thing is where it is asked for, as the Robuter's drivers orient it to objects (5.2.1)."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.behaviours.behaviour import (
    BehaviourStep,
    RobotDescription,
    Senses,
    failed,
    finished,
    waiting,
)
from refseq_bench.robots.behaviours.guarded import PATIENCE, Guarded
from refseq_bench.robots.behaviours.phases import Turning
from refseq_bench.robots.behaviours.sensing.sonar_filter import HISTORY
from refseq_bench.robots.behaviours.sensing.sonar_ring import SONAR_REACH, SonarEchoes
from refseq_bench.robots.behaviours.sensing.surroundings import Surroundings
from refseq_bench.robots.planar import wrapped

EXACT = math.radians(1)
"""It is oriented when the thing is no farther off than this [rad]: a choice, two of the laser's beams."""
ROUNDS = 4
"""It looks again so often where a turn has not brought the thing there: a choice; an echo is as wide as its cone."""
SAME = 0.3
"""An echo so near to what the laser sees is the same thing's, of which the laser tells the bearing [m]: a choice."""
SURFACE = 0.03
"""The nearest thing is the middle of all points that are hardly farther away [m]: a choice, of the scan noise."""


class Orient(Guarded):
    """Turn on the spot until the nearest thing within ``SONAR_REACH`` is at ``bearing`` [rad], 0: ahead.

    The laser tells where a thing ahead is, the sonars one behind; of a wall the nearest point counts, so that the robot
    looks at it squarely. It fails where nothing is so near, and where there is no room to turn.
    """

    def __init__(self, robot: RobotDescription, bearing: float = 0.0, *, patience: float = PATIENCE) -> None:
        super().__init__(robot, patience)
        self._bearing, self._rounds = bearing, 0
        self._around, self._echoes = Surroundings(robot), SonarEchoes(robot.sonars)
        self._listens_until: float | None = None
        self._turning: Turning | None = None

    def _move(self, senses: Senses) -> BehaviourStep:
        self._around.look(senses)
        heard = self._echoes.points(senses)
        if self._around.lost:
            return waiting(self._around.lost)
        if self._turning is not None:
            step = self._turning.step(senses, self._around)
            if step is not None:
                return step
            self._turning, self._listens_until = None, None
        if self._listens_until is None:
            self._listens_until = senses.now + (HISTORY if self.robot.sonars else 0.0)
        if senses.now < self._listens_until:
            return BehaviourStep()  # one stray echo is no thing
        return self._turn_to(_nearest(self._around.points(senses.pose), heard), senses)

    def _turn_to(self, thing: NDArray[np.float64] | None, senses: Senses) -> BehaviourStep:
        if thing is None:
            return failed(f"nothing to orient to within {SONAR_REACH:g} m")
        left = wrapped(math.atan2(thing[1], thing[0]) - self._bearing)
        if abs(left) < EXACT or self._rounds == ROUNDS:
            return finished(
                f"{math.hypot(*thing):.2f} m from a thing, {math.degrees(left):.1f}° from where it is to be"
            )
        self._rounds += 1
        self._turning = Turning(self.robot, senses.pose.heading + left)
        return BehaviourStep()


def _nearest(seen: NDArray[np.float64], heard: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The nearest point (2,) [m] of those that the laser saw and the sonars heard; None where none is near."""
    by_laser, by_sonar = _first(seen), _first(heard)
    if by_laser is None or by_sonar is None:
        return by_sonar if by_laser is None else by_laser
    seen_too = np.hypot(*(seen - by_sonar).T).min() < SAME
    return by_laser if seen_too or math.hypot(*by_laser) < math.hypot(*by_sonar) else by_sonar


def _first(points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    away = np.hypot(*points.T)
    if not len(points) or away.min() > SONAR_REACH:
        return None
    near = points[away < away.min() + SURFACE]
    # Of several things that are as near the one of the nearest point.
    beside = np.hypot(*(near - points[away.argmin()]).T) < SAME
    return np.asarray(near[beside].mean(axis=0), np.float64)
