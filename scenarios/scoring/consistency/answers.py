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


def query_steps(comparison: Comparison) -> NDArray[np.float64]:
    """Steps of the query's odometer, (M,) [m], the first 0; nan of one without odometry, or with an assumed one."""
    steps = odometer_steps(comparison.query_views)
    if not steps.any() or is_assumed(comparison.query_metadata):
        return np.full(len(steps), np.nan)
    return steps


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
    steps = query_steps(comparison)
    return GivenAnswers(
        views=views,
        places=np.array([beliefs[t].best for t in views], np.intp),
        odometer=np.cumsum(steps)[views],
        travelled=np.cumsum(np.abs(steps))[views],
    )
