"""Figures in words, as they stand on a page."""

import math
from collections.abc import Sequence

from refseq.belief import Belief
from refseq_bench.scenarios.scoring.recovery import DistanceOrNever, median_way
from refseq_bench.scenarios.tables import NONE

DAY = 86_400.0
"""Length of a day [s]."""
IN_DAYS = 2 * DAY
"""A time is told in days from so long on [s]."""


def metres(value: float) -> str:
    """A length [m]."""
    return NONE if math.isnan(value) else f"{value:.2f} m"


def size_text(count: float) -> str:
    """A number of bytes in the unit that leaves one to three digits before the point."""
    for unit in ("B", "kB", "MB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" else f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def duration_text(seconds: float) -> str:
    """A time on the wall clock, in days where it is long."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds >= IN_DAYS:
        return f"{seconds / DAY:.1f} days"
    minutes, left = divmod(round(seconds), 60)
    return f"{minutes} min {left:02d} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02d} min"


def distances(found: Sequence[DistanceOrNever]) -> str:
    """Median of some distances, and how many were never reached; never where at least half were not."""
    never, median = found.count(None), median_way(found)
    if math.isinf(median):
        return f"never ({never} of {len(found)})"
    return metres(median) + (f" ({never} never)" if never else "")


def span_words(ordered: Sequence[object]) -> str:
    """The only one of some things in order, or the first and the last."""
    return str(ordered[0]) if len(ordered) == 1 else f"{ordered[0]} to {ordered[-1]}"


def scale_words(beliefs: Sequence[Belief]) -> str:
    """Sentence on the metres of the map that a metre of the odometer was taken for in the end; empty for one."""
    if not beliefs or beliefs[-1].odometer_scale == 1:
        return ""
    return (
        f"one metre of the drive's odometer is taken for {beliefs[-1].odometer_scale:.2f} m of the map: "
        "one of the two odometers is off, or their units are others"
    )
