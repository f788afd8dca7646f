"""Moments at which there is a view, and the sample of each sensor that belongs to it."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

MOST_TOLERANCE = 0.25
"""The largest tolerance that is taken unasked [s]: what a robot at 1 m/s sees a quarter of a metre later."""

NEARLY = 0.8
"""Sensors are of equal rate if one's period is so much of the other's: which of them leads must not hang on jitter."""

NONE = -1
"""No sample of this sensor belongs to the moment."""


@dataclass(frozen=True, slots=True)
class Moments:
    """``times`` (k,) [s]; ``samples``: topic → number of its sample in the order of the log, (k,), or NONE.

    ``numbers`` (k,) are the log's own, and empty where sensors are paired by time.
    """

    times: NDArray[np.float64]
    samples: Mapping[str, NDArray[np.intp]]
    numbers: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def __len__(self) -> int:
        return len(self.times)

    def of(self, topics: Collection[str]) -> "Moments":
        """The same, without samples of other topics."""
        return replace(self, samples={topic: found for topic, found in self.samples.items() if topic in topics})

    def chosen(self, which: NDArray[np.intp] | NDArray[np.bool_]) -> "Moments":
        """Some of them."""
        samples = {topic: found[which] for topic, found in self.samples.items()}
        return Moments(self.times[which], samples, self.numbers[which] if len(self.numbers) else self.numbers)


def numbered(moments: Mapping[str, Sequence[int]], times: Mapping[str, Sequence[float]]) -> Moments:
    """The moments that a log numbers itself, in the order of their numbers.

    ``moments`` and ``times`` are those of each topic's samples. Of several samples of a topic the last counts.
    """
    numbers = np.unique(np.concatenate([np.zeros(0, np.int64), *(np.array(ids, np.int64) for ids in moments.values())]))
    stamps = np.zeros(len(numbers))
    samples = {}
    for topic, ids in moments.items():
        samples[topic] = sample_of(numbers, ids)
        there = samples[topic] != NONE
        stamps[there] = np.array(times[topic])[samples[topic][there]]
    return Moments(stamps, samples, numbers)


def sample_of(numbers: NDArray[np.int64], ids: Sequence[int]) -> NDArray[np.intp]:
    """The last sample of each numbered moment, (k,), or NONE."""
    found = np.full(len(numbers), NONE, np.intp)
    own = np.array(ids, np.int64)
    at = np.searchsorted(numbers, own).clip(0, len(numbers) - 1)
    known = numbers[at] == own
    found[at[known]] = np.flatnonzero(known)
    return found


def slowest(stamps: Mapping[str, NDArray[np.float64]]) -> str:
    """The topic with the lowest rate that lasts for half of the log; of nearly equal ones the first."""
    spans = {topic: float(np.ptp(found)) for topic, found in stamps.items()}
    periods = {topic: period(stamps[topic]) for topic in stamps if spans[topic] >= max(spans.values()) / 2}
    return next(topic for topic in periods if periods[topic] >= NEARLY * max(periods.values()))


def period(stamps: NDArray[np.float64]) -> float:
    """The median step between stamps [s]; 0 for less than two."""
    steps = np.diff(np.unique(stamps))
    return float(np.median(steps)) if len(steps) else 0.0


def default_tolerance(leading: NDArray[np.float64]) -> float:
    """Half of the leading sensor's period [s]."""
    return min(MOST_TOLERANCE, period(leading) / 2)


def paired(
    stamps: Mapping[str, NDArray[np.float64]], leading: str, tolerance: float, apart: float | None = None
) -> Moments:
    """A moment at each stamp of the leading sensor, with the nearest sample of each other within the tolerance.

    Where the leading sensor pauses, the next sensor leads: a sample opens a moment of its own if none is nearer than
    the leading sensor's period, or than ``apart`` [s] where that is given.
    """
    if apart is None:
        apart = max(period(stamps[leading]), 2 * tolerance)
    order = [leading, *sorted((one for one in stamps if one != leading), key=lambda one: (period(stamps[one]), one))]
    times = np.unique(stamps[leading])
    for topic in order[1:]:
        times = _bridged(times, np.unique(stamps[topic]), apart)
    samples = {topic: _nearest(times, found, tolerance) for topic, found in stamps.items()}
    return Moments(times, samples)


def _bridged(times: NDArray[np.float64], other: NDArray[np.float64], apart: float) -> NDArray[np.float64]:
    """Moments and, in their pauses, those of ``other``, at least ``apart`` [s] from all."""
    after = np.searchsorted(times, other)
    padded = np.concatenate([[-np.inf], times, [np.inf]])
    lonely = other[(other - padded[after] > apart) & (padded[after + 1] - other > apart)]
    added, last = [], -np.inf
    for time in lonely.tolist():
        if time - last > apart * (1 - 1e-6):
            added.append(time)
            last = time
    return np.sort(np.concatenate([times, added]))


def _nearest(times: NDArray[np.float64], stamps: NDArray[np.float64], tolerance: float) -> NDArray[np.intp]:
    """The sample nearest to each moment, each at most once; of several with one stamp the last."""
    order = np.argsort(stamps, kind="stable")
    rising = stamps[order]
    last = np.append(rising[1:] != rising[:-1], True)
    order, rising = order[last], rising[last]
    near = np.searchsorted((rising[1:] + rising[:-1]) / 2, times)
    apart = np.abs(rising[near] - times)
    found = np.where(apart <= tolerance, order[near], NONE)
    for sample in np.flatnonzero(np.bincount(near[found != NONE], minlength=len(rising)) > 1):
        takers = np.flatnonzero((near == sample) & (found != NONE))
        found[np.delete(takers, apart[takers].argmin())] = NONE
    return found
