"""Our files, read by evo."""

import math
from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from numpy.testing import assert_allclose

from refseq.errors import LogError
from refseq.logs.trajectories import write_trajectory
from refseq.planar import Pose

WAY = [(1_700_000_000.5 + k / 3, Pose(0.3 * k, -0.1 * k, 7 * k / 9)) for k in range(40)]


def assert_read(poses: list[np.ndarray]) -> None:
    for matrix, (_, pose) in zip(poses, WAY, strict=True):
        assert_allclose(matrix[:3, 3], [pose.x, pose.y, 0], atol=1e-8)
        assert_allclose(matrix[:3, 0], [math.cos(pose.heading), math.sin(pose.heading), 0], atol=1e-8)
        assert_allclose(matrix[:3, 2], [0, 0, 1], atol=1e-8)


def test_evo_reads_tum(tmp_path: Path) -> None:
    write_trajectory(tmp_path / "a.tum", WAY, "tum")
    found = file_interface.read_tum_trajectory_file(tmp_path / "a.tum")
    assert found.check()[0]
    assert_allclose(found.timestamps, [time for time, _ in WAY], atol=1e-6)
    assert_read(found.poses_se3)


def test_evo_reads_kitti(tmp_path: Path) -> None:
    write_trajectory(tmp_path / "a.txt", WAY, "kitti")
    found = file_interface.read_kitti_poses_file(tmp_path / "a.txt")
    assert found.check()[0]
    assert_read(found.poses_se3)


def test_nothing_is_left_behind_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"a.tum: there is no pose to write; valid is at least one"):
        write_trajectory(tmp_path / "a.tum", [], "tum")
    with pytest.raises(LogError, match=r"a.tum: format 'euroc' is not written; valid are tum, kitti, csv"):
        write_trajectory(tmp_path / "a.tum", WAY, "euroc")
    with pytest.raises(LogError, match="cannot be written: No such file"):
        write_trajectory(tmp_path / "none" / "a.tum", WAY, "tum")
    assert not list(tmp_path.iterdir())
