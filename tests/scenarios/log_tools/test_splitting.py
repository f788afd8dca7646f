"""The cut of a drive in two against counting by hand, and against all cuts tried one by one."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq.pose_graph import ways_along
from refseq.view import View
from refseq_bench.scenarios.log_tools.splitting import DriveSplit, split_of
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath


def path(*legs: tuple[float, float, float]) -> NDArray[np.float64]:
    """Rows of x, y [m] and heading [rad] a metre apart; legs are so long [m] with a heading [degrees] and a y [m]."""
    rows = [(k * math.cos(math.radians(at)), y, math.radians(at)) for length, at, y in legs for k in range(int(length))]
    return np.array(rows)


def test_the_cut_is_where_most_comes_back_not_where_something_first_does() -> None:
    """A corner that is met again early is no place to cut: half an hour later a whole corridor is."""
    early = np.array([[100.0 + k, 0.0, 0.0] for k in range(20)])
    corner = np.array([[100.0, 0.0, 0.0], [101.0, 0.0, 0.0]])
    corridor = path((60, 0, 50))
    places = np.concatenate([early, corner, corridor, corridor])
    found = split_of(places, np.arange(len(places), dtype=float), 10)
    assert found == DriveSplit(81, 61, 61), "the last view of the first pass is at the place of the one before"


def test_a_drive_that_never_comes_back_and_one_without_places_have_no_cut() -> None:
    assert split_of(path((60, 0, 0)), np.arange(60.0), 10) is None
    assert split_of(path((30, 0, 0), (30, 180, 0)), np.arange(60.0), 10) is None, "it looks the other way"
    assert split_of(np.full((60, 3), np.nan), np.arange(60.0), 10) is None
    assert split_of(np.zeros((0, 3)), np.zeros(0), 10) is None


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 10**6), st.booleans())
def test_no_other_cut_has_more_and_a_score_counts_as_many(seed: int, gaps: bool) -> None:
    rng = np.random.default_rng(seed)
    headings = np.cumsum(rng.choice([0.0, 0.0, math.pi / 2, -math.pi / 2], 80))
    places = np.column_stack([np.cumsum(np.cos(headings)), np.cumsum(np.sin(headings)), headings])
    along = ways_along(places)
    places[rng.random(80) < 0.2 * gaps] = np.nan
    views = [View(0.0, truth=None if np.isnan(x) else Pose(x, y, h)) for x, y, h in places.tolist()]
    near = ReferencePath(views).near(views, WIDE)
    back = near & (along[:, None] - along[None, :] > 10.0)
    counts = [int(back[cut:, :cut].any(axis=1).sum()) for cut in range(10, 80)]
    found = split_of(places, along, 10)
    if not max(counts):
        assert found is None
    else:
        cut = 10 + int(np.argmax(counts))
        assert found == DriveSplit(cut, 80 - cut, int(near[cut:, :cut].any(axis=1).sum()))


@pytest.mark.parametrize("fewest", [2, 40])
def test_so_few_views_are_never_learnt(fewest: int) -> None:
    places = np.concatenate([path((15, 0, 0)), path((15, 0, 0)), path((15, 0, 0))])
    found = split_of(places, np.arange(45.0), fewest)
    assert found is not None
    assert found.cut >= fewest
