import bz2
import gzip
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq.logs import Role, open_log, plan_views, read_recording, write_carmen
from refseq.logs.carmen.layouts import NO_RETURN
from refseq.logs.carmen.source import CarmenSource, LineSpan
from refseq.logs.trajectories import read_trajectory
from refseq.planar import Pose
from refseq.view import Scan, View, facing
from refseq_bench.scenarios.log_tools.rewriting.conversion import LogFormat, convert

DATA = Path(__file__).resolve().parents[3].parent / "shared" / "data"
FLASER = "FLASER 3 1.5 2 81.91 10 20 0.5 1 2 0.25 7.5 host 7.6"
ROBOTLASER = (
    "ROBOTLASER1 0 -1.5 3.0 0.5 50 0.01 0 3 1 60 3 2 8 9 "  # two remissions
    "10 20 0.5 1 2 0.25 0.3 0.1 0 0 0 7.5 host 7.6"
)
RAWLASER = "RAWLASER1 0 -1.5 3.0 0.5 50 0.01 0 3 1 60 3 2 8 9 7.5 host 7.6"


def log(folder: Path, *lines: str) -> Path:
    path = folder / "log.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def flaser(n: int) -> str:
    return f"FLASER {n} " + "1.00 " * n + "0 0 0 0 0 0 1 host 1"


def test_flaser(tmp_path: Path) -> None:
    (view,) = read_recording(log(tmp_path, FLASER)).views
    assert view.scan
    np.testing.assert_array_equal(view.scan.ranges, np.array([1.5, 2, np.inf], np.float32))
    assert view.scan.start == -math.pi / 2
    assert (view.truth, view.time, view.distance) == (Pose(10, 20, 0.5), 7.5, 0.0)


@pytest.mark.parametrize(("beams", "last"), [(361, 90.0), (360, 89.5), (181, 90.0), (180, 89.0)])
def test_flaser_has_no_angles_so_beams_tell_the_step(tmp_path: Path, beams: int, last: float) -> None:
    (view,) = read_recording(log(tmp_path, flaser(beams))).views
    assert view.scan
    assert len(view.scan.ranges) == beams
    assert np.degrees(view.scan.bearings[[0, -1]]) == pytest.approx([-90.0, last])


def test_robotlaser(tmp_path: Path) -> None:
    second = ROBOTLASER.replace(" 1 2 0.25 ", " 1.5 2 0.25 ").replace("7.5", "8.5")
    first, after = read_recording(log(tmp_path, ROBOTLASER, second)).views
    assert first.scan
    np.testing.assert_array_equal(first.scan.ranges, np.array([1, np.inf, 3], np.float32))
    assert first.scan.bearings == pytest.approx([-1.5, -1.0, -0.5])
    assert first.scan.max_range == 50.0
    assert (first.truth, first.time) == (Pose(10, 20, 0.5), 7.5)
    assert (after.distance, after.turn, after.time) == (0.5, 0.0, 8.5)


def test_rawlaser_takes_the_last_odometry_and_truth(tmp_path: Path) -> None:
    path = log(
        tmp_path,
        "ODOM 1 2 0 0 0 0 7 host 7",
        "TRUEPOS 5 6 0.5 1 2 0 7 host 7",
        RAWLASER,
        "ODOM 0 2 0 0 0 0 8 host 8",
        RAWLASER,
    )
    first, second = read_recording(path).views
    assert first.scan
    assert first.scan.bearings == pytest.approx([-1.5, -1.0, -0.5])
    assert first.truth == Pose(5, 6, 0.5)
    assert second.truth is not None
    assert (second.truth.x, second.truth.y) == pytest.approx((5 - math.cos(0.5), 6 - math.sin(0.5)))
    assert second.distance == pytest.approx(-1.0)


def test_params_are_metadata_and_other_kinds_are_counted(tmp_path: Path) -> None:
    rear = FLASER.replace("FLASER", "RLASER")
    path = log(tmp_path, "# comment", "", "PARAM robot_width 0.5 1 h 1", "VERTEX2 0 1 2 3", rear, "VERTEX2 1", FLASER)
    recording = read_recording(path)
    assert recording.metadata == {"robot_width": "0.5"}
    assert recording.skipped == {"VERTEX2": 2, "RLASER": 1}
    assert recording.complete
    assert recording.sensors == {"laser"}


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("FLASER 4 1 2 3 0 0 0 0 0 0 1 h 1", "FLASER: has 14 fields; valid are 15 for 4 ranges"),
        ("FLASER", "FLASER: field 1 is nothing; valid is the number of ranges"),
        ("FLASER x 1", "FLASER: field 1 is x; valid is the number of ranges"),
        ("FLASER -1 1", "FLASER: field 1 is -1; valid is the number of ranges"),
        ("FLASER " + 5000 * "9", f"FLASER: field 1 is {40 * '9'}; valid is the number of ranges"),
        ("FLASER 100001 1", "FLASER: has 100001 ranges in a scan; valid are at most 100000"),
        ("FLASER ² 1", "FLASER: field 1 is ²; valid is the number of ranges"),
        (FLASER.replace("1.5", "nan"), "FLASER: field 2 is nan; valid are finite numbers up to 1e+12"),
        (
            FLASER.replace("1.5", "1,5"),
            "FLASER: field 2 is 1,5; valid are numbers in fields 2 to 4",
        ),
        (ROBOTLASER + " 1", "ROBOTLASER1: has 30 fields; valid are 29 for 3 ranges"),
        (
            "ROBOTLASER1 0 -1.5 3.0 0.5 50 0.01 0 9 1 2 3",
            "ROBOTLASER1: has 12 fields; valid are at least 19 for 9 ranges",
        ),
        ("ROBOTLASER1 0 -1.5 3.0", "ROBOTLASER1: field 8 is nothing; valid is the number of ranges"),
        (RAWLASER[:-4], "RAWLASER1: has 17 fields; valid are 18 for 3 ranges"),
        (FLASER.replace("7.5", "1e10"), "FLASER: field 11 is 1e10; valid are finite numbers up to 8.58993e+09"),
        (FLASER.replace(" 10 ", " 2e9 "), "FLASER: field 5 is 2e9; valid are finite numbers up to 1e+09"),
        ("ODOM 1 2 3", "ODOM: has 4 fields; valid are 10"),
        ("TRUEPOS 1 2 3", "TRUEPOS: has 4 fields; valid are 10"),
        ("PARAM x", "PARAM: has 2 fields; valid are at least 3: PARAM, a name and a value"),
    ],
)
def test_a_wrong_line_among_others_is_left_out_and_named(tmp_path: Path, line: str, message: str) -> None:
    path = log(tmp_path, "# head", FLASER, line, FLASER.replace("7.5", "8.5"), "PARAM robot mine 1 h 1")
    source = open_log(path)
    for _ in range(2):
        plan = plan_views(source)
        assert [view.time for view in plan.read()] == [7.5, 8.5]
        assert source.complete
        assert source.metadata == {"robot": "mine"}
        (told,) = plan.findings.losses()
        kind, reason = message.split(": ", 1)
        topic = {"ODOM": "/odometry", "TRUEPOS": "/truth", "PARAM": "PARAM"}.get(kind, "/laser")
        place = "line 3" if kind == "PARAM" else f"line 3, {kind},"
        left = "is not readable, the only one" if kind == "TRUEPOS" else "is not readable and left out"
        assert told == f"topic {topic}: {place} {left}: {reason}"


def test_a_log_of_which_no_scan_can_be_read_is_refused(tmp_path: Path) -> None:
    path = log(tmp_path, "# head", *[FLASER.replace("1.5", "x")] * 3)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    why = "is not readable, nor are the other 2: field 2 is x; valid are numbers in fields 2 to 4"
    assert str(caught.value) == f"{path}: topic /laser: line 2, FLASER, {why}"


def test_raw_scans_of_which_no_pose_can_be_read_are_refused(tmp_path: Path) -> None:
    """Else the robot would stand."""
    path = log(tmp_path, "ODOM 1 x 0 0 0 0 7 h 7", RAWLASER, "ODOM 1 x 0 0 0 0 8 h 8", RAWLASER)
    with pytest.raises(LogError, match=r"topic /odometry: line 1, ODOM, is not readable, nor are the other 1: field 2"):
        read_recording(path)


def test_the_true_pose_of_a_scan_that_is_left_out_is_not_that_of_the_next(tmp_path: Path) -> None:
    poses = [f"TRUEPOS {x} 0 0 0 0 0 7 h 7" for x in (5, 6)]
    path = log(tmp_path, poses[0], RAWLASER.replace("60 3", "60 x"), RAWLASER, poses[1], RAWLASER)
    assert [view.truth for view in read_recording(path).views] == [None, Pose(6, 0, 0)]


def test_lines_of_a_stretch_are_of_scans_that_can_be_read(tmp_path: Path) -> None:
    odometry = ["ODOM 1 2 0 0 0 0 7 h 7", "ODOM 1 x 0 0 0 0 7 h 7"]
    path = log(tmp_path, odometry[0], RAWLASER.replace("60", "x"), RAWLASER, RAWLASER, odometry[1], RAWLASER)
    source = open_log(path)
    assert isinstance(source, CarmenSource)
    assert source.lines_of(0, 0) == LineSpan(3, 3, frozenset({1}))
    assert source.lines_of(2, 2) == LineSpan(6, 6, frozenset({1}))


def test_a_log_without_scans(tmp_path: Path) -> None:
    path = log(tmp_path, "VERTEX2 0 1 2 3", "EDGE2 0 1")
    with pytest.raises(LogError) as caught:
        read_recording(path)
    valid = "FLASER, ROBOTLASER1, RAWLASER1, RLASER, ROBOTLASER2, RAWLASER2, RAWLASER3, RAWLASER4, RAWLASER5"
    why = "is text, so a CARMEN log, and holds no scan (kinds of lines seen: EDGE2, VERTEX2)"
    assert str(caught.value) == f"{path}: {why}; valid are {valid}"


def test_a_text_that_is_no_log_is_not_repeated(tmp_path: Path) -> None:
    path = log(tmp_path, *(f"{word * 9} in a row" for word in "abcdefgh"), "z" * 99)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    kinds = ", ".join(word * 9 for word in "abcde")
    assert f"(kinds of lines seen: {kinds}, and 4 more);" in str(caught.value)


def drive(beams: int) -> list[View]:
    """Views as a 1 cm laser sees them; the robot turns, reverses, and has no scan once."""
    rng = np.random.default_rng(beams)
    step = math.pi / 360 if beams >= 360 else math.pi / 180
    views = []
    for k in range(8):
        ranges = np.round(rng.uniform(0.2, 40, beams), 2)
        ranges[rng.random(beams) < 0.1] = np.inf
        scan = Scan(ranges.astype(np.float32), -math.pi / 2, step, NO_RETURN)
        motion = (0.0, 0.0) if k == 0 else (float(rng.uniform(-1, 1)), float(rng.uniform(-2, 2)))
        views.append(View(1000.0 + 0.25 * k, {}, None if k == 4 else scan, *motion, Pose(k / 4, -k / 8, k / 16)))
    return views


@pytest.mark.parametrize("beams", [361, 360, 181])
def test_round_trip(tmp_path: Path, beams: int) -> None:
    views = drive(beams)
    metadata = {"world": "hall way", "config": '{"a":\n1}', "empty": ""}
    write_carmen(tmp_path / "a.log", views, metadata)
    recording = read_recording(tmp_path / "a.log")
    assert recording.metadata == {"world": "hall_way", "config": '{"a":_1}'}
    written = [view for view in views if view.scan]
    assert len(recording.views) == len(written)
    for read, view in zip(recording.views, written, strict=True):
        assert read.scan
        assert view.scan
        assert read.scan.ranges.tobytes() == view.scan.ranges.tobytes()
        assert (read.scan.start, read.scan.step, read.scan.max_range) == (view.scan.start, view.scan.step, NO_RETURN)
        assert read.truth == view.truth
        assert read.time == view.time
    # Views 0 to 3 follow one another; view 4 has no scan and its motion goes into view 5's.
    for read, view in zip(recording.views[1:4], written[1:4], strict=True):
        assert (read.distance, read.turn) == pytest.approx((view.distance, view.turn), abs=1e-5)


@pytest.mark.parametrize(("beams", "start", "step"), [(1081, -0.75 * math.pi, math.pi / 720), (180, -1.0, 0.01)])
def test_scans_of_other_angles_keep_them(tmp_path: Path, beams: int, start: float, step: float) -> None:
    views = [
        replace(view, scan=Scan(view.scan.ranges, start, step, 30.0) if view.scan else None) for view in drive(beams)
    ]
    write_carmen(tmp_path / "a.log", views)
    read, written = read_recording(tmp_path / "a.log").views, [view for view in views if view.scan]
    for found, view in zip(read, written, strict=True):
        assert found.scan
        assert view.scan
        assert found.scan.bearings == pytest.approx(view.scan.bearings, abs=1e-5)
        near = view.scan.ranges < 30
        np.testing.assert_array_equal(found.scan.ranges[near], view.scan.ranges[near])
        assert np.isinf(found.scan.ranges[~near]).all()
        assert (found.truth, found.time, found.scan.max_range) == (view.truth, view.time, 30.0)


def test_motion_of_a_view_without_scan_is_not_lost(tmp_path: Path) -> None:
    views = [replace(view, distance=0.5, turn=0.0) for view in drive(181)]
    write_carmen(tmp_path / "a.log", views)
    assert [v.distance for v in read_recording(tmp_path / "a.log").views] == pytest.approx(
        [0, 0.5, 0.5, 0.5, 1, 0.5, 0.5]
    )


def test_writing_drives_without_scans_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    with pytest.raises(LogError) as caught:
        write_carmen(path, [View(0.0), View(1.0)])
    assert str(caught.value) == f"{path}: a CARMEN log holds laser scans; none of the 2 views has one"
    assert not path.exists()


@pytest.mark.parametrize(
    ("name", "scans", "beams", "length", "duration"),
    [("mit-csail/mit-cscail.log", 1051, 361, 383, 410), ("fr079/fr079.log", 1464, 360, 391, 1054)],
)
def test_real_logs(name: str, scans: int, beams: int, length: float, duration: float) -> None:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"the recording {name} is not beside this checkout")
    recording = read_recording(path)
    assert len(recording.views) == scans
    assert {len(view.scan.ranges) for view in recording.views if view.scan} == {beams}
    assert sum(abs(view.distance) for view in recording.views) == pytest.approx(length, abs=1)
    assert recording.views[-1].time - recording.views[0].time == pytest.approx(duration, abs=1)
    assert set(recording.skipped) == {"VERTEX2", "EDGE2"}
    lost = np.mean([np.isinf(view.scan.ranges).mean() for view in recording.views if view.scan])
    assert 0.01 < lost < 0.04  # 2.0 to 2.8 % of the beams come back from nowhere


@pytest.mark.parametrize("packed", [gzip.compress, bz2.compress])
def test_a_compressed_log_is_read_as_it_is(tmp_path: Path, packed: Callable[[bytes], bytes]) -> None:
    path = log(tmp_path, *[FLASER.replace("7.5", f"{k}.5") for k in range(9)])
    plain = read_recording(path)
    small = tmp_path / "log.packed"
    small.write_bytes(packed(path.read_bytes()))
    recording = read_recording(small)
    assert recording.complete
    assert [view.time for view in recording.views] == [view.time for view in plain.views]


@pytest.mark.quick_cases("compress0")
def test_the_mark_that_editors_put_before_a_text_is_no_part_of_its_first_line(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(f"{FLASER}\n{FLASER}\n", encoding="utf-8-sig")
    recording = read_recording(path)
    assert len(recording.views) == 2
    assert recording.skipped == {}


def test_compressed_data_that_end_early_are_told_in_our_own_words(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_bytes(gzip.compress(f"{FLASER}\n".encode() * 1000, mtime=0)[:-4])
    source = open_log(path)
    assert len(list(source.samples(["/laser"]))) == 1000
    assert source.damage == "its compressed data end before their time"


EMPTY = {"nothing": gzip.compress(b""), "nothing by bzip2": bz2.compress(b""), "a blank line": gzip.compress(b" \n")}


@pytest.mark.parametrize("empty", EMPTY.values(), ids=EMPTY)
def test_a_compressed_file_of_nothing_is_told_as_empty(tmp_path: Path, empty: bytes) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(empty)
    with pytest.raises(LogError, match=r"log\.gz: is empty once unpacked; valid are a ROS bag"):
        open_log(path)


@pytest.mark.parametrize("packed", [gzip.compress, bz2.compress])
def test_a_compressed_log_that_was_cut_off_gives_what_is_left(tmp_path: Path, packed: Callable[[bytes], bytes]) -> None:
    rng = np.random.default_rng(1)
    lines = [FLASER.replace("1.5 2", f"{a:.2f} {b:.2f}") for a, b in rng.uniform(1, 40, (60_000, 2))]
    content = packed("\n".join(lines).encode())
    path = tmp_path / "log.packed"
    path.write_bytes(content[: len(content) * 3 // 4])
    source = open_log(path)
    assert not source.complete
    assert 0 < sum(channel.count for channel in source.channels if channel.role is Role.LASER) < 60_000
    path.write_bytes(content[:40])
    with pytest.raises(LogError, match=r"log\.packed: .*; valid are .*CARMEN log"):
        read_recording(path)


def test_a_log_cut_off_at_any_byte_gives_what_lies_before(tmp_path: Path) -> None:
    """As a logger leaves it that was killed, or a disk that was full."""
    path = log(
        tmp_path, "# head", FLASER, "ODOM 1 2 3 0 0 0 1 h 1", FLASER.replace("7.5", "8.5"), "PARAM robot mine 1 h 1"
    )
    content = path.read_bytes()
    first = content.index(b"\n", content.index(b"FLASER")) + 1
    for end in range(first, len(content)):
        path.write_bytes(content[:end])
        found = read_recording(path)
        whole = 1 + (end > content.index(b"PARAM"))
        # A line that lacks but the end of its last number is one.
        assert whole <= len(found.views) <= whole + 1
        assert found.views[0].time == 7.5
        if not found.complete:
            assert len(found.views) == whole
    assert found.complete


def test_a_line_without_end_is_not_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(b"FLASER " + b"1 " * 5_000_000))
    with pytest.raises(LogError, match=r"log\.gz: line 1: has 1048577 bytes in a line of a CARMEN log; valid"):
        read_recording(path)


def test_raw_odometry_and_truth_by_the_number_of_the_scan() -> None:
    path = DATA / "radish" / "mit-csail.clf.bz2"
    if not path.exists():
        pytest.skip("the recordings radish are not beside this checkout")
    truth = read_trajectory(DATA / "radish" / "mit-csail.truth.csv")
    recording = read_recording(path, thin=0.5, truth=truth)
    true = [view.truth for view in recording.views if view.truth]
    assert len(true) > 0.8 * len(recording.views)
    # Raw odometry drifts by its heading; lengths agree within a few per cent.
    way = sum(math.hypot(b.x - a.x, b.y - a.y) for a, b in pairwise(true))
    assert sum(abs(view.distance) for view in recording.views[-len(true) :]) == pytest.approx(way, rel=0.1)


# --- other lasers, and who tells the truth ---


def test_true_positions_outrank_the_pose_beside_a_scan(tmp_path: Path) -> None:
    """Where the odometer has gone on since, so has the truth; before the first of them it is not known."""
    later = FLASER.replace(" 1 2 0.25 7.5", " 2 2 0.25 8.5")
    path = log(tmp_path, FLASER, f"TRUEPOS 5 6 {0.25 + math.pi / 2} 1 2 0.25 8 host 8", later)
    first, second = read_recording(path).views
    assert first.truth is None
    assert second.truth is not None
    expected = (5.0, 7.0, 0.25 + math.pi / 2)
    assert (second.truth.x, second.truth.y, second.truth.heading) == pytest.approx(expected)


@pytest.mark.parametrize("turned", [-0.5, 0.0, 0.5])
def test_a_true_position_turns_on_as_the_odometer_does(tmp_path: Path, turned: float) -> None:
    """The odometer's frame is a quarter turn from that of the truth, before and after."""
    later = FLASER.replace(" 1 2 0.25 7.5", f" 1 4 {0.25 + turned} 8.5")
    path = log(tmp_path, FLASER, f"TRUEPOS 5 6 {0.25 + math.pi / 2} 1 2 0.25 8 host 8", later)
    truth = read_recording(path).views[1].truth
    assert truth is not None
    assert (truth.x, truth.y, truth.heading) == pytest.approx((3.0, 6.0, 0.25 + turned + math.pi / 2))


def test_the_rear_laser_is_read_where_there_is_no_other(tmp_path: Path) -> None:
    rear = FLASER.replace("FLASER", "RLASER")
    (view,) = read_recording(log(tmp_path, rear)).views
    assert view.scan
    assert view.scan.bearings[0] == pytest.approx(math.pi / 2), "it looks back, from the robot's left to its right"
    assert view.truth is None, "the pose is the laser's own"
    (view,) = read_recording(log(tmp_path, rear, FLASER)).views
    assert view.scan
    assert view.scan.start == -math.pi / 2


@pytest.mark.parametrize("number", [2, 3, 4, 5])
def test_further_lasers_are_read_where_there_is_no_other(tmp_path: Path, number: int) -> None:
    lines = [RAWLASER.replace("1", str(one), 1) for one in range(number, 6)]
    recording = read_recording(log(tmp_path, "ODOM 1 2 0 0 0 0 7 host 7", *lines))
    (view,) = recording.views
    assert view.scan
    assert len(view.scan.ranges) == 3
    assert sorted(recording.skipped) == [f"RAWLASER{one}" for one in range(number + 1, 6)]


def test_what_tells_no_pose_and_no_scan_is_counted(tmp_path: Path) -> None:
    imu = "IMU " + "0 " * 13 + "7 host 7"
    gps = "NMEAGGA 1 120000 48.1 N 7.8 E 1 8 1.0 270 0 0 0 7 host 7"
    assert read_recording(log(tmp_path, imu, gps, FLASER)).skipped == {"IMU": 1, "NMEAGGA": 1}


# --- there and back ---

millimetres = st.integers(1, 100_000).map(lambda n: n / 1000)
poses = st.builds(Pose, *[st.floats(-1000, 1000)] * 2, st.floats(-3, 3))


@st.composite
def drives(
    draw: st.DrawFn, reaches: tuple[float, ...] = (5.0, 30.0, 80.0, NO_RETURN, 100.0), odometry: bool | None = None
) -> list[View]:
    """Drives of a laser: its angles and range, with truth and odometry or without."""
    beams = draw(st.sampled_from([3, 181, 361]))
    start, step = draw(st.sampled_from([(-math.pi / 2, math.pi / 360), (-math.pi / 2, math.pi / 180), (-1.0, 0.01)]))
    reach = draw(st.sampled_from(reaches))
    has_odometry = draw(st.booleans()) if odometry is None else odometry
    true = draw(st.sampled_from(["all", "none", "some"])) if has_odometry else "none"  # else it would be the odometry
    views = []
    for number in range(draw(st.integers(1, 4))):
        seen = [draw(millimetres) for _ in range(3)]
        ranges = np.resize(np.array([one if one < reach else np.inf for one in seen], np.float32), beams)
        motion = (draw(st.floats(-2, 2)), draw(st.floats(-1, 1))) if has_odometry and number else (0.0, 0.0)
        truth = draw(poses) if true == "all" or (true == "some" and draw(st.booleans())) else None
        scan = facing(Scan(ranges, start, step, reach))  # 361 degrees are a full turn
        views.append(View(100.0 + number, {}, scan, *motion, truth, has_odometry=has_odometry))
    return views


DRAWN = (Phase.explicit, Phase.generate)


@settings(deadline=None, max_examples=60, phases=DRAWN, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(views=drives())
def test_every_drive_of_a_laser_comes_back(tmp_path: Path, views: list[View]) -> None:
    write_carmen(tmp_path / "one.log", views)
    _check_comes_back(tmp_path / "one.log", views)


@settings(deadline=None, max_examples=15, phases=DRAWN, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(views=drives(reaches=(80.0,), odometry=True))
def test_every_drive_comes_back_by_way_of_mcap(tmp_path: Path, views: list[View]) -> None:
    """Foxglove's scan has no range: 80 m is what is read."""
    write_carmen(tmp_path / "one.log", views)
    convert(plan_views(open_log(tmp_path / "one.log")), tmp_path / "two.mcap", LogFormat.MCAP, {})
    convert(plan_views(open_log(tmp_path / "two.mcap")), tmp_path / "three.log", LogFormat.CARMEN, {})
    _check_comes_back(tmp_path / "two.mcap", views)
    _check_comes_back(tmp_path / "three.log", views)


def _check_comes_back(path: Path, views: list[View]) -> None:
    found = read_recording(path).views
    assert len(found) == len(views)
    for read, view in zip(found, views, strict=True):
        _check_same(read, view)


def _check_same(read: View, view: View) -> None:
    assert read.scan
    assert view.scan
    assert read.scan.ranges == pytest.approx(view.scan.ranges, abs=0.0011)
    assert read.scan.bearings == pytest.approx(view.scan.bearings, abs=1e-5)
    assert read.scan.max_range == pytest.approx(view.scan.max_range, abs=1e-5)
    assert (read.distance, read.turn) == pytest.approx((view.distance, view.turn), abs=1e-5)
    assert read.has_odometry == view.has_odometry
    assert (read.truth is None) == (view.truth is None)
    if read.truth is not None and view.truth is not None:
        assert (read.truth.x, read.truth.y) == pytest.approx((view.truth.x, view.truth.y), abs=1e-5)
        assert math.remainder(read.truth.heading - view.truth.heading, 2 * math.pi) == pytest.approx(0, abs=1e-5)


def test_a_true_pose_before_the_first_odometry_is_no_odometry(tmp_path: Path) -> None:
    """Its frame is another: the step from one to the other would be a motion."""
    ranges = " ".join(["2"] * 181)
    scan = f"RAWLASER1 0 -1.57 3.14 0.0174 30 0.01 0 181 {ranges} 0"
    told = ["TRUEPOS 20 7 0 0 0 0 1.0 h 1.0", f"{scan} 1.1 h 1.1"]
    told += ["ODOM 0 0 0 0 0 0 1.5 h 1.5", f"{scan} 1.6 h 1.6", "ODOM 0.5 0 0 0 0 0 2.5 h 2.5", f"{scan} 2.6 h 2.6"]
    views = read_recording(log(tmp_path, *told)).views
    assert [view.distance for view in views] == pytest.approx([0.0, 0.0, 0.5], abs=1e-6)
