"""Scale of a drive's odometer, estimated on the way: how many metres of the map one of its metres is.

Wheels wear, tyres lose air, a constant is wrong, and the map's own odometer may be off too. One that tells a tenth too
much pushes the belief on by a tenth of every step; views pull it back, and so it settles ahead of the robot. How far it
moves from view to view is right all the same. So where views tell the place, its way along the path is laid over the
odometer's by a straight line, whose slope is the scale.

Views that follow each other err alike, the more the longer: views of less than ``APART`` of way are one, the line is
drawn anew for every ``PIECE`` of it, and all pieces have one slope. A scale that is off by little is left as it is,
since the motion's window holds it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from refseq.belief import LOST_ABOVE, Belief
from refseq.map.map import Map
from refseq.map.matcher import Measurement

APART, PIECE = 0.6, 15.0
"""Way from one point of a line to the next at least, and over which it is drawn [m], however the robot turns on it."""
RESIDUAL = 0.4
"""Standard deviation of the belief's mean from the line [m]: half a gap between places."""
MOST_LOST, NEAR, LEAST_NEAR = 0.1, 1.0, 0.6
"""A view tells the place where P(lost) is no more, and so much of its belief lies within ``NEAR`` [m] of the best:
``sure_place`` asks for more."""
PLAY, CLEAR = 0.05, 3.0
"""A scale is corrected that is off by more than this, and by more than so many of its standard deviations."""
LEAST, MOST = 0.5, 2.0
"""Slopes beyond these are no scales, and the odometer is believed."""
LEAST_SPREAD = 0.001
"""The least standard deviation of a scale before the drive that is reckoned with."""
JUMP, SHARE = 0.75, 0.5
"""A belief that moves so much more or less than the odometer [m], and by this share of its way, has jumped."""


class _At(NamedTuple):
    """One point of a line: how far along sequence ``number`` the belief is, and the way by the odometer so far [m].

    ``driven`` is that way with all backing counted as way.
    """

    number: int
    along: float
    way: float
    driven: float


@dataclass(frozen=True, slots=True)
class _Sums:
    """Sums over points, from which a slope comes: Σ w² and Σ w s, of ways w and places s around their means [m²].

    A belief that goes against the way, as of a robot that drives a path backwards, tells none.
    """

    squares: float = 0.0
    products: float = 0.0

    @classmethod
    def of(cls, points: Sequence[_At]) -> "_Sums":
        way, along = (np.array([getattr(point, name) for point in points]) for name in ("way", "along"))
        way -= way.mean()
        squares, products = float(way @ way), float(way @ along)
        return cls(squares, products) if products > 0 else cls()

    def __add__(self, other: "_Sums") -> "_Sums":
        return _Sums(self.squares + other.squares, self.products + other.products)


def _tells_places(measured: Sequence[Measurement]) -> bool:
    """True for a view that tells one place from another: else the odometer alone has moved the belief."""
    return any(np.ptp(one.likelihood) > 0 for one in measured)


class OdometerScale:
    """Corrects the ways of a drive's views: ask, then let it remember what was believed.

    Before the drive the scale is 1, give or take ``motion.odometer_scale`` of the map's profile.
    """

    def __init__(self, map_: Map) -> None:
        self._map, self._along = map_, np.concatenate([sequence.along for sequence in map_.sequences])
        self._spread = map_.profile.motion.odometer_scale
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._way = self._driven = 0.0
        self._behind = _Sums()
        self._points: list[_At] = []
        self.scale = 1.0

    def corrected(self, measured: Sequence[Measurement]) -> list[Measurement]:
        """A view's measurements in every sequence, with its way in metres of the map."""
        return [replace(one, distance=self.scale * one.distance) for one in measured]

    def remember(self, measured: Sequence[Measurement], belief: Belief) -> None:
        """Take what was believed of a view, ``measured`` before it was corrected."""
        distance = measured[0].distance
        if math.isnan(distance):  # nobody measured it
            self._end()
            return
        if not measured[0].again:  # else its way is that of the view before
            self._way, self._driven = self._way + distance, self._driven + abs(distance)
        if belief.lost > LOST_ABOVE:
            self._end()
        elif self._moved and _tells_places(measured) and (at := self._at(belief)) is not None:
            self._take(at)
        self.scale = self._estimated()

    @property
    def _moved(self) -> bool:
        """True where the robot is far enough from the last point for another one."""
        return not self._points or self._driven - self._points[-1].driven >= APART

    def _at(self, belief: Belief) -> _At | None:
        """Where the belief is; None where it tells no place, or an end of a path, past which the robot may be."""
        number = self._map.sequence_of(belief.best)
        low, high = self._map.first[number : number + 2].tolist()
        if belief.lost > MOST_LOST or belief.best in (low, high - 1):
            return None
        near = low + np.flatnonzero(np.abs(self._along[low:high] - self._along[belief.best]) <= NEAR)
        if belief.places[self._map.with_twins(near)].sum() < LEAST_NEAR:
            return None
        places = belief.places[near]
        return _At(number, float(places @ self._along[near] / places.sum()), self._way, self._driven)

    def _take(self, at: _At) -> None:
        if self._points:
            last = self._points[-1]
            way = at.way - last.way
            if at.number != last.number or abs(at.along - last.along - way) > JUMP + SHARE * abs(way):
                self._end()
        self._points.append(at)
        if at.driven - self._points[0].driven > PIECE:
            self._end()
            self._points.append(at)  # the next line begins where this one ends

    def _end(self) -> None:
        """End the line."""
        if self._points:
            self._behind += _Sums.of(self._points)
            self._points = []

    def _estimated(self) -> float:
        """The slope of all lines under its normal prior, where it is clear that it is not 1."""
        sums = self._behind + _Sums.of(self._points) if self._points else self._behind
        known, told = max(self._spread, LEAST_SPREAD) ** -2, RESIDUAL**-2
        information = known + told * sums.squares
        slope = (known + told * sums.products) / information
        clear = abs(slope - 1) > max(PLAY, CLEAR / math.sqrt(information))
        return slope if clear and LEAST <= slope <= MOST else 1.0
