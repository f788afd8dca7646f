import bz2
import gzip
import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from refseq.errors import LogError
from refseq.logs import Role, open_log, read_recording, write_carmen
from refseq.logs.carmen import NO_RETURN
from refseq.logs.trajectories import read_trajectory
from refseq.planar import Pose
from refseq.view import Scan, View

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
    assert first.truth == second.truth == Pose(5, 6, 0.5)
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
            "FLASER: could not convert string to float: '1,5'; valid are numbers in fields 2 to 4",
        ),
        (ROBOTLASER + " 1", "ROBOTLASER1: has 30 fields; valid are 29 for 3 ranges"),
        (
            "ROBOTLASER1 0 -1.5 3.0 0.5 50 0.01 0 9 1 2 3",
            "ROBOTLASER1: has 12 fields; valid are at least 19 for 9 ranges",
        ),
        ("ROBOTLASER1 0 -1.5 3.0", "ROBOTLASER1: field 8 is nothing; valid is the number of ranges"),
        (RAWLASER[:-4], "RAWLASER1: has 17 fields; valid are 18 for 3 ranges"),
        ("ODOM 1 2 3", "ODOM: has 4 fields; valid are 10"),
        ("TRUEPOS 1 2 3", "TRUEPOS: has 4 fields; valid are 10"),
        ("PARAM x", "PARAM: has 2 fields; valid are at least 3: PARAM, a name and a value"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, line: str, message: str) -> None:
    path = log(tmp_path, "# head", FLASER, line)
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == f"{path}: line 3: {message}"


def test_a_log_without_scans(tmp_path: Path) -> None:
    path = log(tmp_path, "VERTEX2 0 1 2 3", "EDGE2 0 1")
    with pytest.raises(LogError) as caught:
        read_recording(path)
    assert str(caught.value) == (
        f"{path}: holds no scan (kinds of lines seen: EDGE2, VERTEX2); valid are FLASER, ROBOTLASER1, RAWLASER1"
    )


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
