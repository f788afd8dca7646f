"""Walk of a person to and fro as a function of time."""

import bisect
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from refseq_bench.worlds.parts.figure import HEIGHT
from refseq_bench.worlds.plans.schema import Person, Point

HALF_TURN = 1.2
"""Time that somebody takes to turn round on the spot [s] (choice)."""
STEP = 0.65
"""Length of a step of somebody of ``HEIGHT`` [m] (choice); it is stretched so that whole steps fill a way."""


class Stance(NamedTuple):
    """Where somebody is (x, y) [m] and looks to [rad]; ``steps`` counts the steps made, with their fractions."""

    x: float
    y: float
    heading: float
    steps: float


@dataclass(frozen=True, slots=True)
class Walk:
    """A round trip of ``period`` [s] that begins again and again.

    Between the ``times`` of its ``stances`` everything changes evenly: straight ahead at one speed, or turning on the
    spot. Headings are not wrapped; the last stance is the first one, some whole turns on.
    """

    times: tuple[float, ...]
    stances: tuple[Stance, ...]

    @classmethod
    def of(cls, person: Person) -> "Walk":
        """Return the walk of somebody who has a way to walk."""
        times, stances = zip(*_knots(person), strict=True)
        return cls(times, stances)

    @property
    def period(self) -> float:
        """Time of the way there and back [s]."""
        return self.times[-1]

    def pose(self, time: float) -> Stance:
        """Return the stance at a ``time`` [s]."""
        time %= self.period
        k = min(bisect.bisect_right(self.times, time), len(self.times) - 1)
        share = (time - self.times[k - 1]) / (self.times[k] - self.times[k - 1])
        a, b = self.stances[k - 1], self.stances[k]
        return Stance(
            a[0] + share * (b[0] - a[0]),
            a[1] + share * (b[1] - a[1]),
            a[2] + share * (b[2] - a[2]),
            a[3] + share * (b[3] - a[3]),
        )


def _knots(person: Person) -> Iterator[tuple[float, Stance]]:
    """Yield times and stances: at the start, after each straight line and after each turn."""
    lines = list(pairwise((*person.path, *person.path[-2::-1])))
    headings = [_heading(*line) for line in lines]
    time, heading, steps = 0.0, headings[0], 0
    yield time, Stance(*person.at, heading, steps)
    for k, (start, end) in enumerate(lines):
        length = math.dist(start, end)
        time += length / person.speed
        steps += max(1, round(length / (STEP * person.height / HEIGHT)))
        yield time, Stance(*end, heading, steps)
        turn = _wrapped(headings[(k + 1) % len(lines)] - headings[k])
        if turn != 0.0:
            time, heading = time + abs(turn) / math.pi * HALF_TURN, heading + turn
            yield time, Stance(*end, heading, steps)


def _heading(start: Point, end: Point) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _wrapped(angle: float) -> float:
    """Bring an angle [rad] to -π..π."""
    return math.remainder(angle, 2 * math.pi)
