"""The distance up to which descriptors are the same word, chosen from a reference drive itself."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features.nearest import nearest, squared_distances

_PAIRS = 100
"""Pairs of views that are looked at: more cost time and hardly move the distance."""
RATIO = 0.8
"""A descriptor seen again is nearer than so much of the second nearest's distance: the ratio of Lowe's paper."""


def choose_alias_distance(descriptors_by_view: Sequence[NDArray[Any]], precision: float = 0.8) -> float:
    """The largest distance at which an alias is right with the asked ``precision``; (n, D) descriptors of each view.

    The same thing seen again are descriptors of consecutive views that are nearest to each other and pass the ratio
    test: nearer than ``RATIO`` times the second nearest. For each of them the nearest descriptor of the view half the
    drive away is another thing. Let S(t) and O(t) be the shares of either distances up to t. Between the next view and
    the far one an alias means the right one with S / (S + O), the precision.

    What looks alike far apart, such as equal doors, counts as different: a word for both would not tell the places
    apart. Raises ``MapError`` where the drive shows nothing twice, or where no distance is that precise.
    """
    same, other = distances_of_things(descriptors_by_view)
    if not len(same):
        raise MapError(f"an alias distance cannot be chosen: {len(descriptors_by_view)} views show nothing twice")
    candidates = np.concatenate([same, other])
    right, wrong = (np.searchsorted(np.sort(found), candidates, side="right") for found in (same, other))
    precise = candidates[precision * (right + wrong) <= right]
    if not len(precise):
        raise MapError(f"no alias distance has precision {precision:g}; valid is less than that")
    return float(precise.max())


def distances_of_things(
    descriptors_by_view: Sequence[NDArray[Any]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances between sights of the same thing, and from the same sights to other things, (n,) both."""
    count = len(descriptors_by_view)
    same, other = [np.zeros(0)], [np.zeros(0)]
    if count < 4:  # the view half the drive away would be this one or the next
        return same[0], other[0]
    for index in np.unique(np.linspace(0, count - 2, min(count - 1, _PAIRS)).round().astype(int)):
        first, second, far = (descriptors_by_view[k % count] for k in (index, index + 1, index + count // 2))
        again, squared = _seen_again(first, second)
        same.append(np.sqrt(squared))
        other.append(np.sqrt(nearest(first[again], far).squared))
    return np.concatenate(same), np.concatenate(other)


def _seen_again(first: NDArray[Any], second: NDArray[Any]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Members of ``first`` that are surely seen again in ``second``, and their squared distances."""
    if not len(first) or len(second) < 2:
        return np.zeros(0, np.intp), np.zeros(0)
    squared = squared_distances(first, second).astype(np.float64)
    rows = np.arange(len(first))
    closest = np.argmin(squared, axis=1)
    mutual = np.argmin(squared, axis=0)[closest] == rows
    two = np.partition(squared, 1, axis=1)[:, :2]
    again = np.flatnonzero(mutual & (two[:, 0] < RATIO**2 * two[:, 1]))
    return again, two[again, 0]
