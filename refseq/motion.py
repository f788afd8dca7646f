"""Where the odometer says the robot is now: the two-level window of Fig. 3.7, in metres along the path."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """The window around the travelled distance d, and how far it is trusted.

    High, uniform probability reaches ``slack`` [m] + ``drift`` · |d| to both sides of d; low but non-zero probability,
    ``thin`` times the high one, reaches |d| farther (3.2's own limit). ``regularisation`` is α_reg of (2.17).
    """

    slack: float = 0.5
    drift: float = 0.2
    thin: float = 0.1
    regularisation: float = 0.9


class MotionWindow:
    """P(k | j, d): probability of place k after ``distance`` [m] from place j, for all j and k.

    Equation (3.2) as printed weights by the distance itself and is not normalised; this is Fig. 3.7's window instead,
    normalised over k for every j. ``along`` (K,) is each place's distance along the path [m], rising. The thin bars
    reach back to where the robot was, so no row is empty. Negative distances work: the robot reversed.

    The rows are never formed: the places that reach k are neighbours, so sums and maxima over them cost O(K log K).
    """

    def __init__(self, along: NDArray[np.float64], distance: float, settings: MotionSettings) -> None:
        wide = settings.slack + settings.drift * abs(distance)
        self._levels = tuple(
            _Level(along, distance, half_width, share)
            # The thin bars lie under the wide one too, so the wide one adds only what they lack.
            for half_width, share in ((wide, 1 - settings.thin), (wide + abs(distance), settings.thin))
        )
        mass = sum((level.share * level.targets for level in self._levels), np.zeros(len(along)))
        self._norm = 1.0 / mass

    def shift(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""
        outgoing = belief * self._norm
        total: NDArray[np.float64] = np.zeros(len(belief))
        cumulated = np.concatenate([[0.0], np.cumsum(outgoing)])
        for level in self._levels:
            total += level.share * (cumulated[level.stop] - cumulated[level.start])
        return np.maximum(total, 0.0)

    def best(self, score: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """max_j score(j) + log P(k | j, d) and the j that reaches it, (K,) each; −∞ where nothing reaches k."""
        outgoing = score + np.log(self._norm)
        table = _MaximumTable(outgoing)
        wide, thin = self._levels
        # Inside the wide window the two levels add up.
        high, from_high = table.over(wide.start, wide.stop)
        low, from_low = table.over(thin.start, thin.stop)
        high, low = high + np.log(wide.share + thin.share), low + np.log(thin.share)
        return np.maximum(high, low), np.where(high >= low, from_high, from_low)


class _Level:
    """One level of the window: for each target the sources ``start:stop``, for each source its number of targets."""

    def __init__(self, along: NDArray[np.float64], distance: float, half_width: float, share: float) -> None:
        self.share = share
        # Both directions must agree on the edges, so both compare the same rounded sums.
        low, high = along + (distance - half_width), along + (distance + half_width)
        self.targets = np.searchsorted(along, high, side="right") - np.searchsorted(along, low, side="left")
        self.start = np.searchsorted(high, along, side="left")
        self.stop = np.maximum(np.searchsorted(low, along, side="right"), self.start)


class _MaximumTable:
    """Maxima of any stretch of an array, by a table of maxima over powers of two."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        self.values = values
        self.levels = [np.arange(len(values))]
        width = 1
        while 2 * width <= len(values):
            below = self.levels[-1]
            left, right = below[:-width], below[width:]
            self.levels.append(np.where(values[left] >= values[right], left, right))
            width *= 2

    def over(self, start: NDArray[np.intp], stop: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Maximum over ``start:stop`` and where it is, for many stretches; −∞ at 0 for an empty one."""
        length = stop - start
        best = np.full(len(start), -np.inf)
        where = np.zeros(len(start), np.intp)
        for level, maxima in enumerate(self.levels):
            width = 1 << level
            use = (length >= width) & (length < 2 * width)
            left, right = maxima[start[use]], maxima[stop[use] - width]
            where[use] = np.where(self.values[left] >= self.values[right], left, right)
            best[use] = self.values[where[use]]
        return best, where


def motion_prior(
    belief: NDArray[np.float64], along: NDArray[np.float64], distance: float, settings: MotionSettings
) -> NDArray[np.float64]:
    """P(k) = α_reg · P(k | d) + (1 − α_reg) / K, (K,), for the view after ``belief`` (2.17)."""
    moved = MotionWindow(along, distance, settings).shift(belief)
    prior: NDArray[np.float64] = settings.regularisation * moved + (1 - settings.regularisation) / len(belief)
    return prior
