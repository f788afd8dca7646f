"""Errors of poses beside places, counted by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import PoseBeside
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.pose_error import pose_errors
from tests.support import certain

PLACES = [View(0.0, truth=Pose(float(k), 0.0, math.pi / 2)) for k in range(4)]


def compared(*answers: tuple[Pose, int, PoseBeside | None]) -> Comparison:
    views = [View(float(k), truth=true) for k, (true, _, _) in enumerate(answers)]
    beliefs = [replace(certain(4, place), pose=pose) for _, place, pose in answers]
    return Comparison("x", PLACES, {}, views, {}, {"mine": beliefs})


def test_errors_are_in_the_frame_of_the_place() -> None:
    """A place that looks along y: what lies in x beside it lies to its right."""
    pose = PoseBeside(0.3, -0.1, 0.0, np.diag([0.01, 0.01, 0.01]))
    found = pose_errors(compared((Pose(1.2, 0.4, math.pi / 2 + 0.2), 1, pose)), "mine")
    assert found is not None
    assert (found.views, found.told) == (1, 1)
    assert found.places == pytest.approx((0.4, 0.2, 0.2))
    assert found.poses == pytest.approx((0.1, 0.1, 0.2))
    assert found.squares == pytest.approx((1 + 1 + 4) / 3)
    assert found.record["poses"] == [0.1, 0.1, 0.2]
    assert "at 1 of 1 views, median error along 0.100 m (the place itself 0.400)" in str(found)


@pytest.mark.parametrize("turns", [-1, 1, 2])
def test_a_heading_is_off_by_less_than_half_a_turn(turns: int) -> None:
    pose = PoseBeside(0.0, 0.0, 0.2 + 2 * math.pi * turns, np.eye(3))
    found = pose_errors(compared((Pose(1.0, 0.0, math.pi / 2 + 0.2), 1, pose)), "mine")
    assert found is not None
    assert found.poses == pytest.approx((0.0, 0.0, 0.0))


def test_only_right_places_count() -> None:
    pose = PoseBeside(0.0, 0.0, 0.0, np.eye(3))
    north = math.pi / 2
    wrong = compared(
        (Pose(0.0, 1.6, north), 0, pose), (Pose(0.0, 0.0, -north), 0, pose), (Pose(0.0, 0.0, north), 0, None)
    )
    assert pose_errors(wrong, "mine") is None
