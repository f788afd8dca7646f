"""Ways against plain geometry."""

import math

import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench.sim.envs.tasks.path import REACH, Polyline

BENT = Polyline(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 3.0]]))
THERE_AND_BACK = Polyline(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0]]))


def test_a_way_is_as_long_as_its_legs_and_a_point_twice_is_one() -> None:
    assert BENT.length == 7.0
    assert BENT.along.tolist() == [0.0, 4.0, 7.0]


@pytest.mark.parametrize("along", [0.0, 1.3, 3.9, 4.5, 7.0])
@pytest.mark.parametrize("aside", [-0.3, 0.0, 0.2])
def test_a_pose_beside_the_way_is_found_where_it_was_put(along: float, aside: float) -> None:
    found, off = BENT.project(BENT.pose(along, aside))
    # Inside of the bend the other leg is nearer.
    if not (along == 3.9 and aside == 0.2):
        assert (found, off) == (pytest.approx(along), pytest.approx(abs(aside)))


def test_a_pose_looks_along_the_way_and_turns_to_its_left() -> None:
    assert BENT.pose(1.0) == Pose(1.0, 0.0, 0.0)
    up = BENT.pose(5.0, aside=0.5, turned=0.1)
    assert (up.x, up.y, up.heading) == pytest.approx((3.5, 1.0, math.pi / 2 + 0.1))


def test_no_point_of_the_way_is_nearer_than_the_one_that_is_found() -> None:
    rng = np.random.default_rng(0)
    fine = np.array([(pose.x, pose.y) for pose in map(BENT.pose, np.linspace(0, 7, 7001))])
    for x, y in rng.uniform(-2, 6, (50, 2)):
        along, off = BENT.project(Pose(x, y, 0.0))
        gaps = np.hypot(*(fine - (x, y)).T)
        assert off == pytest.approx(gaps.min(), abs=1e-3)
        assert math.dist((x, y), (BENT.pose(along).x, BENT.pose(along).y)) == pytest.approx(off)


def test_where_a_way_passes_twice_it_is_found_near_where_it_was() -> None:
    between = Pose(3.0, 0.6, 0.0)
    assert THERE_AND_BACK.project(between)[0] == pytest.approx(18.0)
    assert THERE_AND_BACK.project(between, near=2.5) == (pytest.approx(3.0), pytest.approx(0.6))
    assert THERE_AND_BACK.project(between, near=8.0)[0] == pytest.approx(8.0 - REACH)
