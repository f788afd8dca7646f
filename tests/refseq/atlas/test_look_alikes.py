"""Stretches of a path that its own odometry tells apart, and joins that tell of nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.atlas.consistency import Verdict
from refseq.atlas.found import FoundOverlap
from refseq.atlas.look_alikes import LookAlike, look_alikes, told_inside
from refseq.atlas.overlap import Overlap

WINGS = np.column_stack([np.arange(10, 30), np.arange(60, 80)])
ALONG = 0.85 * np.arange(100.0)


def loop(path: int, alike: float | None, views: NDArray[np.intp] = WINGS) -> FoundOverlap:
    return FoundOverlap(path, path, views, Overlap(views, (16.0, 16.0), {}, alike=alike))


def test_a_contradicted_loop_whose_walls_are_alike_makes_two_look_alikes() -> None:
    found = look_alikes([loop(3, 0.99)], [Verdict.CONTRADICTED], 0.98)
    assert found == [LookAlike(3, 10, 29, (60, 79)), LookAlike(3, 60, 79, (10, 29))]


@pytest.mark.parametrize(
    ("alike", "verdict"),
    [
        (0.97, Verdict.CONTRADICTED),
        (None, Verdict.CONTRADICTED),
        (0.99, Verdict.AGREES),
        (0.99, Verdict.CONTESTED),
        (0.99, Verdict.UNSUPPORTED),
        (0.99, None),
    ],
)
def test_other_loops_make_none(alike: float | None, verdict: Verdict | None) -> None:
    """A path that truly comes back sees its own walls, and nobody contradicts that."""
    assert not look_alikes([loop(3, alike)], [verdict], 0.98)


def test_a_join_of_two_paths_makes_none() -> None:
    assert not look_alikes([replace(loop(3, 0.99), other=4)], [Verdict.CONTRADICTED], 0.98)


@pytest.mark.parametrize(
    ("path", "first", "last", "inside"),
    [
        (3, 12, 28, True),
        (3, 60, 79, True),
        (3, 8, 32, True),  # 4.25 m more than the look-alike
        (3, 5, 34, False),  # 8.5 m more
        (3, 32, 50, False),  # beside both
        (2, 12, 28, False),  # of another path
    ],
)
def test_a_join_is_inside_where_it_tells_of_less_than_five_metres_more(
    path: int, first: int, last: int, inside: bool
) -> None:
    loops = [loop(9, 0.99, WINGS + 1000), loop(3, 0.99)]
    known = look_alikes(loops, [Verdict.CONTRADICTED] * 2, 0.98)
    found = told_inside(path, np.arange(first, last + 1), ALONG, known, 5.0)
    assert (found is not None) == inside
