"""Observations of what a robot senses: arrays of fixed shape in which every number is finite.

``Senses`` of a robot go in, arrays come out, fresh ones each time. No bench and no truth is needed for them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.view import Scan
from refseq_bench.robots import Blocked, Cause, RobotState
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.beams import BEAMS
from refseq_bench.sim.sensors.sonar import SonarModel

SUMMARY = "summary"
"""The form of belief that is told unless another is asked for."""
BELIEFS = (SUMMARY, "places")
"""Forms that a belief is given in."""
FASTEST = np.array([3.0, 6.0, 3.0, 3.0, math.pi], np.float32)
"""Odometry is cut off at these [m/s, rad/s, m, m, rad]: three times what any robot is let, by choice."""
IMAGE = (480, 640)
"""Rows and columns of a camera's image, unless others are asked for."""
SHOWN = 3
"""Of what a mission asks for, so much is seen: what is due, and what comes next; a choice."""
FARTHEST = 100.0
"""Ways to what comes next are cut off at this [m]; a choice, longer than most paths."""
Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Known:
    """The map that a belief is about: ``along`` (K,) [m] of its places, and the ``goal`` among them, if any.

    ``asked`` is what is to be done along it, each from so many metres on, by the behaviour's number; ``gone`` [m] is
    the odometer's way since the view that was believed.
    """

    along: NDArray[np.float64]
    goal: int | None = None
    asked: Sequence[tuple[float, int]] = ()
    gone: float = 0.0


class Sensing:
    """The observation space of a robot, and observations in it.

    ``sonars`` is how many the robot has, ``max_range`` [m] that of its laser, ``cameras`` the names of those that give
    images, of so many rows and columns. ``places`` is how many the map has, None without one; ``belief`` one of
    ``BELIEFS``; ``goal`` says whether the task has one. A task that asks for ``behaviours``, so many, tells which are
    due, and which one goes on. Raises ``SimError`` for an unknown form of belief.
    """

    def __init__(
        self,
        *,
        sonars: int,
        max_range: float,
        cameras: Sequence[str] = (),
        image: tuple[int, int] = IMAGE,
        places: int | None = None,
        belief: str = SUMMARY,
        goal: bool = False,
        behaviours: int = 0,
    ) -> None:
        if belief not in BELIEFS:
            raise SimError(f"belief {belief!r} is unknown: valid are {', '.join(BELIEFS)}")
        self._max_range, self._farthest = np.float32(max_range), np.float32(SonarModel().max_range)
        self._belief, self._sonars, self._behaviours = belief, sonars, behaviours
        parts: dict[str, spaces.Space[Any]] = {
            "scan": spaces.Box(0.0, self._max_range, (BEAMS,), np.float32),
            "odometry": spaces.Box(-FASTEST, FASTEST, dtype=np.float32),
            "stops": spaces.Box(0.0, 1.0, (3,), np.float32),
        }
        if sonars:
            parts["sonar"] = spaces.Box(0.0, self._farthest, (sonars,), np.float32)
        if places is not None:
            parts["belief"] = spaces.Box(0.0, 1.0, (5 if belief == SUMMARY else places + 1,), np.float32)
        if goal:
            parts["goal"] = spaces.Box(-1.0, 1.0, (2,), np.float32)
        if behaviours:
            parts["asked"] = spaces.Box(-FARTHEST, FARTHEST, (SHOWN, 1 + behaviours), np.float32)
            parts["doing"] = spaces.Box(0.0, 1.0, (behaviours,), np.float32)
        for name in cameras:
            parts[name] = spaces.Box(0, 255, image, np.uint8)
        self.space: spaces.Space[Any] = spaces.Dict(parts)

    def observed(
        self,
        scan: Scan,
        state: RobotState,
        motion: tuple[float, float, float],
        *,
        belief: tuple[Belief, Known] | None = None,
        images: Mapping[str, NDArray[np.uint8]] | None = None,
        going: int | None = None,
    ) -> Arrays:
        """An observation; ``motion`` is the odometer's since the last one, in the robot's frame then [m, m, rad].

        ``going`` is the number of the behaviour that goes on, if any.
        """
        ahead, left, turn = motion
        seen: Arrays = {
            "scan": ranges(scan.ranges, self._max_range),
            "odometry": odometry([state.twist.linear, state.twist.angular, ahead, left, turn]),
            "stops": stops(state),
        }
        if self._sonars:
            heard = np.full(self._sonars, np.inf) if state.sonar is None else state.sonar
            seen["sonar"] = ranges(heard, self._farthest)
        if belief is not None:
            held, known = belief
            seen["belief"] = summary(held) if self._belief == SUMMARY else by_place(held)
            if known.goal is not None:
                seen["goal"] = goal(held, known)
            if self._behaviours:
                seen["asked"] = asked(held, known, self._behaviours)
                seen["doing"] = one_hot(going, self._behaviours)
        return seen | {name: np.array(image) for name, image in (images or {}).items()}


def ranges(measured: NDArray[np.floating[Any]], farthest: np.float32) -> NDArray[np.float32]:
    """Ranges [m], float32: one that is missing, no number or too far is ``farthest``."""
    # A number that is none compares false with all others.
    return np.where(measured < farthest, np.maximum(measured, 0.0), farthest).astype(np.float32)


def odometry(values: Sequence[float]) -> NDArray[np.float32]:
    """Speed, turn rate, and the motion ahead, to the left and about itself; what is no number is 0."""
    return np.clip(np.nan_to_num(np.array(values, np.float32)), -FASTEST, FASTEST)


def stops(state: RobotState) -> NDArray[np.float32]:
    """Flags (3,) of 0 or 1: it may not go ahead, may not go back, touches something with a bumper."""
    blocked = {stop.blocks for stop in state.stops}
    bumped = any(stop.cause is Cause.BUMPER for stop in state.stops)
    ahead, back = ({Blocked.ALL, way} & blocked for way in (Blocked.FORWARD, Blocked.BACKWARD))
    return np.array([bool(ahead), bool(back), bumped], np.float32)


def summary(belief: Belief) -> NDArray[np.float32]:
    """A belief in 5 numbers from 0 to 1.

    The probability of being lost; the entropy over places, as a share of the greatest there is; the best place and the
    expected one as shares of the path, counted in places, with the best one's probability between the two.
    """
    K = len(belief.places)
    last = max(K - 1, 1)
    vague = belief.entropy / math.log(K) if K > 1 else 0.0
    expected = float(belief.places @ np.arange(K)) / last
    numbers = [belief.lost, vague, belief.best / last, belief.places[belief.best], expected]
    return np.clip(np.array(numbers, np.float32), 0.0, 1.0)


def by_place(belief: Belief) -> NDArray[np.float32]:
    """The probability of each place, and last that of being lost, (K + 1,): together 1."""
    return np.clip(np.append((1.0 - belief.lost) * belief.places, belief.lost), 0.0, 1.0).astype(np.float32)


def goal(belief: Belief, known: Known) -> NDArray[np.float32]:
    """The goal's share of the path, counted in places, and the expected way to it as a share of the path's length."""
    assert known.goal is not None, "the task has a goal"
    to_go = float(belief.places @ (known.along[known.goal] - known.along))
    shares = [known.goal / max(len(known.along) - 1, 1), to_go / max(float(known.along[-1]), 1e-9)]
    return np.clip(np.array(shares, np.float32), -1.0, 1.0)


def asked(belief: Belief, known: Known, behaviours: int) -> NDArray[np.float32]:
    """The order due where the robot expects to be and those next, (SHOWN, 1 + behaviours); 0 where there is none.

    A row has the way to where it begins [m], negative behind the robot, and a 1 at the number of the behaviour.
    """
    here = float(belief.places @ known.along) + known.gone
    due = max((number for number, (at, _) in enumerate(known.asked) if at <= here), default=0)
    rows = np.zeros((SHOWN, 1 + behaviours), np.float32)
    for row, (at, behaviour) in zip(rows, known.asked[due : due + SHOWN], strict=False):
        row[0] = np.clip(at - here, -FARTHEST, FARTHEST)
        row[1 + behaviour] = 1.0
    return rows


def one_hot(number: int | None, count: int) -> NDArray[np.float32]:
    """A 1 at a number, (count,); all 0 where there is none."""
    return (np.arange(count) == (-1 if number is None else number)).astype(np.float32)
