"""Agreement with odometry: the way along the path by the answers, over the way by the robot's odometer.

Answers without a jump between them are a run. In all runs together the distance along the map a is a line over the
odometer s, with an intercept of its own for each run (the within estimator of panel regression):

    slope = Σ (s − s̄)(a − ā) / Σ (s − s̄)²        residual² = Σ ((a − ā) − slope · (s − s̄))² / n

with means s̄ and ā of each run, over the n answers in runs of two or more. A localiser that follows the robot has slope
1 and a residual of about the places' spacing; one whose answers stay where they are while the robot drives, slope 0.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.scoring.consistency.answers import GivenAnswers, OdometricPlaces


@dataclass(frozen=True, slots=True)
class OdometryFit:
    """Sums of one run or several, which can be added up: ``ss``, ``sa``, ``aa`` [m²] over so many ``answers``."""

    ss: float = 0.0
    sa: float = 0.0
    aa: float = 0.0
    answers: int = 0

    def __add__(self, other: "OdometryFit") -> "OdometryFit":
        return OdometryFit(self.ss + other.ss, self.sa + other.sa, self.aa + other.aa, self.answers + other.answers)

    @property
    def slope(self) -> float:
        """Metres along the map for each metre of the odometer; nan where there is no run, or no odometry."""
        return self.sa / self.ss if self.ss > 0 else math.nan

    @property
    def residual(self) -> float:
        """Root of the mean square that the line leaves [m]; nan where there is no line."""
        if not self.ss > 0:
            return math.nan
        return math.sqrt(max(self.aa - self.sa**2 / self.ss, 0.0) / self.answers)


def odometry_fit(answers: GivenAnswers, places: OdometricPlaces, jumped: NDArray[np.bool_]) -> OdometryFit:
    """Fit the answers of a drive, of which the steps (n − 1,) that ``jumped`` end a run, as a change of drive does."""
    drive = places.drive[answers.places]
    ends = np.flatnonzero(jumped | (drive[1:] != drive[:-1])) + 1
    found = OdometryFit()
    for run in np.split(np.arange(len(answers.views)), ends):
        s, a = answers.odometer[run], places.along[answers.places[run]]
        if len(run) > 1 and np.isfinite(s).all() and np.isfinite(a).all():
            s, a = s - s.mean(), a - a.mean()
            found += OdometryFit(float(s @ s), float(s @ a), float(a @ a), len(run))
    return found
