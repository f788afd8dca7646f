"""Keys of two pictures laid on each other: which are each other's nearest, and how many of those move as one.

A robot that comes by again sees a part of what it saw, somewhat larger or smaller and somewhat to the side. A
similarity (shift, turn and scale) that maps keys of one picture onto keys of the other is found by RANSAC (M. Fischler,
R. Bolles, CACM 24(6), 1981). No ratio test goes before it: the fit sorts out what only looks alike.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.nearest import squared_distances
from refseq.features.word_extractor import PictureKeys

REACH = 6.0
"""A pair fits that lies so near [pixels]: less loses keys at other depths, more lets chance in."""
UPRIGHT, LARGER = np.radians(20.0), 2.0
"""A camera on a robot turns a picture no further [rad], and shows a place near by no larger or smaller than that."""
ROUNDS, CONFIDENCE = 500, 0.99
"""Samples that RANSAC draws at most, and how sure it has to be of a good one before it stops."""
SAMPLE = 2
"""Pairs that some similarity fits, whatever they are."""


@dataclass(frozen=True, slots=True)
class KeyFit:
    """Keys of a view laid on those of a place.

    ``matches`` are pairs of keys that are each other's nearest, ``inliers`` those of them that one similarity fits,
    and ``scale`` is how much larger the view shows them. Without a fit there are no inliers, and the scale is 1.
    """

    matches: int = 0
    inliers: int = 0
    scale: float = 1.0


def fit_keys(place: PictureKeys, view: PictureKeys) -> KeyFit:
    """Lay a view's keys on those of a place; the same keys give the same fit."""
    theirs, ours = mutually_nearest(place.descriptors, view.descriptors)
    if len(ours) <= SAMPLE:
        return KeyFit(len(ours))
    motion, agree = cv2.estimateAffinePartial2D(
        place.points[theirs],
        view.points[ours],
        method=cv2.RANSAC,
        ransacReprojThreshold=REACH,
        maxIters=ROUNDS,
        confidence=CONFIDENCE,
        refineIters=0,
    )
    inliers = 0 if motion is None else int(np.count_nonzero(agree))
    if inliers <= SAMPLE:
        return KeyFit(len(ours))
    scale, turn = float(np.hypot(motion[0, 0], motion[1, 0])), float(np.arctan2(motion[1, 0], motion[0, 0]))
    if abs(turn) > UPRIGHT or not 1 / LARGER < scale < LARGER:
        return KeyFit(len(ours))
    return KeyFit(len(ours), inliers, scale)


def mutually_nearest(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of two sets of descriptors that are each other's nearest, (m,) each; of equals the first."""
    if not len(one) or not len(other):
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    squared = squared_distances(one, other)
    nearest = np.argmin(squared, axis=1)
    mutual = np.flatnonzero(np.argmin(squared, axis=0)[nearest] == np.arange(len(one)))
    return mutual, nearest[mutual]
