import pytest

from refseq.logs.recording import TimedData, views_of
from refseq.planar import Pose


def test_a_moment_without_odometry_loses_no_motion() -> None:
    poses = [Pose(0.0, 0.0, 0.0), None, Pose(2.0, 0.0, 0.0), Pose(3.0, 0.0, 0.5)]
    views = list(views_of(TimedData(float(t), odometry=pose) for t, pose in enumerate(poses)))
    assert [view.distance for view in views] == pytest.approx([0.0, 0.0, 2.0, 1.0])
    assert [view.turn for view in views] == pytest.approx([0.0, 0.0, 0.0, 0.5])
