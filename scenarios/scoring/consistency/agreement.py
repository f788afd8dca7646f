"""Agreement between methods: how often two of them mean the same place.

Of the views at which both give an answer, those at which the two places lie within the tolerance of each other, along
their drive by its odometer; where that has no odometry, at most ``PLACES`` places apart, or as many as a tolerance in
pictures says. Where a method has merged
drives, a place is at the one that holds it.
"""

import numpy as np

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
    apart = tolerance.distance if tolerance.unit is LengthUnit.FRAMES else PLACES
    for held_by in (comparison.held_by(one), comparison.held_by(other)):
        a, b = held_by[first.places[mine]], held_by[second.places[theirs]]
        agree |= np.abs(places.apart(a, b)) <= tolerance.distance
        unmeasured = np.isnan(places.along[a]) & (places.drive[a] == places.drive[b])
        agree |= unmeasured & (np.abs(a - b) <= apart)
    return Proportion(int(agree.sum()), len(agree))
