"""Answers of a method in metres of odometry: how far along its drive each place is, how far the robot had come."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE
from refseq.view import ASSUMED, View
from refseq_bench.scenarios.scoring.comparison import Comparison


@dataclass(frozen=True, slots=True)
class OdometricPlaces:
    """The K places of what was learnt: the number of each one's ``drive`` (K,), and its distance ``along`` it (K,) [m].

    The distance is that of the odometer from the drive's first view on, nan in a drive without odometry, or with one
    that was only assumed. ``spacing`` [m] is the median step from one place to the next.
    """

    drive: NDArray[np.intp]
    along: NDArray[np.float64]
    spacing: float

    def apart(self, one: NDArray[np.intp], other: NDArray[np.intp]) -> NDArray[np.float64]:
        """Signed way along the drive from places to others (n,) [m]; nan between places of different drives."""
        return np.where(self.drive[one] == self.drive[other], self.along[other] - self.along[one], np.nan)


def odometric_places(comparison: Comparison) -> OdometricPlaces:
    """Measure the reference drives by their odometers."""
    drives, along, steps = [], [], [np.zeros(0)]
    assumed = is_assumed(comparison.reference_metadata)
    for number, stretch in enumerate(comparison.stretches):
        views = comparison.reference_views[stretch]
        step = np.zeros(len(views)) if assumed else np.abs(odometer_steps(views))
        drives.append(np.full(len(views), number, np.intp))
        along.append(np.cumsum(step) if step.any() else np.full(len(views), np.nan))
        steps.append(step[1:] if step.any() else np.zeros(0))
    every = np.concatenate(steps)
    spacing = float(np.median(every)) if len(every) else 0.0
    return OdometricPlaces(np.concatenate(drives), np.concatenate(along), spacing)


def odometer_steps(views: Sequence[View]) -> NDArray[np.float64]:
    """Steps of the odometer from view to view, (M,) [m], the first 0."""
    return np.array([0.0, *(view.distance for view in views[1:])])[: len(views)]


def is_assumed(metadata: Mapping[str, object]) -> bool:
    """Tell whether a drive's odometry was not measured but assumed, as so many metres a picture."""
    return str(metadata.get("odometry", "")).startswith(ASSUMED)


@dataclass(frozen=True, slots=True)
class GivenAnswers:
    """The n answers that a method gave, views at which it says lost left out, one entry each.

    ``views`` are numbers of query views, ``places`` the best places there. ``odometer`` [m] is the sum of the query's
    steps, less where it reversed, ``travelled`` [m] the sum of their sizes; both are nan of a query without odometry.
    """

    views: NDArray[np.intp]
    places: NDArray[np.intp]
    odometer: NDArray[np.float64]
    travelled: NDArray[np.float64]


def given_answers(comparison: Comparison, method: str) -> GivenAnswers:
    """Collect the answers of a method; one that says lost is none."""
    beliefs = comparison.beliefs[method]
    views = np.array([t for t, belief in enumerate(beliefs) if belief.lost <= LOST_ABOVE], np.intp)
    return GivenAnswers(
        views=views,
        places=np.array([beliefs[t].best for t in views], np.intp),
        odometer=np.cumsum(_query_steps(comparison))[views],
        travelled=query_travelled(comparison)[views],
    )


def query_travelled(comparison: Comparison) -> NDArray[np.float64]:
    """Way up to each query view by its odometer (M,) [m]; nan of a query without odometry, or with an assumed one."""
    return np.cumsum(np.abs(_query_steps(comparison)))


def _query_steps(comparison: Comparison) -> NDArray[np.float64]:
    steps = odometer_steps(comparison.query_views)
    known = steps.any() and not is_assumed(comparison.query_metadata)
    return steps if known else np.full(len(steps), np.nan)
