"""Scans laid on each other, in corridors of known geometry."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq.atlas.scans import ScannedPath, laid_on, longest_rising, scale_between, windows
from refseq.planar import Pose
from refseq.pose_graph import motions_between, moved
from refseq.scan_matching.panorama import panorama
from refseq.view import Scan
from tests.refseq.rooms import Wall, cast, rectangle

CORRIDOR: list[Wall] = [*rectangle(0, -1.2, 40, 1.2), (11, 1.2, 11, 0.7), (11.8, 1.2, 11.8, 0.7), (24, -1.2, 24, -0.6)]
"""Walls 40 m long; a doorway and a pillar tell its one way from the other."""
BARE: list[Wall] = rectangle(0, -1.2, 40, 1.2)
PAIRS = np.column_stack([np.arange(12), np.arange(12)])


def driven(walls: list[Wall], start: float, step: float = 1.0, aside: float = 0.0, turned: float = 0.0) -> ScannedPath:
    """Twelve views along a corridor, and their odometry from the first on."""
    poses = np.array([(start + step * n, aside, turned + (np.pi if step < 0 else 0.0)) for n in range(12)])
    scans = np.stack([panorama(cast(walls, Pose(*pose))) for pose in poses.tolist()])
    path = ScannedPath.of(motions_between(poses[0], poses), scans)
    assert path is not None
    return path


def test_a_panorama_has_a_range_a_degree_and_zeros_where_nothing_came_back() -> None:
    ranges = np.full(361, 2.345, np.float32)
    ranges[180:200] = np.inf
    kept = panorama(Scan(ranges))
    assert kept[90] == kept[270] == 234 or kept[90] == 235
    assert kept[0] == kept[9] == kept[180] == 0  # ahead nothing came back, behind nothing is looked at
    assert np.count_nonzero(kept) == 171


def test_the_relative_pose_is_the_one_between_the_drives() -> None:
    one, other = driven(CORRIDOR, 8.0), driven(CORRIDOR, 8.3, aside=0.25, turned=0.1)
    for window in windows(one, other, PAIRS):
        assert window.share > 0.99
        assert window.motion[1:] == pytest.approx([0.25, 0.1], abs=0.1)
        assert window.motion[0] == pytest.approx(0.3, abs=0.3)  # walls along the way hardly tell


@pytest.mark.parametrize("slide", [-2, -1, 1, 2])
def test_an_alignment_that_slid_is_put_right(slide: int) -> None:
    path = driven(CORRIDOR, 8.0)
    pairs = PAIRS[2:-2] + np.array([0, slide])
    laid = laid_on(path, path, pairs, 0.87, 0.98)
    assert laid.share > 0.99
    assert len(laid.pairs) >= 6
    assert (laid.pairs[:, 0] == laid.pairs[:, 1]).all()


def test_a_drive_that_comes_back_over_its_own_way_lies_on_itself_view_by_view() -> None:
    """Views of the way there and of the way back are at the same spots, and look another way."""
    there = np.column_stack([8.0 + np.arange(8), np.zeros(8), np.zeros(8)])
    back = np.column_stack([15.0 - np.arange(8), np.full(8, 0.02), np.full(8, np.pi)])
    poses = np.concatenate([there, back])
    scans = np.stack([panorama(cast(CORRIDOR, Pose(*pose))) for pose in poses.tolist()])
    path = ScannedPath.of(motions_between(poses[0], poses), scans)
    assert path is not None
    every = np.column_stack([np.arange(16), np.arange(16)])
    assert laid_on(path, path, every, 0.87, 0.98).pairs.tolist() == every.tolist()


@pytest.mark.parametrize("parting", [6, 15])
def test_what_looks_alike_behind_a_fork_is_left_out(parting: int) -> None:
    """Both see the same walls all along, but the odometry of one has turned off: the longer part holds."""
    ahead = np.column_stack([np.arange(22.0), np.zeros((22, 2))])
    scans = np.stack([panorama(cast(CORRIDOR, Pose(8.0 + x, 0.0, 0.0))) for x in range(22)])
    there = np.array([float(parting), 0.0, np.pi / 2])
    turned = np.concatenate([ahead[:parting], moved(there, ahead[: 22 - parting])])
    one, other = (ScannedPath.of(track, scans) for track in (ahead, turned))
    assert one is not None
    assert other is not None
    every = np.column_stack([np.arange(22)] * 2)
    held = laid_on(one, other, every, 0.87, 0.98).pairs
    part = every[:parting] if parting > 11 else every[parting:]
    assert set(map(tuple, held.tolist())) <= set(map(tuple, part.tolist()))
    assert len(held) == len(part)  # of the window that the fork is in as well
    assert laid_on(one, one, every, 0.87, 0.98).pairs.tolist() == every.tolist()


@pytest.mark.parametrize("shared", [slice(0, 9), slice(0, 13), slice(0, 16), slice(9, 22), slice(5, 22)])
def test_a_stretch_ends_to_the_view_where_walls_part(shared: slice) -> None:
    """Words pair views for metres beyond the fork, where one path is in a corridor and the other in a hall."""
    every = np.arange(22)
    poses = np.column_stack([every, np.zeros((22, 2))])
    hall = rectangle(0, -4.0, 60, 5.0)
    one, other = (
        ScannedPath.of(
            poses,
            np.stack(
                [panorama(cast(CORRIDOR if x in every[shared] else walls, Pose(8.0 + x, 0.0, 0.0))) for x in range(22)]
            ),
        )
        for walls in (CORRIDOR, hall)
    )
    assert one is not None
    assert other is not None
    pairs = np.column_stack([every, every])
    assert laid_on(one, other, pairs, 0.87, 0.98).pairs.tolist() == pairs[shared].tolist()


@given(st.lists(st.integers(0, 9), max_size=8))
def test_the_longest_rising_part_is_the_longest_of_all_parts(numbers: list[int]) -> None:
    kept = longest_rising(np.array(numbers, np.intp)).tolist()
    picked = [numbers[i] for i in kept]
    assert kept == sorted(kept)
    assert all(a < b for a, b in pairwise(picked))
    rising = (
        size
        for size in range(len(numbers), -1, -1)
        for part in combinations(numbers, size)
        if all(a < b for a, b in pairwise(part))
    )
    assert len(kept) == next(rising)


def test_an_odometer_of_another_scale_lays_scans_as_well() -> None:
    one, other = driven(CORRIDOR, 8.0), driven(CORRIDOR, 8.0).scaled(1.2)
    assert laid_on(one, other, PAIRS, 0.87, 0.98).share < laid_on(one, other.scaled(1 / 1.2), PAIRS, 0.87, 0.98).share
    assert laid_on(one, other.scaled(1 / 1.2), PAIRS, 0.87, 0.98).share > 0.999


def test_a_scale_is_told_by_long_stretches_and_within_reason() -> None:
    assert scale_between(22.0, 24.2) == pytest.approx(1 / 1.1)
    assert scale_between(24.2, 22.0) == pytest.approx(1.1)
    for lengths in ((22.0, 22.8), (10.0, 11.0), (22.0, 44.0), (0.0, 0.0)):
        assert scale_between(*lengths) is None


def test_a_way_back_does_not_lie_on_the_way_there() -> None:
    there, back = driven(CORRIDOR, 8.0), driven(CORRIDOR, 32.0, step=-1.0)
    shares = [window.share for window in windows(there, back, PAIRS)]
    assert np.mean(shares) < 0.98 < 0.999 < min(window.share for window in windows(there, there, PAIRS))


def test_a_bare_corridor_is_its_own_way_back_for_a_laser() -> None:
    """The scans of it cannot tell: joins that agree have to."""
    there, back = driven(BARE, 8.0), driven(BARE, 32.0, step=-1.0)
    assert min(window.share for window in windows(there, back, PAIRS)) > 0.99


def test_shares_are_those_counted_beam_by_beam() -> None:
    """Two scans from one spot: a beam meets the same wall, or one of the scans sees through the other's."""
    one, other = _constant(2.0), _constant(2.0)
    other.ranges[:, :90] = 3.0  # of each scan a quarter ends elsewhere: the farther one sees through the nearer
    (window,) = windows(one, other, np.array([[0, 0]]))
    assert window.share == pytest.approx(0.857, abs=0.03)  # 540 met, 90 seen through


def _constant(ranges: float) -> ScannedPath:
    track: NDArray[np.float64] = np.zeros((2, 3))
    track[1, 0] = 1.0
    return ScannedPath(track, np.full((2, 360), ranges))


def test_a_path_without_scans_or_odometry_is_none() -> None:
    assert ScannedPath.of(np.zeros((0, 3)), np.zeros((4, 360), np.uint16)) is None
    assert ScannedPath.of(np.zeros((4, 3)), np.zeros((0, 360), np.uint16)) is None
