"""The cut of a drive in two of which the second comes back to the first, so that one log serves to learn and to ask."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.log_tools.travel import REVISIT_AFTER
from refseq_bench.scenarios.scoring.path_geometry import WIDE, angle_between


@dataclass(frozen=True, slots=True)
class DriveSplit:
    """A drive of which the views before ``cut`` are learnt; of the ``asked`` others, ``on_map`` are near those."""

    cut: int
    asked: int
    on_map: int


def split_of(places: NDArray[np.float64], along: NDArray[np.float64], fewest: int) -> DriveSplit | None:
    """Cut a drive where most of the views that follow come back to what is learnt; of equal cuts at the first.

    ``places`` (n, 3) are x, y [m] and heading [rad] of its views, nan where they are not known, ``along`` (n,) is the
    way up to each [m]. At least ``fewest`` views are learnt. None where nothing comes back.
    """
    first = np.arange(len(places))  # the first view at each one's place
    back = np.zeros(len(places) + 1, dtype=int)  # changes, from cut to cut, of the number of views that come back
    for view, near in _near(places):
        first[view] = near.min()
        earlier = near[along[near] < along[view] - REVISIT_AFTER]
        if len(earlier):
            back[earlier.min() + 1] += 1
            back[view + 1] -= 1
    counts = np.cumsum(back)[:-1]
    counts[:fewest] = 0
    if not counts.any():
        return None
    cut = int(np.argmax(counts))
    return DriveSplit(cut, len(places) - cut, int((first[cut:] < cut).sum()))


def _near(places: NDArray[np.float64]) -> Iterator[tuple[int, NDArray[np.intp]]]:
    """Each view whose place is known, and the views there, itself among them, by the tolerance of the headline figures.

    One after the other: of a robot that stands, all pairs at once would fill the memory.
    """
    from scipy.spatial import cKDTree  # slow to import: a log's topics are told without it

    known = np.flatnonzero(np.isfinite(places).all(axis=1))
    tree = cKDTree(places[known, :2].reshape(-1, 2))
    for view in known.tolist():
        there = known[tree.query_ball_point(places[view, :2], WIDE.distance)]
        yield view, there[angle_between(places[there, 2], places[view, 2]) <= WIDE.heading]
