"""Jumps: answers that lie farther from the answer before than odometry lets the robot have come.

From one answer given to the next, the best place moves by Δa along its drive (by that drive's odometer) while the robot
travels Δs (by its own). The step is a jump where

    |Δa| − Δs > max(2 · tolerance, spacing of the places)

since each of both answers may be off by the tolerance, or by half of the way to the next place. A tolerance in pictures
is that many spacings. A step between places of different drives has no Δa and is none.
"""

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.scoring.consistency.answers import GivenAnswers, OdometricPlaces
from refseq_bench.scenarios.scoring.path_geometry import LengthUnit, Tolerance


def excess(answers: GivenAnswers, places: OdometricPlaces) -> NDArray[np.float64]:
    """Excess: how much farther each answer lies from the one before than was travelled, |Δa| − Δs (n − 1,) [m].

    It is nan where a step cannot be measured: between drives, or where a drive has no odometry.
    """
    moved = places.apart(answers.places[:-1], answers.places[1:])
    return np.asarray(np.abs(moved) - np.diff(answers.travelled))


def jumped(answers: GivenAnswers, places: OdometricPlaces, tolerance: Tolerance) -> NDArray[np.bool_]:
    """Mark the steps from one answer to the next that are jumps, (n − 1,)."""
    with np.errstate(invalid="ignore"):
        return np.asarray(excess(answers, places) > allowed(places, tolerance))


def allowed(places: OdometricPlaces, tolerance: Tolerance) -> float:
    """Excess up to which a step is no jump [m]."""
    length = places.spacing if tolerance.unit is LengthUnit.FRAMES else 1.0
    return max(2 * tolerance.distance * length, places.spacing)
