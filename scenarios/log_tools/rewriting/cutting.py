"""Stretches of a log to keep: by views, by time, by distance, or all but the standing at both ends."""

import math
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import way_along
from refseq.errors import LogError
from refseq.logs.carmen.source import CarmenSource, LineSpan
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.source import NANOSECONDS, Sample
from refseq_bench.scenarios.drives.selection import stretch
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.rewriting.copies import LoggedSpan

STANDING_TURN = math.radians(5)
STANDING_WAY = 0.1
"""A robot that has gone less than this [m], and turned less [rad], stands: odometers tremble."""

REST = 1.0
"""So much of the standing is left at each end [s], so that the first view is one at rest."""


@dataclass(frozen=True, slots=True)
class KeptStretch:
    """The views that stay, and the times of the first and the last [s]."""

    views: slice
    first: float
    last: float


def by_views(plan: ViewPlan, text: str) -> KeptStretch:
    """The views FROM:TO, TO not among them. Raises ``ScenarioError``."""
    return _kept(plan, stretch(text, len(plan), plan.source.path))


def by_time(plan: ViewPlan, text: str) -> KeptStretch:
    """The views from A to B seconds since the first one. Raises ``ScenarioError``."""
    since = np.array([view.time for view in plan.views]) - plan.views[0].time
    return _kept(plan, _within(plan, since, text, "time", "s"))


def by_distance(plan: ViewPlan, text: str) -> KeptStretch:
    """The views from A to B metres along the path by odometry. Raises ``ScenarioError``."""
    along = way_along(plan.views)
    return _kept(plan, _within(plan, along, text, "distance", "m"))


def without_standing(plan: ViewPlan) -> KeptStretch:
    """All but the standing before the robot first moves and after it has stopped. Raises ``ScenarioError``."""
    times = np.array([view.time for view in plan.views])
    way = way_along(plan.views)
    turned = np.cumsum([view.turn for view in plan.views])
    leaving = _moved(way, turned, 0)
    if not leaving.any():
        raise ScenarioError(f"{plan.source.path}: the robot never moves; valid is a log with a drive")
    arriving = _moved(way, turned, -1)
    first, last = int(leaving.argmax()) - 1, len(times) - int(arriving[::-1].argmax())
    first = int(np.searchsorted(times, times[first] - REST))
    last = min(len(times) - 1, int(np.searchsorted(times, times[min(last, len(times) - 1)] + REST)))
    return _kept(plan, slice(first, last + 1))


def _moved(way: NDArray[np.float64], turned: NDArray[np.float64], since: int) -> NDArray[np.bool_]:
    """Marks of the views at which the robot has left where it was at view ``since``."""
    return (np.abs(way - way[since]) >= STANDING_WAY) | (np.abs(turned - turned[since]) >= STANDING_TURN)


def _within(plan: ViewPlan, values: NDArray[np.float64], text: str, what: str, unit: str) -> slice:
    """The views whose value lies in A:B."""
    number = r"\d*\.?\d*"
    match = re.fullmatch(rf"({number}):({number})", text)
    end = float(values[-1])
    try:
        low, high = (float(match[1] or 0), float(match[2] or end)) if match else (1.0, 0.0)
    except ValueError:  # a dot alone
        low, high = 1.0, 0.0
    chosen = np.flatnonzero((values >= low) & (values <= high))
    if low >= high or not len(chosen):
        raise ScenarioError(
            f"{plan.source.path}: {what} {text!r} is no stretch of it; valid is FROM:TO within 0:{end:.1f} {unit}"
        )
    return slice(int(chosen[0]), int(chosen[-1]) + 1)


def _kept(plan: ViewPlan, views: slice) -> KeptStretch:
    kept = plan.views[views]
    return KeptStretch(views, kept[0].time, kept[-1].time)


def log_span(plan: ViewPlan, kept: KeptStretch) -> LoggedSpan | LineSpan:
    """Everything that belongs to the views that stay, and the odometry between them: by lines of a CARMEN log."""
    if isinstance(plan.source, CarmenSource):
        numbers = plan.moments.numbers[kept.views]
        return plan.source.lines_of(int(numbers[0]), int(numbers[-1]))
    return _logged_span(plan, kept)


def _logged_span(plan: ViewPlan, kept: KeptStretch) -> LoggedSpan:
    """The same by the times of logging."""
    margin = plan.findings.tolerance
    logged = [
        sample.logged
        for sample in plan.source.samples()
        if kept.first - margin <= _time(plan, sample) <= kept.last + margin
    ]
    if not logged:
        raise LogError(f"{plan.source.path}: nothing was logged between {kept.first:.3f} and {kept.last:.3f} s")
    return LoggedSpan(math.floor(min(logged) * NANOSECONDS), math.ceil(max(logged) * NANOSECONDS))


def _time(plan: ViewPlan, sample: Sample) -> float:
    """The time that views go by: that of logging in the bench's own recordings, else the sensor's stamp."""
    return sample.time if plan.findings.leading else sample.logged
