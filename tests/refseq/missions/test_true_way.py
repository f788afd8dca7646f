"""True places of a way against ways that can be checked by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.missions.path import MissionPath
from refseq.missions.plan import Order, Plan
from refseq.missions.true_way import TrueWay, distance_to
from refseq.planar import Pose


def test_where_an_order_may_begin_is_told_by_where_the_reference_really_was() -> None:
    """A way round a corner, driven with an odometer that counts a tenth too much."""
    places = np.array([[0.0, 0], [2, 0], [4, 0], [4, 2]])
    way = MissionPath(np.arange(4), np.array([0, 2.2, 4.4, 6.6]), ("MN", "", "MT:90", "MN"), ())
    ground = TrueWay(way, places)
    plan = Plan(way, (Order(0.0, "MN", ""), Order(4.4, "MT:90", ""), Order(4.4, "MN", "")), 6.6)
    assert ground.where(plan, 0).tolist() == [[0, 0], [2, 0], [4, 0]]
    assert ground.where(plan, 1).tolist() == [[4, 0]]
    assert ground.where(plan, 2).tolist() == [[4, 0], [4, 2]]
    assert ground.nearest(Pose(2.4, 0.3, 0.0)) == 2.2
    assert ground.pose(2.2).heading == pytest.approx(0.0)
    assert ground.pose(5.5).heading == pytest.approx(math.pi / 2)


@given(st.lists(st.tuples(*[st.floats(-9, 9)] * 2), min_size=1, max_size=5), st.tuples(*[st.floats(-9, 9)] * 2))
def test_the_distance_to_a_line_is_that_to_the_nearest_of_many_points_on_it(
    line: list[tuple[float, float]], point: tuple[float, float]
) -> None:
    ends = np.array(line)
    steps = np.linspace(0, max(len(line) - 1, 0), 2001)
    dense = np.stack([np.interp(steps, np.arange(len(line)), ends[:, axis]) for axis in (0, 1)], axis=1)
    nearest = float(np.hypot(*(dense - point).T).min())
    found = distance_to(ends, np.array(point))
    assert found <= nearest + 1e-9
    assert found == pytest.approx(nearest, abs=0.06)
