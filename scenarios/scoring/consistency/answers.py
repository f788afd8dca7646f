"""Answers of a method in metres of odometry: how far along its drive each place is, how far the robot had come."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE
from refseq_bench.scenarios.scoring.comparison import Comparison


@dataclass(frozen=True, slots=True)
class OdometricPlaces:
    """The K places of what was learnt: the number of each one's ``drive`` (K,), and its distance ``along`` it (K,) [m].

    The distance is that of the odometer from the drive's first view on, nan in a drive without odometry. ``spacing``
    [m] is the median step from one place to the next.
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
    for number, stretch in enumerate(comparison.stretches):
        views = comparison.reference_views[stretch]
        step = np.abs([0.0, *(view.distance for view in views[1:])])[: len(views)]
        drives.append(np.full(len(views), number, np.intp))
        along.append(np.cumsum(step) if step.any() else np.full(len(views), np.nan))
        steps.append(step[1:] if step.any() else np.zeros(0))
    every = np.concatenate(steps)
    spacing = float(np.median(every)) if len(every) else 0.0
    return OdometricPlaces(np.concatenate(drives), np.concatenate(along), spacing)


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


def given_answers(comparison: Comparison, method: str, lost_above: float = LOST_ABOVE) -> GivenAnswers:
    """Collect the answers of a method; one whose ``lost`` is above a threshold is none."""
    beliefs = comparison.beliefs[method]
    views = np.array([t for t, belief in enumerate(beliefs) if belief.lost <= lost_above], np.intp)
    steps = np.array([0.0, *(view.distance for view in comparison.query_views[1:])])[: len(beliefs)]
    steps = steps if steps.any() else np.full(len(beliefs), np.nan)
    return GivenAnswers(
        views=views,
        places=np.array([beliefs[t].best for t in views], np.intp),
        odometer=np.cumsum(steps)[views],
        travelled=np.cumsum(np.abs(steps))[views],
    )
