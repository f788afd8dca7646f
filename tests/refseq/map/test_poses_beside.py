"""Poses beside places: by the scan where there is one, none where nothing tells."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Stage, belief_from, pose_beside
from refseq.errors import RefseqError
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise
from refseq.map.map import Map
from refseq.map.poses_beside import ARM, KEPT, PosesBeside
from refseq.planar import Pose
from refseq.view import LASER, View
from tests.refseq.rooms import Wall, cast, rectangle

WALLS: list[Wall] = [
    *rectangle(0, -1.2, 30, 1.2),
    *((x, y, x, 0.7 * y) for x, y in ((4, 1.2), (6.5, -1.2), (11, 1.2), (12, -1.2), (19, -1.2), (21, 1.2), (26, 1.2))),
]
"""A corridor with pillars at no two equal distances."""


def drive(poses: Sequence[Pose]) -> list[View]:
    steps = [0.0, *np.hypot(np.diff([p.x for p in poses]), np.diff([p.y for p in poses])).tolist()]
    return [View(float(k), scan=cast(WALLS, pose), distance=steps[k], truth=pose) for k, pose in enumerate(poses)]


@pytest.fixture(scope="module")
def map_() -> Map:
    return learn(drive([Pose(1.0 + 0.85 * k, 0.0, 0.0) for k in range(28)]), profile="best")


LATER = [Pose(1.3 + 0.85 * k, 0.2, 0.15) for k in range(20)]


def test_the_pose_is_where_the_robot_is(map_: Map) -> None:
    poses = PosesBeside(map_)
    for number, view in enumerate(drive(LATER)):
        poses.take(view.scan)
        for near in (number, number + 1):  # both are within reach
            belief = poses.with_pose(belief_from(np.eye(28)[near]))
            place, true, stands = map_.poses[near], view.truth, map_.pose(belief)
            assert belief.pose is not None
            assert place is not None
            assert true is not None
            assert stands is not None
            assert belief.pose.motion == pytest.approx([true.x - place.x, 0.2, 0.15], abs=0.03)
            assert (stands.x, stands.y, stands.heading) == pytest.approx((true.x, true.y, true.heading), abs=0.03)


def test_each_way_of_localising_tells_the_same(map_: Map) -> None:
    views = drive([Pose(1.2 + 0.85 * k, 0.05, 0.0) for k in range(6)])
    localiser, told = Localiser(map_), 0
    for view, belief in zip(views, localise(map_, views)[Stage.CHAIN], strict=True):
        alone = localiser.update(view)
        assert (alone.pose is None) == (belief.pose is None)
        told += alone.pose is not None
        if alone.pose is not None and belief.pose is not None:
            assert alone.pose.motion == belief.pose.motion
            assert np.array_equal(alone.pose.covariance, belief.pose.covariance)
    assert told >= 4


def test_nothing_is_told_where_nothing_tells(map_: Map) -> None:
    scan = cast(WALLS, LATER[3])
    poses, at_four = PosesBeside(map_), belief_from(np.eye(28)[4])
    assert poses.with_pose(at_four).pose is None  # no view yet
    poses.take(scan)
    assert poses.with_pose(at_four).pose is not None
    assert poses.with_pose(replace(at_four, lost=0.6)).pose is None
    poses.take(cast(rectangle(-8, -9, 8, 9), Pose(0.0, 0.0, 0.0)))  # a hall: other walls
    assert poses.with_pose(at_four).pose is None
    poses.take(None)
    assert poses.with_pose(at_four).pose is None
    bare = PosesBeside(replace(map_, paths=(replace(map_.paths[0], scans=np.zeros((0, 360), np.uint16)),)))
    bare.take(scan)
    assert bare.with_pose(at_four).pose is None  # maps of before keep no scans


def test_what_the_mount_leaves_open_is_in_the_covariance(map_: Map) -> None:
    poses = PosesBeside(map_)
    poses.take(cast(WALLS, Pose(1.0 + 0.85 * 4, 0.0, 0.4)))
    pose = poses.with_pose(belief_from(np.eye(28)[4])).pose
    assert pose is not None
    sigmas = np.sqrt(np.diag(pose.covariance))
    assert (sigmas >= KEPT).all()
    assert sigmas[1] == pytest.approx(ARM * np.sin(0.4), rel=0.1)  # a laser ahead of the middle swings aside


def test_a_sensor_that_is_not_asked_for_tells_no_pose() -> None:
    grey = {"camera-1": np.random.default_rng(0).integers(0, 255, (120, 160), dtype=np.uint8)}
    views = [replace(view, images=grey) for view in drive([Pose(1.0 + 0.85 * k, 0.0, 0.0) for k in range(10)])]
    learnt = learn(views, profile="thesis")
    with_laser, without = (
        localise(learnt, views[:3], sensors=sensors, stages=[Stage.UNIFORM])[Stage.UNIFORM]
        for sensors in ([LASER], ["camera-1"])
    )
    assert any(belief.pose for belief in with_laser)
    assert not any(belief.pose for belief in without)


@pytest.mark.parametrize("covariance", [np.eye(2), np.full((3, 3), np.nan), -np.eye(3), np.triu(np.ones((3, 3)))])
def test_what_is_no_covariance_is_refused(covariance: np.ndarray) -> None:
    with pytest.raises(RefseqError, match="valid"):
        pose_beside((0.0, 0.0, 0.0), covariance)
