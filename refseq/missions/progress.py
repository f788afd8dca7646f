"""Progress filter: the position along a way, by odometer and views; one wrong view does not carry it away."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief, PoseBeside
from refseq.missions.path import MissionPath


@dataclass(frozen=True, slots=True)
class ProgressSettings:
    """When beliefs are followed; all are choices.

    A belief agrees where more than ``sure`` of its probability lies within ``near`` [m] of where the robot should be.
    Then the position goes by ``share`` of the way to what the belief says: places lie as far apart as views, and
    between two views the odometer is the better of the two. Where the belief tells a pose beside its place, the share
    is the gain of a filter whose odometer leaves a standard deviation of ``odometer`` [m] between views: a smaller one
    trusts scans less. A robot that looks elsewhere than its place by more than ``aligned`` [rad] is in a turn, and its
    pose tells nothing of its way. Another position takes ``confirm`` views that agree with
    each other, and is then the mean of what views say of it, until that moves it by less than ``share``. After ``lost``
    views in a row that say that it is lost, or elsewhere than on its way, it is; after twice as many, too, that each
    say something else.
    """

    sure: float = 0.5
    near: float = 1.5
    share: float = 0.2
    odometer: float = 0.125
    aligned: float = math.radians(20)
    confirm: int = 3
    lost: int = 3


class Estimate(Enum):
    """A view's answer to where the robot should be."""

    AGREES = "agrees"
    DOUBTS = "doubts"
    LOST = "lost"
    MOVED = "moved"


class ProgressFilter:
    """The position along a way [m]: the odometer carries it on, by the scale that beliefs give it; views put it right.

    ``doubts`` and ``losses`` count the views in a row that did not agree, and those of them that said lost. ``beside``
    is where beside the way the last view has the robot, None where it tells nothing of that.
    """

    def __init__(self, path: MissionPath, settings: ProgressSettings, along: float = 0.0) -> None:
        self._path, self._settings = path, settings
        self.along = along
        self.doubts = self.losses = self.agreements = 0
        self.beside: PoseBeside | None = None
        self._other: tuple[float, int] | None = None
        self._scale = 1.0
        self._views = math.inf  # that the position is the mean of: who set the robot down knew where

    def move(self, distance: float) -> None:
        """The odometer has gone on by so much [m]."""
        distance *= self._scale
        self.along += distance
        if self._other is not None:
            self._other = self._other[0] + distance, self._other[1]

    @property
    def lost(self) -> bool:
        """True where the last views all said so."""
        return self.losses >= self._settings.lost or self.doubts >= 2 * self._settings.lost

    def update(self, belief: Belief) -> Estimate:
        """Take the belief of a view at the present position."""
        self._scale = belief.odometer_scale
        places = (1.0 - belief.lost) * belief.places
        if belief.lost <= LOST_ABOVE and (found := self._peak(places, self.along)) is not None:
            self._views += 1
            found, share = self._measured(belief, found)
            self.along += max(share, 1 / self._views) * (found - self.along)
            self.doubts, self.losses, self._other = 0, 0, None
            self.agreements += 1
            return Estimate.AGREES
        self.doubts, self.agreements, self.beside = self.doubts + 1, 0, None
        other = None if belief.lost > LOST_ABOVE else self._peak(places, self._likeliest(places))
        if other is None:
            self.losses, self._other = self.losses + 1, None
            return Estimate.LOST
        return self._doubt(other)

    def _measured(self, belief: Belief, found: float) -> tuple[float, float]:
        """Position [m] that a view tells, and the share that it counts; ``found`` [m] is that of its places alone."""
        pose, settings = belief.pose, self._settings
        ats = self._path.along[self._path.places == belief.best]
        at = min(ats.tolist(), key=lambda at: abs(at - self.along), default=math.inf)
        looks_along = pose is not None and abs(pose.heading) <= settings.aligned
        self.beside = pose if looks_along and abs(at - self.along) <= settings.near else None
        if self.beside is not None:
            variance = float(self.beside.covariance[0, 0])
            share = settings.odometer**2 / (settings.odometer**2 + variance)
            if share > settings.share:  # along a bare corridor a scan tells less than the place
                return at + self.beside.along, share
        return found, settings.share

    def _likeliest(self, probabilities: NDArray[np.float64]) -> float:
        """Position [m] of the likeliest place; of several positions that it has the nearest to the robot's."""
        held = self._path.held
        at = held.along[held.places == held.places[np.argmax(probabilities[held.places])]]
        return float(at[np.argmin(np.abs(at - self.along))])

    def _doubt(self, other: float) -> Estimate:
        """A view says another position on the way; one that has been confirmed is taken."""
        again = self._other is not None and abs(self._other[0] - other) <= self._settings.near
        count = self._other[1] + 1 if self._other is not None and again else 1
        self._other, self.losses = (other, count), 0
        if count < self._settings.confirm:
            return Estimate.DOUBTS
        self.along, self.doubts, self._other, self.agreements = other, 0, None, 1
        self._views = 1  # the others were taken close by, or at the same place
        return Estimate.MOVED

    def _peak(self, probabilities: NDArray[np.float64], about: float) -> float | None:
        """Mean position of what a belief (K,) has near a position [m]; None where that is not most of it.

        A place counts once, at the mean of its positions there, however many views of the way lie at it.
        """
        held = self._path.held
        here = np.abs(held.along - about) <= self._settings.near
        places, spot, counts = np.unique(held.places[here], return_inverse=True, return_counts=True)
        positions = np.bincount(spot, held.along[here]) / counts
        weights = probabilities[places]
        total = float(weights.sum())
        return float(weights @ positions) / total if total > self._settings.sure else None
