"""Fixed offsets between sensors' clocks, from turns: the odometer's against those that scans and pictures show.

The offset is the lag at which both correlate best, as in Kelly and Sukhatme, "A general framework for temporal
calibration of multiple proprioceptive and exteroceptive sensors" (ISER 2010). Its standard error is the jackknife's
over pieces of the drive: Künsch, "The jackknife and the bootstrap for general stationary observations", Annals of
Statistics 17 (1989). Pieces of one turn have what is wrong with it in common, so that the error is at least that of
least squares, by how sharply the turns change and how much of them is not explained: Seber and Wild, "Nonlinear
Regression" (1989), section 2.1.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.logs.pairing.moments import period
from refseq_bench.scenarios.log_tools.clocks.shifts import vertices

STEP = 0.02
"""Step of the offsets that are tried, and of the headings that are compared [s]."""

LAGS = np.arange(-1.0, 1.0 + 1e-9, STEP)
"""Offsets that are tried [s]."""

LEAST_PAIRS = 30
"""Fewer pairs of scans or pictures tell nothing."""

LEAST_TURN = math.radians(60)
"""Sum of the odometer's turns below which no offset can be told [rad]."""

LEAST_CORRELATION = 0.5
"""Correlation below which two sensors are not said to see the same turns."""

SMOOTHED = 1.5
"""Width of the Gaussian by which headings are smoothed, in periods of the slower of the two sensors. With less, noise
that is interpolated, and so weaker between two stamps than at them, is taken for an offset of half a period; with more,
short turns are gone."""

PIECES = 10
"""Pieces of the drive, of as much turning each. More tell the error of an offset better, but if they are short what is
wrong in one is wrong in the next as well."""

SURE = 4.0
"""Standard errors by which an offset has to differ from another to be told. With 3 one in seventy clocks that are on
time is told to be late, as the error is told by few pieces; with 5 more real offsets of 0.1 s are passed over."""

LATE = 0.05
"""Offsets from here on are told [s]: at 1 m/s they move a view by 5 cm."""

LARGEST_ERROR = 0.25
"""Standard error from which on pieces of the drive do not agree on any offset [s]."""


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """A sensor's clock against the odometer's.

    ``lag`` [s]: its stamps are so much later than the odometer's for the same moment. ``correlation`` of the turns, in
    [−1, 1]: negative where one of the two is upside down or mirrored. ``gain``: turns that it shows over those of the
    odometer, NaN of a camera, whose pixels are no angles. ``error`` [s] is the standard error of the lag.
    """

    lag: float
    correlation: float
    gain: float = math.nan
    error: float = 0.0

    def differs(self, seconds: float = 0.0) -> bool:
        """Tell whether the lag is clearly another than ``seconds``: by more than matters, and than chance gives."""
        return abs(self.lag - seconds) > max(LATE, SURE * self.error)


def clock_offset(
    stamps: NDArray[np.float64], turns: NDArray[np.float64], times: NDArray[np.float64], headings: NDArray[np.float64]
) -> ClockOffset | None:
    """The offset of a sensor with ``turns`` (n − 1,) between its ``stamps`` (n,) [s] to the odometer's (m,) poses.

    None where the robot hardly turned, or where both do not see the same turns.
    """
    order = np.argsort(times, kind="stable")
    times, headings = times[order], np.unwrap(headings[order])
    inside = (stamps[:-1] + LAGS[0] >= times[0]) & (stamps[1:] + LAGS[-1] <= times[-1]) if len(times) else None
    if inside is None:
        return None
    used = inside & np.isfinite(turns) & (np.diff(stamps) > 0)
    if used.sum() < LEAST_PAIRS:
        return None
    begin, end = stamps[:-1][used], stamps[1:][used]
    width = SMOOTHED * max(period(times), period(stamps))
    odometer = _SmoothHeading.of(times, headings, begin.min() + LAGS[0], end.max() + LAGS[-1], width)
    told = np.array([odometer.turned(begin - lag, end - lag) for lag in LAGS])
    summed = np.concatenate([[0.0], np.cumsum(np.nan_to_num(turns))])
    seen = _SmoothHeading.of(stamps, summed, begin.min(), end.max(), width).turned(begin, end)
    if np.abs(told[len(LAGS) // 2]).sum() < LEAST_TURN or not seen.std():
        return None
    return _best(told, seen)


@dataclass(frozen=True, slots=True)
class _SmoothHeading:
    """A heading over time, smoothed: ``values`` (n,) at ``grid`` (n,) [s]."""

    grid: NDArray[np.float64]
    values: NDArray[np.float64]

    @classmethod
    def of(
        cls, times: NDArray[np.float64], headings: NDArray[np.float64], first: float, last: float, width: float
    ) -> "_SmoothHeading":
        """The heading from ``first`` to ``last`` [s], smoothed by a Gaussian of ``width`` [s]."""
        half = math.ceil(3 * width / STEP)
        count = math.ceil((last - first) / STEP)
        grid = first + STEP * np.arange(-half, count + half + 1, dtype=np.float64)
        weights = np.exp(-0.5 * (STEP * np.arange(-half, half + 1) / max(width, STEP)) ** 2)
        fine = np.interp(grid, np.maximum.accumulate(times), headings)
        values: NDArray[np.float64] = np.convolve(fine, weights / weights.sum(), mode="valid")
        return cls(grid[half : len(grid) - half], values)

    def turned(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turns between moments, (k,)."""
        turns: NDArray[np.float64] = np.interp(end, self.grid, self.values) - np.interp(begin, self.grid, self.values)
        return turns


def _best(told: NDArray[np.float64], seen: NDArray[np.float64]) -> ClockOffset | None:
    """The lag at which the odometer's turns (lags, n) correlate best with those seen (n,)."""
    moments = _moments(told, seen)
    whole = moments.sum(axis=1, keepdims=True)
    correlations = _correlations(whole)[0]
    top = int(np.abs(correlations).argmax())
    if abs(correlations[top]) < LEAST_CORRELATION or top in (0, len(LAGS) - 1):
        return None
    sign = np.sign(correlations[top])
    lag = _peaks(sign * correlations[np.newaxis])[0]
    without = _peaks(sign * _correlations(whole - moments))  # each piece in turn
    error = math.sqrt((PIECES - 1) * float(without.var()))
    centred = told[top] - told[top].mean()
    slope = (told[top - 1] - told[top + 1]) / (2 * STEP)
    error = max(error, _error_of_fit(centred, slope - slope.mean(), seen - seen.mean()))
    if error > LARGEST_ERROR:
        return None
    return ClockOffset(float(lag), float(correlations[top]), float(centred @ seen / (centred @ centred)), error)


def _error_of_fit(told: NDArray[np.float64], slope: NDArray[np.float64], seen: NDArray[np.float64]) -> float:
    """Standard error of the lag [s] by which turns told, which change by ``slope`` a second of it, fit those seen.

    What is left is alike for some time, as both are smoothed: it counts for as many as its autocorrelation, up to where
    that first falls to nothing, adds up to. All are (n,) about their mean.
    """
    gain = float(told @ seen / (told @ told))
    left, change = seen - gain * told, gain * slope
    alike = np.correlate(left, left, "full")[len(left) - 1 :]
    until = int(np.argmax(alike <= 0)) or len(alike)
    return math.sqrt(float(2 * alike[:until].sum() - alike[0]) / len(left) / float(change @ change))


def _moments(told: NDArray[np.float64], seen: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums over each piece of the drive of 1, s, s², t, t² and s t, by lag: (6, pieces, lags)."""
    turning = np.cumsum(np.abs(seen - seen.mean()))
    piece = (PIECES * turning / turning[-1]).astype(np.intp).clip(0, PIECES - 1)
    member = (piece == np.arange(PIECES)[:, np.newaxis]).astype(np.float64)
    ones = np.ones_like(told)
    return np.stack([member @ one.T for one in (ones, ones * seen, ones * seen**2, told, told**2, told * seen)])


def _correlations(moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """Correlations (k, lags) by the sums over k selections of the pairs, (6, k, lags)."""
    count, s, ss, t, tt, st = moments
    spread = (count * ss - s * s) * (count * tt - t * t)
    turning = spread > 1e-12 * spread.max()  # of what stands still rounding is left
    return np.divide(count * st - s * t, np.sqrt(spread.clip(0)), out=np.zeros_like(spread), where=turning)


def _peaks(strengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lag of the highest value of each row (k, lags), (k,) [s]."""
    found: NDArray[np.float64] = np.interp(vertices(strengths), np.arange(len(LAGS)), LAGS)
    return found
