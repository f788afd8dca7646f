"""Turns behind: how far the last metres of the robot's way bent, against those of the way to each place.

A robot that went straight on where its path turned, or that turned back, is not on the path behind that turn, however
alike two corridors look. Views do not tell, the odometer does. Its ratio is never above 1, so that the promise of
evidence (docs/best.md) holds whatever the odometer does: it speaks against places, and for none. A carried robot, whose
way behind is not that to its place, is found all the same, as views say far more (docs/decisions/0044).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.network import Network
from refseq.map.map import Map
from refseq.planar import wrapped

ALIKE, SPREAD = math.radians(30.0), math.radians(15.0)
"""Ways that bend differently by so much are as good as alike; beyond, the ratio falls as a normal density does."""
LEAST = 0.3
"""The least ratio of a view: with it a place is ruled out in three or four views, and a carried robot found in time."""


@dataclass(frozen=True)
class LearntWays:
    """The ways to K positions: ``along`` (K,) [m], rising, and the ``heading`` (K,) there [rad], without jumps.

    So far behind each (``known``, (K,) [m]) its way is the only one that leads there, and is known.
    """

    along: NDArray[np.float64]
    heading: NDArray[np.float64]
    known: NDArray[np.float64]

    @classmethod
    def of(cls, network: Network, tracks: Sequence[NDArray[np.float64]]) -> Self:
        """Those of a network's positions; ``tracks`` are each path's poses by its odometry, (K, 3), or (0, 3).

        Where paths meet, a robot may have come by any of them: no way is known from behind that.
        """
        along, lengths = network.chain.along, [len(path) for path in network.paths]
        headings = [
            np.unwrap(track[:, 2]) if len(track) else np.zeros(length)
            for length, track in zip(lengths, tracks, strict=True)
        ]
        begins = network.linked > 1
        begins[np.cumsum([0, *lengths[:-1]])] = True
        since = np.maximum.accumulate(np.where(begins, np.arange(len(along)), 0))
        told = np.repeat([len(track) > 0 for track in tracks], lengths)
        return cls(along, np.concatenate(headings), np.where(told, along - along[since], 0.0))

    def bends(self, metres: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn of the way over the last ``metres`` (K,) before each position, (K,) [rad]."""
        bends = self.heading - np.interp(self.along - metres, self.along, self.heading)
        return np.where(metres > 0, bends, 0.0)  # where a path turns on its spot it has several headings


class TurnsBehind:
    """Log ratios of positions by the turns of the last ``reach`` [m] of the way, view by view."""

    def __init__(self, ways: LearntWays, reach: float) -> None:
        self._ways = ways
        self._metres = np.minimum(ways.known, reach)
        self._bends = ways.bends(self._metres)
        self.reset()

    def reset(self) -> None:
        """Forget the way behind."""
        self._way, self._heading = [0.0], [0.0]

    def log_ratios(self, distance: float, turn: float, *, again: bool) -> NDArray[np.float64]:
        """Take the motion since the last view [m, rad] and weigh the positions, (K,).

        One that nobody measured (NaN) leaves nothing known of the way behind. With ``again`` the robot has stood.
        """
        if not again:
            self._move(distance, turn)
        behind = self._way[-1] - self._way[0]
        metres, theirs = self._metres, self._bends
        if behind < metres.max():
            metres = np.minimum(metres, behind)
            theirs = self._ways.bends(metres)
        ours = self._heading[-1] - np.interp(self._way[-1] - metres, self._way, self._heading)
        return log_ratio_of(ours - theirs)

    def _move(self, distance: float, turn: float) -> None:
        if not (math.isfinite(distance) and math.isfinite(turn)):
            self.reset()
            return
        way, heading = self._way[-1] + abs(distance), self._heading[-1] + turn
        if way == self._way[-1] and len(self._way) > 1 and way == self._way[-2]:  # it stands, or turns on its spot
            self._heading[-1] = heading
            return
        self._way.append(way)
        self._heading.append(heading)
        # One view is kept from before the farthest that is ever asked.
        while len(self._way) > 2 and self._way[-1] - self._way[1] >= self._metres.max():
            del self._way[0], self._heading[0]


def log_ratio_of(difference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log ratio of places whose ways bent differently by so much [rad], from log ``LEAST`` to 0."""
    apart = np.abs(wrapped(difference))
    ratio: NDArray[np.float64] = np.maximum(-0.5 * (np.maximum(apart - ALIKE, 0.0) / SPREAD) ** 2, math.log(LEAST))
    return ratio


def turns_behind(map_: Map) -> TurnsBehind | None:
    """Evidence of the odometer's turns for the positions of the map's network; None where it is not asked."""
    reach = map_.profile.log_ratio.turns
    return TurnsBehind(LearntWays.of(map_.network, list(map(map_.track, map_.paths))), reach) if reach > 0 else None
