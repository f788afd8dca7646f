"""Agreement between methods: how often two of them mean the same place.

Of the views at which both give an answer, those at which the two places lie within the tolerance of each other, along
their drive by its odometer; where that has no odometry, at most ``PLACES`` places apart. With a tolerance in pictures
places are counted, odometry or not. Where a method has merged drives, a place is at the one that holds it.
"""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.consistency.answers import OdometricPlaces, given_answers
from refseq_bench.scenarios.scoring.path_geometry import LengthUnit, Tolerance
from refseq_bench.scenarios.scoring.proportion import Proportion

PLACES = 2
"""Places that answers may be apart in a drive without odometry."""


def agreement(
    comparison: Comparison, places: OdometricPlaces, one: str, other: str, tolerance: Tolerance
) -> Proportion:
    """Count the views at which two methods agree, of those at which both give an answer."""
    first, second = (given_answers(comparison, method) for method in (one, other))
    _, mine, theirs = np.intersect1d(first.views, second.views, assume_unique=True, return_indices=True)
    agree = np.zeros(len(mine), np.bool_)
    for held_by in (comparison.held_by(one), comparison.held_by(other)):
        agree |= _near(places, held_by[first.places[mine]], held_by[second.places[theirs]], tolerance)
    return Proportion(int(agree.sum()), len(agree))


def _near(
    places: OdometricPlaces, one: NDArray[np.intp], other: NDArray[np.intp], tolerance: Tolerance
) -> NDArray[np.bool_]:
    """Mark the places that lie within the tolerance of others along one drive (n,)."""
    between, same_drive = np.abs(one - other), places.drive[one] == places.drive[other]
    if tolerance.unit is LengthUnit.FRAMES:
        return np.asarray(same_drive & (between <= tolerance.distance))
    measured = np.abs(places.apart(one, other)) <= tolerance.distance
    return np.asarray(measured | (np.isnan(places.along[one]) & same_drive & (between <= PLACES)))
