"""MCAP files of others: which of their channels are read, and what is told of those that are not."""

from pathlib import Path
from typing import cast

import foxglove
import pytest
from foxglove import channels, messages

from refseq.errors import LogError
from refseq.logs import open_log, plan_views
from refseq.logs.source import EMPTY, Role
from refseq.logs.transforms import Transform
from refseq.planar import Pose
from tests.refseq.logs.foxglove_drive import ns, pose_message


def write_two_schemas(path: Path, odometry: int, truth: int) -> Path:
    """A topic with so many messages of either schema, and a laser beside it."""
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), context=context):
        both = {
            messages.Odometry: channels.OdometryChannel("/pose", context=context),
            messages.PoseInFrame: channels.PoseInFrameChannel("/pose", context=context),
        }
        laser = channels.LaserScanChannel("/scan", context=context)
        for kind, count in ((messages.Odometry, odometry), (messages.PoseInFrame, truth)):
            for tick in range(count):
                both[kind].log(kind(pose=pose_message(Pose(float(tick), 0.0, 0.0))), log_time=ns(tick / 10))
        laser.log(messages.LaserScan(start_angle=-1, end_angle=1, ranges=[1.0, 2.0, 3.0]), log_time=ns(0.5))
    return path


@pytest.mark.parametrize(
    ("odometry", "truth", "role", "skipped"),
    [(9, 3, Role.ODOMETRY, "foxglove.PoseInFrame"), (3, 9, Role.TRUTH, "foxglove.Odometry")],
)
def test_of_two_schemas_on_a_topic_the_one_with_more_messages_is_read(
    tmp_path: Path, odometry: int, truth: int, role: Role, skipped: str
) -> None:
    source = open_log(write_two_schemas(tmp_path / "two.mcap", odometry, truth))
    roles = {one.schema: one.role for one in source.channels if one.topic == "/pose"}
    assert roles == {skipped: Role.IGNORED, **{one: role for one in roles if one != skipped}}
    assert [sample.topic for sample in source.samples(["/pose"])] == ["/pose"] * 9
    assert source.skipped == {skipped: 3}


def write_transforms(path: Path, transforms: list[messages.FrameTransform]) -> Path:
    """One message of all of them."""
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), context=context):
        channel = channels.FrameTransformsChannel("/tf", context=context)
        channel.log(messages.FrameTransforms(transforms=transforms), log_time=ns(9.0))
    return path


@pytest.mark.parametrize(("stamps", "time"), [((3, 5, 4), 5.0), ((None, 3, None), 3.0), ((None, None), 9.0)])
def test_transforms_in_one_message_are_as_of_the_newest_that_has_a_stamp(
    tmp_path: Path, stamps: tuple[int | None, ...], time: float
) -> None:
    transforms = [
        messages.FrameTransform(
            timestamp=None if stamp is None else messages.Timestamp(sec=stamp, nsec=0),
            parent_frame_id="odom",
            child_frame_id=f"part-{number}",
        )
        for number, stamp in enumerate(stamps)
    ]
    (sample,) = open_log(write_transforms(tmp_path / "tf.mcap", transforms)).samples()
    assert (sample.time, sample.unstamped) == (time, not any(stamps))
    assert [one.child for one in cast("tuple[Transform, ...]", sample.content)] == [
        f"part-{n}" for n in range(len(stamps))
    ]


def test_a_message_without_transforms_tells_nothing_and_is_no_clock_at_zero(tmp_path: Path) -> None:
    source = open_log(write_transforms(tmp_path / "tf.mcap", []))
    assert list(source.samples()) == []
    assert source.skipped == {f"foxglove.FrameTransforms{EMPTY}": 1}


def test_empty_messages_of_two_writers_to_one_topic_are_counted_once_each(tmp_path: Path) -> None:
    context = foxglove.Context()
    with foxglove.open_mcap(str(tmp_path / "two.mcap"), context=context):
        for number, node in enumerate("ab"):
            channel = channels.FrameTransformsChannel("/tf", metadata={"node": node}, context=context)
            channel.log(messages.FrameTransforms(transforms=[]), log_time=ns(9.0 + number))
    source = open_log(tmp_path / "two.mcap")
    assert [one.topic for one in source.channels] == ["/tf", "/tf"]
    assert list(source.samples()) == []
    assert source.skipped == {f"foxglove.FrameTransforms{EMPTY}": 2}


def test_transforms_without_end_in_one_message_are_damage(tmp_path: Path) -> None:
    again = messages.FrameTransform(parent_frame_id="odom", child_frame_id="base_link")
    source = open_log(write_transforms(tmp_path / "tf.mcap", [again] * 4097))
    assert list(source.samples()) == []
    with pytest.raises(
        LogError, match=r"topic /tf: .*only one: a message has 4097 coordinate frames in a log; valid are at most 4096"
    ):
        plan_views(source)


@pytest.mark.parametrize("angle", [0.0, -1.5])
def test_a_scan_whose_angles_are_left_out_is_told_so(tmp_path: Path, angle: float) -> None:
    context = foxglove.Context()
    with foxglove.open_mcap(str(tmp_path / "a.mcap"), context=context):
        laser = channels.LaserScanChannel("/scan", context=context)
        laser.log(messages.LaserScan(start_angle=angle, end_angle=angle, ranges=[1.0] * 181), log_time=ns(0.5))
    told = f"its start_angle and its end_angle are {angle:g}; valid are the bearings of the first beam"
    with pytest.raises(LogError, match=told):
        plan_views(open_log(tmp_path / "a.mcap"))
