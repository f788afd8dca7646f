"""Clocks of a topic: its rate and jitter, gaps, and stamps that no clock should give."""

from array import array
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

GAP_PERIODS = 5.0
"""A pause this many times longer than the usual period is a gap; less would call every hiccup of a camera one."""

SHORTEST_GAP = 0.5
"""No pause below this is called a gap [s]: a robot moves less in it than places are apart."""

JITTER_SHARE = 90.0
"""Share of the periods that lie within the jitter told [%]."""


@dataclass(frozen=True, slots=True)
class Gap:
    """A pause of a topic: its beginning and its length [s]."""

    start: float
    length: float


@dataclass(frozen=True, slots=True)
class Timing:
    """Figures of a topic's clock. Times in [s], ``rate`` in [Hz]; NaN where too few messages tell.

    ``rate`` is that of the median period, which pauses do not change. ``jitter`` is half the width of the range that
    holds 90 % of the periods. ``delay`` is the median of the log's time less the sensor's stamp, ``delay_spread`` half
    the range of 90 % of them. ``zeros`` counts stamps of zero, ``duplicates`` messages with the stamp of the one
    before, ``backwards`` those with an earlier one.
    """

    count: int
    first: float = np.nan
    last: float = np.nan
    rate: float = np.nan
    jitter: float = np.nan
    delay: float = np.nan
    delay_spread: float = np.nan
    zeros: int = 0
    duplicates: int = 0
    backwards: int = 0
    gaps: tuple[Gap, ...] = ()

    @property
    def duration(self) -> float:
        """Time from the first message to the last [s]; 0 of one message, NaN of none."""
        return self.last - self.first

    @property
    def longest_gap(self) -> Gap | None:
        """The longest of the pauses."""
        return max(self.gaps, key=lambda gap: gap.length, default=None)


@dataclass(slots=True)
class TopicClock:
    """Collects the times of a topic's messages, sixteen bytes each."""

    stamps: "array[float]" = field(default_factory=lambda: array("d"))
    logged: "array[float]" = field(default_factory=lambda: array("d"))

    def add(self, stamp: float, logged: float) -> None:
        """Take one message's stamp, NaN where it has none, and the time that it was logged at [s]."""
        self.stamps.append(stamp)
        self.logged.append(logged)

    def timing(self) -> Timing:
        """The figures of what was taken so far."""
        stamps, logged = np.array(self.stamps), np.array(self.logged)
        stamped = ~np.isnan(stamps)
        zeros = int((~stamped).sum())
        times = np.where(stamped, stamps, logged)  # where the sensor has no clock, the log's own stands for it
        if len(times) < 2:
            first = float(times[0]) if len(times) else np.nan
            return Timing(len(times), first, first, zeros=zeros)
        steps = np.diff(times)
        onward, late = steps[steps > 0], (logged - stamps)[stamped]
        return Timing(
            len(times),
            float(times.min()),
            float(times.max()),
            rate=1.0 / float(np.median(onward)) if len(onward) else np.nan,
            jitter=_half_range(onward),
            delay=float(np.median(late)) if len(late) else np.nan,
            delay_spread=_half_range(late),
            zeros=zeros,
            duplicates=int((steps == 0).sum()),
            backwards=int((steps < 0).sum()),
            gaps=_gaps(times, steps, onward),
        )


def _half_range(values: NDArray[np.float64]) -> float:
    if not len(values):
        return np.nan
    margin = (100.0 - JITTER_SHARE) / 2
    low, high = np.percentile(values, (margin, 100.0 - margin))
    return float(high - low) / 2


def _gaps(times: NDArray[np.float64], steps: NDArray[np.float64], onward: NDArray[np.float64]) -> tuple[Gap, ...]:
    if not len(onward):
        return ()
    limit = max(GAP_PERIODS * float(np.median(onward)), SHORTEST_GAP)
    return tuple(Gap(float(times[k]), float(steps[k])) for k in np.flatnonzero(steps > limit))
