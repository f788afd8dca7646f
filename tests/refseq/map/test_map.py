"""Poses of beliefs in the frame of a map."""

import copy
import math
import pickle
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from refseq.dead_reckoning import dead_reckoned
from refseq.errors import MapError
from refseq.map.learning import learn
from refseq.map.map import Map, MapFrame, beside
from refseq.planar import Pose, motion_between
from refseq.view import View
from tests.support import certain, corridor_drive


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=6, size=96)


def without_truth(views: Sequence[View]) -> list[View]:
    return [replace(view, truth=None) for view in views]


def learnt(views: Sequence[View], name: str = "") -> Map:
    return learn(views, sensors=["laser"], features=["sectors"], name=name)


def test_a_belief_stands_at_its_best_place(views: list[View]) -> None:
    map_ = learnt(views)
    assert map_.frame is MapFrame.TRUTH
    assert map_.pose(certain(6, 4)) == views[4].truth
    assert map_.pose(certain(6, 4, lost=0.6)) is None
    assert map_.pose(certain(6, 4, lost=0.6), lost_above=0.7) == views[4].truth


def test_a_place_without_truth_has_no_pose_beside_others_that_have(views: list[View]) -> None:
    gappy = [replace(view, truth=None) if k == 4 else view for k, view in enumerate(views)]
    assert learnt(gappy).pose(certain(6, 4)) is None
    assert learnt(gappy).pose(certain(6, 3)) == views[3].truth


def test_without_truth_the_frame_is_the_odometrys() -> None:
    circle = [Pose(math.sin(k / 5), 1 - math.cos(k / 5), k / 5) for k in range(8)]
    motions = [(0.0, 0.0), *(motion_between(*pair) for pair in pairwise(circle))]
    views = corridor_drive(np.random.default_rng(1), count=8, size=96)
    driven = [
        replace(view, distance=distance, turn=turn)
        for view, (distance, turn) in zip(without_truth(views), motions, strict=True)
    ]
    map_ = learnt(driven)
    assert map_.frame is MapFrame.ODOMETRY
    for k, pose in enumerate(circle):
        found = map_.pose(certain(8, k))
        assert found is not None
        assert (found.x, found.y, found.heading) == pytest.approx((pose.x, pose.y, pose.heading))


def test_drives_without_truth_have_no_frame_in_common(views: list[View]) -> None:
    both = beside([learnt(without_truth(views), name) for name in ("east", "west")])
    assert both.frame is MapFrame.NONE
    assert both.pose(certain(12, 3)) is None


def test_a_drive_without_odometry_has_no_poses(views: list[View]) -> None:
    still = [replace(view, distance=0.0) for view in without_truth(views)]
    assert dead_reckoned(still).shape == (0, 3)
    moved = learnt(without_truth(views))
    map_ = Map.of(replace(moved.sequence, odometry=dead_reckoned(still)))
    assert map_.frame is MapFrame.NONE
    assert map_.pose(certain(6, 3)) is None


def test_a_map_goes_to_another_process_and_is_its_own_copy(views: list[View]) -> None:
    """As the content of its file: programs that work in several processes hand maps on."""
    map_ = learnt(views, name="west")
    again = pickle.loads(pickle.dumps(map_))
    assert (again.to_bytes(), again.names) == (map_.to_bytes(), ("west",))
    assert copy.deepcopy(map_) is map_
    with pytest.raises(MapError, match=r"^9 bytes: is not a \.refseq map, or is damaged"):
        Map.from_bytes(b"no map at")


def test_headings_are_within_half_a_turn_however_often_the_robot_turned() -> None:
    turned = [
        replace(view, turn=math.pi / 2 if k % 4 == 3 else 0.0)
        for k, view in enumerate(without_truth(corridor_drive(np.random.default_rng(1), count=24, size=96)))
    ]
    headings = [pose.heading for pose in learnt(turned).places_in_frame if pose]
    assert max(map(abs, headings)) <= math.pi
    assert headings[-1] == pytest.approx(math.pi)  # after six quarter turns


def test_maps_are_equal_whose_files_are(views: list[View]) -> None:
    map_ = learnt(views)
    assert map_ == Map.from_bytes(map_.to_bytes())
    assert map_ != learnt(views[:5])
    assert map_ != "map"
