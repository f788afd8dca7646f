"""Data of each moment: how far the odometer's first and last poses reach, and which behaviour was told."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.schedule import Schedule, schedule
from refseq.logs.pairing.sensors import Choice, PoseTrack
from refseq.logs.pairing.survey import Survey, TopicStamps
from refseq.logs.source import Channel, Role
from refseq.logs.trajectory import Trajectory
from refseq.planar import Pose


def scheduled(
    camera: list[float], poses: list[float], told: dict[float, str] | None = None, tolerance: float | None = None
) -> Schedule:
    """The schedule of a log by the times of its pictures and of its odometer's poses, which go 1 m/s along x [s]."""
    source: Any = SimpleNamespace(path=Path("log"), has_moments=False)
    times = {Role.CAMERA: camera, Role.BEHAVIOUR: list(told or {})}
    stamps = {str(role): TopicStamps(Channel(role, "", "", len(some), role), some) for role, some in times.items()}
    odometer = PoseTrack("poses", Trajectory.of(poses, [Pose(time, 0.0, 0.0) for time in poses]))
    choice = Choice({str(Role.CAMERA): "camera"}, odometer, None, "", ())
    found = Survey(source, stamps, behaviours=list((told or {}).values()))
    return schedule(found, choice, PairingOptions(tolerance=tolerance))


@pytest.mark.parametrize(
    ("last", "period", "tolerance", "reached"),
    [
        (0.3, 0.5, 0.0, True),  # less than a period behind the last pose
        (0.6, 0.5, 0.0, False),
        (0.4, 2.0, None, True),
        (1.5, 2.0, None, False),  # of slow poses too the last stands for half a second only
        (0.3, 0.1, 0.4, True),  # the tolerance
        (0.3, 0.1, 0.2, False),
    ],
)
def test_the_last_pose_stands_for_a_period_or_the_tolerance_and_half_a_second_at_most(
    last: float, period: float, tolerance: float | None, reached: bool
) -> None:
    poses = [4.0 - 2 * period, 4.0 - period, 4.0]
    found = scheduled([4.0 - period, 4.0, 4.0 + last], poses, tolerance=tolerance)
    assert found.without_odometry == (not reached)
    assert [one.odometry for one in found.data[:2]] == [Pose(4.0 - period, 0, 0), Pose(4.0, 0, 0)]
    assert [one.odometry for one in found.data[2:]] == [Pose(4.0, 0, 0)] * reached


def test_a_behaviour_is_that_of_the_moment_at_its_own_time_or_of_the_next() -> None:
    found = scheduled([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 2.0, 3.0], {1.0: "follow", 1.5: "turn", 9.0: "too late"})
    assert [one.behaviour for one in found.data] == ["", "follow", "turn", ""]
