"""Recovery distances: how far the robot travels until the localiser notices what happened to it.

Distances are lengths of the true path [m], from view to view, over the views whose true pose is known.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.outcome import OFF_MAP, ON_MAP, SAYS_LOST, Outcome

JUMP = 1.5
"""Carried away [m]: that much farther from the view before than odometry has it."""

DistanceOrNever = float | None
"""A distance [m], or ``None`` where the thing never happened."""


def median_way(ways: Sequence[DistanceOrNever]) -> float:
    """Median of some ways [m]: what never happened is longer than all of them; nan without any.

    Infinite where half of them or more never happened: a method that gets there once in five times, at once, is not
    quick.
    """
    return float(np.median([math.inf if way is None else way for way in ways])) if ways else math.nan


class Recovery(NamedTuple):
    """Distances from the first view after something happened to the first that shows that it was noticed.

    ``to_lost`` holds, for each time that the robot left the map, the way from its first view off it to the first that
    says lost; ``to_recover``, for each time that it came onto the map or was carried to another place of it, the way
    from its first view there to the first right answer. A way ends where the episode does.
    """

    to_lost: tuple[DistanceOrNever, ...]
    to_recover: tuple[DistanceOrNever, ...]


class WayPoint(NamedTuple):
    """A ``view`` whose pose is known: how far the robot had ``travelled`` [m], and whether it was carried there."""

    view: int
    travelled: float
    carried: bool


@dataclass(frozen=True, slots=True)
class _Known:
    """A view with a true pose: how far the robot has come [m], and whether it was carried to where it is."""

    outcome: Outcome
    travelled: float
    carried: bool


def recovery_of(views: Sequence[View], outcomes: Sequence[Outcome]) -> Recovery:
    """Measure a drive's recovery distances, one outcome a view."""
    stretches = list(_stretches(list(_known(views, outcomes))))
    return Recovery(
        to_lost=tuple(_distance(s, SAYS_LOST) for s in stretches[1:] if s[0].outcome in OFF_MAP),
        to_recover=tuple(_distance(s, (Outcome.RIGHT,)) for s in stretches[1:] if s[0].outcome in ON_MAP),
    )


def first_fix(views: Sequence[View], outcomes: Sequence[Outcome]) -> DistanceOrNever:
    """Way from the first view to the first right answer."""
    return _distance(list(_known(views, outcomes)), (Outcome.RIGHT,))


def _known(views: Sequence[View], outcomes: Sequence[Outcome]) -> Iterator[_Known]:
    return (_Known(outcomes[one.view], one.travelled, one.carried) for one in true_way(views))


def true_way(views: Sequence[View]) -> Iterator[WayPoint]:
    """The way along the true path, at each view whose pose is known; where the robot was carried is no way of its."""
    # A drive without odometry cannot tell being carried from going.
    tells = any(view.distance for view in views)
    travelled, odometer, last = 0.0, 0.0, None
    for number, view in enumerate(views):
        odometer += abs(view.distance)
        if view.truth is None:
            continue
        step = apart(last, view.truth) if last else 0.0
        carried = tells and is_carried(step, odometer)
        # The way on a person's arms is not the robot's.
        travelled += 0.0 if carried else step
        yield WayPoint(number, travelled, carried)
        odometer, last = 0.0, view.truth


def apart(one: Pose, other: Pose) -> float:
    """Distance between two true poses [m]."""
    return math.hypot(one.x - other.x, one.y - other.y)


def is_carried(step: float, odometer: float) -> bool:
    """Tell whether a true ``step`` is so much longer than the ``odometer`` counted [m] that it was carried."""
    return step > odometer + JUMP


def _stretches(views: Sequence[_Known]) -> Iterator[list[_Known]]:
    """Views in a row that are all on the map without being carried to another place of it, or all off it.

    A robot that is carried while it is off the map does not leave the map once more.
    """
    stretch: list[_Known] = []
    for view in views:
        on_map = view.outcome in ON_MAP
        if stretch and (on_map != (stretch[-1].outcome in ON_MAP) or (view.carried and on_map)):
            yield stretch
            stretch = []
        stretch.append(view)
    if stretch:
        yield stretch


def _distance(stretch: Sequence[_Known], wanted: Sequence[Outcome]) -> DistanceOrNever:
    """Way from a stretch's first view to its first with a wanted outcome."""
    return next((view.travelled - stretch[0].travelled for view in stretch if view.outcome in wanted), None)
