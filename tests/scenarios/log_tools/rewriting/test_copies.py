"""Stretches of logs in their own format, held against what other projects' readers find in the log and in the copy."""

import bz2
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin

from refseq.errors import LogError
from refseq.logs import RecordingWriter, open_log, plan_views, read_recording
from refseq.logs.carmen.source import LineSpan
from refseq.logs.formats import DriveFormat, output_format
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.log_tools.rewriting.copies import LoggedSpan, check_copy, copy_stretch
from tests.refseq.logs.foreign import write_ros2_mcap, write_rosbag1, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive

DRIVE = RobotDrive(seconds=4.0)
SPAN = LoggedSpan(round((DRIVE.start + 1.0) * 1e9), round((DRIVE.start + 2.5) * 1e9))
Logged = list[tuple[str, int, bytes]]


def bag_messages(path: Path) -> Logged:
    with AnyReader([path]) as reader:
        return [(connection.topic, time, bytes(data)) for connection, time, data in reader.messages()]


def mcap_messages(path: Path) -> Logged:
    with path.open("rb") as file:
        found = make_reader(file).iter_messages()
        return [(channel.topic, message.log_time, message.data) for _, channel, message in found]


def expected(source: Logged) -> Logged:
    """All that was logged in the stretch as it is, and the mounts, told before it, at its beginning."""
    mounts = [(topic, SPAN.first, data) for topic, time, data in source if topic == "/tf_static" and time < SPAN.first]
    return sorted([*mounts, *(one for one in source if SPAN.first <= one[1] <= SPAN.last)])


WRITERS = {
    "mcap": (lambda path: write_ros2_mcap(path / "in.mcap", DRIVE), "out.mcap", mcap_messages),
    "rosbag2": (lambda path: write_rosbag2(path / "in", DRIVE), "out", bag_messages),
    "sqlite": (lambda path: write_rosbag2(path / "in", DRIVE, storage=StoragePlugin.SQLITE3), "out", bag_messages),
    "ros1": (lambda path: write_rosbag1(path / "in.bag", DRIVE), "out.bag", bag_messages),
}


@pytest.mark.quick_cases("mcap", "sqlite")
@pytest.mark.parametrize("kind", WRITERS)
def test_a_copy_holds_the_stretch_byte_for_byte(kind, tmp_path):
    write, name, messages = WRITERS[kind]
    source, target = write(tmp_path), tmp_path / name
    before = sorted(tmp_path.iterdir())
    count = copy_stretch(source, target, SPAN, {"cut": "by a test"})
    wanted = expected(messages(source))
    assert sorted(messages(target)) == wanted
    assert count == len(wanted)
    assert {topic for topic, _, _ in wanted} == {topic for topic, _, _ in messages(source)}
    assert sorted(tmp_path.iterdir()) == sorted([*before, target])
    assert len(plan_views(open_log(target))) == pytest.approx(15, abs=2)


def test_a_copy_of_a_bag_says_what_it_is(tmp_path):
    source = write_rosbag2(tmp_path / "in", DRIVE)
    copy_stretch(source, tmp_path / "out", SPAN, {"cut": "by a test"})
    assert open_log(tmp_path / "out").metadata["cut"] == "by a test"


def test_a_copy_of_a_bag_of_ours_keeps_its_notes_and_the_cameras_names(tmp_path):
    with output_format(DriveFormat.ROSBAG2).open(tmp_path / "own", {"world": "hall"}) as writer:
        for k in range(6):
            writer.write(View(float(k), {"camera-1": np.zeros((4, 4), np.uint8)}), Pose(k, 0.0, 0.0))
    copy_stretch(tmp_path / "own", tmp_path / "copy", LoggedSpan(1 * 10**9, 4 * 10**9), {"cut": "some"})
    recording = read_recording(tmp_path / "copy")
    assert recording.sensors == {"camera-1"}
    assert recording.metadata == {"world": "hall", "cut": "some"}


def test_a_log_that_was_cut_off_is_copied_as_far_as_it_goes(tmp_path):
    source = tmp_path / "in.mcap"
    with RecordingWriter(source, {}) as writer:
        for number in range(30):
            writer.write(View(float(number), {"front": np.zeros((24, 32), np.uint8)}), Pose(float(number), 0.0, 0.0))
    whole = source.read_bytes()
    source.write_bytes(whole[: len(whole) * 2 // 3])
    count = copy_stretch(source, tmp_path / "out.mcap", LoggedSpan(0, 1 << 62), {})
    assert 0 < count == len(mcap_messages(tmp_path / "out.mcap"))


def test_lines_of_carmen_stay_as_they_are_packed_or_not(tmp_path):
    lines = ["# comment", "PARAM robot_width 0.5 1.0 host 1.0"]
    lines += [f"ODOM {k}.0 0.0 0.0 0.5 0.0 0.0 {k}.0 host {k}.5" for k in range(10)]
    source, target = tmp_path / "in.clf.bz2", tmp_path / "out.clf.bz2"
    source.write_bytes(bz2.compress("\n".join([*lines, ""]).encode()))
    assert copy_stretch(source, target, LineSpan(6, 7, frozenset({4})), {"cut": "some"}) == 3
    told = bz2.decompress(target.read_bytes()).decode().splitlines()
    assert told == ["PARAM cut some 0 refseq 0", *lines[:2], lines[3], *lines[5:7]]


def test_a_packed_carmen_log_that_was_cut_off_is_copied_as_far_as_it_goes(tmp_path):
    source, target = tmp_path / "in.clf.bz2", tmp_path / "out.clf"
    rng = np.random.default_rng(0)
    parts = [bz2.compress(f"ODOM {x} 0 0 0 0 0 {x} host {x}\n".encode()) for x in rng.random(20)]
    source.write_bytes(b"".join(parts)[: -len(parts[-1]) // 2])
    assert copy_stretch(source, target, LineSpan(1, 100, frozenset()), {}) == 19


def test_nothing_is_left_of_a_copy_that_fails(tmp_path):
    source = tmp_path / "in.bag"
    write_rosbag1(source, DRIVE)
    source.write_bytes(source.read_bytes()[:200])
    with pytest.raises(LogError, match=r"in\.bag: cannot be copied"):
        copy_stretch(source, tmp_path / "out.bag", SPAN, {})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.bag"]


def test_a_folder_of_pictures_cannot_be_cut(tmp_path):
    with pytest.raises(LogError, match="valid are rosbag2 folders"):
        check_copy(tmp_path, tmp_path / "out")


def test_a_folder_that_is_there_is_not_replaced(tmp_path):
    source = write_rosbag2(tmp_path / "in", DRIVE)
    (tmp_path / "out").mkdir()
    with pytest.raises(LogError, match="is there already"):
        check_copy(source, tmp_path / "out")


CARMEN_LINE = "RAWLASER1 0 0 1 1 20 0.01 0 1 2.0 0 1.0 host 1.0\n"
NAMES = {
    "in.mcap": (("a.mcap", "a.MCAP"), ("a.clf", "a.bag", "a.mcap.gz", "a"), "ends in .mcap"),
    "in.bag": (("a.bag",), ("a.mcap", "a.log"), "ends in .bag"),
    "in": (("a", "a.2026"), ("a.mcap", "a.bag"), "one of a folder"),
    "in.clf": (
        ("a.clf", "a.log.gz", "a.carmen"),
        ("a.mcap", "a.tum", "a.mcap.bz2"),
        "ends in .clf, .log, .carmen, packed",
    ),
    "in.2003": (("a.2003", "a.clf"), ("a.mcap",), "ends in .clf"),
}


@pytest.mark.parametrize("name", NAMES)
def test_a_copy_is_called_as_its_kind_is(name, tmp_path):
    source = tmp_path / name
    if name == "in":
        write_rosbag2(source, DRIVE)
    elif name == "in.bag":
        write_rosbag1(source, DRIVE)
    elif name == "in.mcap":
        write_ros2_mcap(source, DRIVE)
    else:
        source.write_text(CARMEN_LINE)
    valid, others, told = NAMES[name]
    for one in valid:
        check_copy(source, tmp_path / one)
    for one in others:
        with pytest.raises(LogError, match=rf"{one}: is no name for a stretch of .*{name}, .* valid is .*{told}"):
            check_copy(source, tmp_path / one)
