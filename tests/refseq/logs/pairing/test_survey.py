"""Logs whose clocks, topics or ends are not as they should be."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import foxglove
import numpy as np
import pytest
from foxglove import channels, messages

from refseq.errors import LogError
from refseq.logs import open_log, plan_views, read_recording
from refseq.planar import Pose, motion_between
from tests.refseq.logs.foxglove_drive import TOPICS, ns, pose_message, transforms_message, write_foxglove
from tests.refseq.logs.robot_drive import Moment, RobotDrive, Sense

DRIVE = RobotDrive(seconds=6.0)


def write_retimed(path: Path, stamp_back: float, log_back: float, *, tf: bool = False) -> Path:
    """After 3 s the stamps and the log's clock are set back by so much [s]; there is odometry and a laser.

    With ``tf`` transforms alone tell where the odometer is.
    """
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context):
        odometry = channels.OdometryChannel("/odom", context=context)
        transforms = channels.FrameTransformsChannel("/tf", context=context)
        laser = channels.LaserScanChannel("/scan", context=context)
        for moment in DRIVE.moments:
            late = moment.time - DRIVE.start > 3.0
            nanoseconds = ns(moment.time - late * stamp_back)
            logged = ns(moment.logged - late * log_back)
            stamp = messages.Timestamp(sec=nanoseconds // 10**9, nsec=nanoseconds % 10**9)
            if moment.sense is Sense.ODOMETRY and tf:
                moved = transforms_message(stamp, "odom", "base_link", DRIVE.odometry(moment.time))
                transforms.log(moved, log_time=logged)
            elif moment.sense is Sense.ODOMETRY:
                pose = pose_message(DRIVE.odometry(moment.time))
                odometry.log(messages.Odometry(timestamp=stamp, body_frame_id="base_link", pose=pose), log_time=logged)
            if moment.sense is Sense.SCAN:
                ranges = [float(index) for index in range(1, 20)]
                message = messages.LaserScan(timestamp=stamp, start_angle=-1, end_angle=1, ranges=ranges)
                laser.log(message, log_time=logged)
    return path


@pytest.mark.parametrize(
    ("stamps", "log", "tf", "told"),
    [
        (2.5, 0.0, False, "the stamps of /odom jump back by 2."),
        (2.5, 0.0, True, "the stamps of /scan jump back by 2."),
        (2.5, 2.5, False, "the log's clock jumps back by 2."),
        (500.0, 500.0, False, "the log's clock jumps back by 49"),
    ],
)
def test_a_clock_that_is_set_back_is_told_and_the_way_stays_whole(
    tmp_path: Path, stamps: float, log: float, tf: bool, told: str
) -> None:
    recording = read_recording(write_retimed(tmp_path / "back.mcap", stamps, log, tf=tf))
    assert recording.findings
    assert any(note.startswith(told) for note in recording.findings.notes)
    assert len(recording.views) == pytest.approx(60, abs=2)
    assert all(before.time < view.time for before, view in pairwise(recording.views))
    length = sum(view.distance for view in recording.views)
    assert length == pytest.approx(0.8 * 5.9, abs=0.2)
    assert all(0 < view.distance < 0.2 for view in recording.views[1:])


def test_behind_a_clock_that_was_set_back_no_time_comes_twice(tmp_path: Path) -> None:
    """The first message behind it may be one of a topic that comes once a second, long after the last of its own."""
    context = foxglove.Context()
    path = tmp_path / "back.mcap"
    with foxglove.open_mcap(str(path), context=context):
        laser = channels.LaserScanChannel("/scan", context=context)
        odometry = channels.OdometryChannel("/odom", context=context)
        for tick in range(80):
            logged = ns(100.0 + tick / 10 - 4.0 * (tick >= 39))
            if tick % 10 == 9:
                scan = messages.LaserScan(start_angle=-1, end_angle=1, ranges=[1.0, 2.0, 3.0])
                laser.log(scan, log_time=logged)
            if tick != 39:
                odometry.log(messages.Odometry(pose=pose_message(Pose(0.1 * tick, 0.0, 0.0))), log_time=logged)
    findings = read_recording(path).findings
    assert findings
    assert [note[:34] for note in findings.notes] == ["the log's clock jumps back by 3.90"]
    assert {topic: one.backward for topic, one in findings.channels.items()} == {"/odom": 0, "/scan": 0}


def test_messages_that_overtake_each_other_are_counted(tmp_path: Path) -> None:
    drive = replace(DRIVE, jitter=0.04, latency=0.2)
    recording = read_recording(write_foxglove(tmp_path / "jitter.mcap", drive))
    assert recording.findings
    assert recording.findings.channels["/odom"].backward > 5
    assert not recording.findings.notes
    for before, view in pairwise(recording.views):
        assert before.time < view.time
        expected = motion_between(drive.odometry(before.time), drive.odometry(view.time))
        assert view.distance == pytest.approx(expected[0], abs=5e-3)


def test_rates_gaps_and_delays_of_a_channel_are_those_of_its_messages(tmp_path: Path) -> None:
    drive = replace(DRIVE, gap=(2.0, 3.5), latency=0.3)
    findings = read_recording(write_foxglove(tmp_path / "drive.mcap", drive)).findings
    assert findings
    for sense in (Sense.PICTURE, Sense.SCAN, Sense.ODOMETRY, Sense.TRUTH):
        there = [moment for moment in drive.moments if moment.sense is sense]
        times = np.sort([moment.time for moment in there])
        longest = int(np.diff(times).argmax())
        found = findings.channels[TOPICS[sense]]
        assert found.channel.count == len(there)
        assert (found.first, found.last) == pytest.approx((times[0], times[-1]), abs=1e-6)
        assert found.rate == pytest.approx(1 / np.median(np.diff(times)), rel=1e-3)
        assert found.longest_gap == pytest.approx(times[longest + 1] - times[longest], abs=1e-6)
        assert found.gap_at == pytest.approx(times[longest], abs=1e-6)
        assert found.offset == pytest.approx(np.median([moment.logged - moment.time for moment in there]), abs=1e-6)
        assert found.offset > 0.05


def write_twice(path: Path, kind: str) -> Path:
    """Two odometers, or two lasers, of which the second one comes half as often."""
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context):
        odometry = [channels.OdometryChannel(f"/odom{k}", context=context) for k in range(1 + (kind == "odometry"))]
        lasers = [channels.LaserScanChannel(topic, context=context) for topic in ("/rear", "/front_laser")]
        for tick in range(40):
            stamp = messages.Timestamp(sec=100 + tick // 10, nsec=tick % 10 * 10**8)
            for k, channel in enumerate(odometry):
                if tick % (k + 1) == 0:
                    pose = pose_message(Pose((0.1 + k) * tick, 0.0, 0.0))
                    channel.log(messages.Odometry(timestamp=stamp, pose=pose), log_time=ns(100 + tick / 10))
            for k, laser in enumerate(lasers[: 1 + (kind == "lasers")]):
                if tick % (k + 1) == 0:
                    scan = messages.LaserScan(timestamp=stamp, start_angle=0, end_angle=1, ranges=[1.0 + k] * 3)
                    laser.log(scan, log_time=ns(100 + tick / 10))
    return path


def test_of_two_odometers_the_one_asked_for_or_the_more_frequent_is_taken_and_told(tmp_path: Path) -> None:
    path = write_twice(tmp_path / "two.mcap", "odometry")
    recording = read_recording(path)
    assert recording.findings
    assert recording.findings.notes == ("odometry /odom0 is taken; /odom1 is not",)
    assert recording.views[1].distance == pytest.approx(0.1)
    assert read_recording(path, odometry="/odom1").views[1].distance == pytest.approx(1.1)


def test_of_two_lasers_the_front_one_is_taken_and_told(tmp_path: Path) -> None:
    recording = read_recording(write_twice(tmp_path / "two.mcap", "lasers"))
    assert recording.findings
    assert recording.findings.notes == ("laser /front_laser is taken; /rear is not",)
    assert {float(view.scan.ranges[0]) for view in recording.views if view.scan} == {2.0}


def test_a_log_of_one_topic_says_what_it_holds(tmp_path: Path) -> None:
    context = foxglove.Context()
    path = tmp_path / "one.mcap"
    with foxglove.open_mcap(str(path), context=context):
        odometry = channels.OdometryChannel("/odom", context=context)
        for tick in range(3):
            odometry.log(messages.Odometry(pose=pose_message(Pose(0, 0, 0))), log_time=tick)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == (
        f"{path}: holds no view: its topics are /odom (3 foxglove.Odometry); valid is at least one camera or laser"
    )


def test_an_empty_log_says_so(tmp_path: Path) -> None:
    path = tmp_path / "empty.mcap"
    with foxglove.open_mcap(str(path), context=foxglove.Context()):
        pass
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == f"{path}: holds no view: it has no topic; valid is at least one camera or laser"


def test_a_log_that_was_cut_off_gives_the_views_up_to_there(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "whole.mcap", DRIVE)
    cut = tmp_path / "cut.mcap"
    content = path.read_bytes()
    cut.write_bytes(content[: len(content) * 2 // 3])
    plan = plan_views(open_log(cut))
    whole = plan_views(open_log(path))
    assert not plan.source.complete
    assert plan.source.damage
    recording = plan.recording()
    assert not recording.complete
    assert 0 < len(recording.views) < len(whole)
    for one, other in zip(recording.views[:-1], whole.views, strict=False):
        assert (one.time, one.distance) == (other.time, other.distance)


def test_transforms_in_a_circle_are_refused(tmp_path: Path) -> None:
    context = foxglove.Context()
    path = tmp_path / "circle.mcap"
    with foxglove.open_mcap(str(path), context=context):
        tree = channels.FrameTransformChannel("/tf", context=context)
        for parent, child in (("odom", "base_link"), ("base_link", "laser"), ("laser", "odom")):
            tree.log(messages.FrameTransform(parent_frame_id=parent, child_frame_id=child), log_time=5)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == (
        f"{path}: topic /tf: transforms form a cycle: odom → base_link → laser → odom; valid is a tree"
    )


def test_duplicates_count_once(tmp_path: Path) -> None:
    context = foxglove.Context()
    path = tmp_path / "twice.mcap"
    with foxglove.open_mcap(str(path), context=context):
        laser = channels.LaserScanChannel(TOPICS[Sense.SCAN], context=context)
        for tick in range(10):
            stamp = messages.Timestamp(sec=100 + tick, nsec=0)
            for again in range(2):
                scan = messages.LaserScan(timestamp=stamp, start_angle=0, end_angle=1, ranges=[1.0 + again] * 3)
                laser.log(scan, log_time=ns(100 + tick + again / 100))
    recording = read_recording(path)
    assert len(recording.views) == 10
    assert {float(view.scan.ranges[0]) for view in recording.views if view.scan} == {2.0}
    assert recording.findings
    assert recording.findings.channels["/scan"].duplicates == 10


def test_topics_that_were_written_one_behind_the_other_are_no_clock_that_jumps(tmp_path: Path) -> None:
    """As converters write them: each topic's own times rise."""
    whole = write_foxglove(tmp_path / "whole.mcap", DRIVE)
    sorted_by = write_foxglove(tmp_path / "topics.mcap", TopicByTopic(seconds=6.0))
    one, other = read_recording(whole), read_recording(sorted_by)
    assert other.findings
    assert not other.findings.notes
    assert [view.time for view in other.views] == [view.time for view in one.views]
    for first, second in zip(one.views, other.views, strict=True):
        assert (first.distance, first.turn) == (second.distance, second.turn)
        assert all((first.images[name] == second.images[name]).all() for name in first.images)


class TopicByTopic(RobotDrive):
    """The same drive, whose moments are written sense by sense."""

    @property
    def moments(self) -> list[Moment]:  # type: ignore[override]
        return sorted(super().moments, key=lambda moment: (moment.sense, moment.logged))


def test_a_log_in_no_order_at_all_is_told(tmp_path: Path) -> None:
    class Shuffled(RobotDrive):
        @property
        def moments(self) -> list[Moment]:  # type: ignore[override]
            found = list(super().moments)
            np.random.default_rng(1).shuffle(found)  # type: ignore[arg-type]
            return found

    path = write_foxglove(tmp_path / "shuffled.mcap", Shuffled(seconds=30.0))
    with pytest.raises(LogError, match="its clock jumps back 101 times and more; valid is a log in order of time"):
        read_recording(path)
