import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import foxglove
import numpy as np
import pytest
from foxglove import messages
from foxglove.channels import LogChannel
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq.logs import Recording, RecordingWriter, read_recording
from refseq.logs.kinds import KINDS
from refseq.planar import Pose, motion_between
from refseq.view import Scan, View

quick = settings(derandomize=True)
METADATA = {"world": "hallway", "seed": "3", "config": '{"a": "ü"}'}
COUNT = 6


def drive() -> tuple[list[View], list[Pose]]:
    """Views with noise as images and scans, and the odometer's poses.

    The third view has no scan, the fourth one camera only.
    """
    rng = np.random.default_rng(5)
    views, odometry, pose = [], [], Pose(2.0, -1.0, 3.0)
    for k in range(COUNT):
        distance, turn = (0.0, 0.0) if k == 0 else (float(rng.uniform(-1, 1)), float(rng.uniform(-1, 1)))
        along = pose.heading + turn / 2
        pose = Pose(pose.x + distance * math.cos(along), pose.y + distance * math.sin(along), pose.heading + turn)
        images = {name: rng.integers(0, 256, (24, 32), np.uint8) for name in ("camera-1", "camera-2")[: 1 + (k != 3)]}
        ranges = np.where(rng.random(361) < 0.03, np.inf, rng.uniform(0, 80, 361)).astype(np.float32)
        scan = None if k == 2 else Scan(ranges)
        views.append(
            View(0.4 * k, images, scan, distance, turn, Pose(k + 0.5, float(rng.normal()), float(rng.uniform(-3, 3))))
        )
        odometry.append(pose)
    return views, odometry


@dataclass(frozen=True)
class Recorded:
    """A recording, what was put into it, and how long the file was after each view."""

    path: Path
    views: list[View]
    sizes: list[int]

    def __repr__(self) -> str:
        return f"Recorded({self.path})"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    views, odometry = drive()
    sizes = []
    with RecordingWriter(path, METADATA) as writer:
        for view, pose in zip(views, odometry, strict=True):
            writer.write(view, pose)
            sizes.append(writer.partial.stat().st_size)
    return Recorded(path, views, sizes)


def assert_same_view(read: View, written: View) -> None:
    assert read.time == pytest.approx(written.time, abs=1e-9)
    assert set(read.images) == set(written.images)
    for name, image in written.images.items():
        assert read.images[name].dtype == np.uint8
        np.testing.assert_array_equal(read.images[name], image)
    assert (read.scan is None) == (written.scan is None)
    if read.scan and written.scan:
        assert read.scan.ranges.dtype == np.float32
        assert read.scan.ranges.tobytes() == written.scan.ranges.tobytes()
        assert (read.scan.start, read.scan.step) == pytest.approx((written.scan.start, written.scan.step), abs=1e-12)
    assert (read.distance, read.turn) == pytest.approx((written.distance, written.turn), abs=1e-9)
    assert read.truth
    assert written.truth
    assert (read.truth.x, read.truth.y) == (written.truth.x, written.truth.y)
    assert read.truth.heading == pytest.approx(written.truth.heading, abs=1e-12)


def test_round_trip(recorded: Recorded) -> None:
    recording = read_recording(recorded.path)
    assert recording.complete
    assert recording.metadata == METADATA
    assert recording.skipped == {}
    assert recording.sensors == {"camera-1", "camera-2", "laser"}
    assert len(recording.views) == COUNT
    for read, written in zip(recording.views, recorded.views, strict=True):
        assert_same_view(read, written)


def changed(recorded: Recorded, content: bytes) -> tuple[Recording | None, str]:
    """What is read from a file of that content, or why it is refused."""
    path = recorded.path.with_name("changed.mcap")
    path.write_bytes(content)
    try:
        return read_recording(path), ""
    except LogError as error:
        return None, str(error).replace(str(path), "changed.mcap")


@quick
@given(share=st.floats(0, 1, exclude_max=True))
def test_a_cut_recording_is_a_prefix_of_the_views(recorded: Recorded, share: float) -> None:
    length = int(share * recorded.path.stat().st_size)
    recording, refusal = changed(recorded, recorded.path.read_bytes()[:length])
    written = sum(size <= length for size in recorded.sizes)
    if recording is None:
        assert written == 0
        assert refusal.startswith("changed.mcap: is ")
        assert "\n" not in refusal
        return
    assert not recording.complete
    assert recording.metadata == METADATA
    # Of a view whose chunk is whole only the chunk's index may be cut off.
    assert written <= len(recording.views) <= written + 1
    for read, view in zip(recording.views, recorded.views, strict=False):
        assert_same_view(read, view)


@quick
@given(share=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255))
def test_damage_is_found_and_costs_only_what_comes_after(recorded: Recorded, share: float, flip: int) -> None:
    content = bytearray(recorded.path.read_bytes())
    place = int(share * len(content))
    content[place] ^= flip
    recording, refusal = changed(recorded, bytes(content))
    if recording is None:
        assert place < recorded.sizes[0]
        assert refusal.startswith("changed.mcap: ")
        assert "\n" not in refusal
        return
    assert len(recording.views) >= sum(size <= place for size in recorded.sizes)
    for read, view in zip(recording.views, recorded.views, strict=False):
        assert_same_view(read, view)


def test_while_open_the_file_is_partial_and_readable(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"an older recording")
    views, odometry = drive()
    writer = RecordingWriter(path, METADATA)
    for count, (view, pose) in enumerate(zip(views[:3], odometry, strict=False), start=1):
        writer.write(view, pose)
        partial = read_recording(tmp_path / "run.partial.mcap")
        assert not partial.complete
        assert len(partial.views) == count
        assert path.read_bytes() == b"an older recording"
    writer.close()
    assert list(tmp_path.iterdir()) == [path]
    recording = read_recording(path)
    assert recording.complete
    assert len(recording.views) == 3


def test_an_interrupted_drive_is_kept(tmp_path: Path) -> None:
    views, odometry = drive()

    def interrupted() -> None:
        with RecordingWriter(tmp_path / "run.mcap", METADATA) as writer:
            writer.write(views[0], odometry[0])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    kept = read_recording(tmp_path / "run.partial.mcap")
    assert not kept.complete
    assert len(kept.views) == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "run.partial.mcap"]


def test_two_writers_do_not_mix(tmp_path: Path) -> None:
    views, odometry = drive()
    with RecordingWriter(tmp_path / "a.mcap", {}) as a, RecordingWriter(tmp_path / "b.mcap", {}) as b:
        a.write(views[0], odometry[0])
        b.write(views[1], odometry[1])
        b.write(views[2], odometry[2])
    assert [len(read_recording(tmp_path / name).views) for name in ("a.mcap", "b.mcap")] == [1, 2]


def write_foreign(path: Path, with_scan: bool) -> None:
    """A log of someone else: log lines, and perhaps a scan without odometry."""
    context = foxglove.Context()
    with foxglove.open_mcap(str(path), allow_overwrite=True, context=context):
        channel = LogChannel("/log", context=context)
        for k in range(3):
            channel.log(messages.Log(message=f"line {k}"), log_time=k)
        if with_scan:
            laser = foxglove.channels.LaserScanChannel("/front", context=context)
            laser.log(messages.LaserScan(start_angle=-1.0, end_angle=1.0, ranges=[1.0, 2.0, 3.0]), log_time=7)


def test_other_schemas_are_counted(tmp_path: Path) -> None:
    write_foreign(tmp_path / "log.mcap", with_scan=True)
    recording = read_recording(tmp_path / "log.mcap")
    assert recording.skipped == {"foxglove.Log": 3}
    (view,) = recording.views
    assert view.scan
    assert view.scan.bearings == pytest.approx([-1.0, 0.0, 1.0])
    assert (view.distance, view.truth) == (0.0, None)


def test_motion_comes_from_the_odometer_not_from_truth(tmp_path: Path) -> None:
    scan = Scan(np.ones(3, np.float32))
    odometry = [Pose(0, 0, 0), Pose(1, 0, 0.1)]
    with RecordingWriter(tmp_path / "run.mcap", {}) as writer:
        for k, pose in enumerate(odometry):
            writer.write(View(float(k), scan=scan, truth=Pose(5.0 * k, 0, 0)), pose)
    last = read_recording(tmp_path / "run.mcap").views[-1]
    assert (last.distance, last.turn) == pytest.approx(motion_between(*odometry))


def error_of(path: Path) -> str:
    with pytest.raises(LogError) as caught:
        read_recording(path)
    return str(caught.value)


def test_messages(tmp_path: Path, recorded: Recorded) -> None:
    path = tmp_path / "x.mcap"
    assert error_of(path) == f"{path}: cannot be read: No such file or directory"
    kinds = ", ".join(kind.name for kind in KINDS[:-1]) + f" and {KINDS[-1].name}"
    path.write_bytes(b"")
    assert error_of(path) == f"{path}: is empty; valid are {kinds}"
    path.write_bytes(b"\x7fELF\0\0")
    assert error_of(path) == f"{path}: is neither MCAP (its magic bytes are missing) nor text; valid are {kinds}"
    path.write_bytes(recorded.path.read_bytes()[:600])
    assert error_of(path) == (
        f"{path}: is cut off or damaged before its first view: unexpected end of file; "
        "valid is a recording of at least one view"
    )
    write_foreign(path, with_scan=False)
    assert error_of(path) == (
        f"{path}: holds no view: its topics are /log (3 foxglove.Log); valid is at least one camera or laser"
    )


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    path = tmp_path / "no" / "run.mcap"
    with pytest.raises(LogError) as caught:
        RecordingWriter(path, {})
    assert str(caught.value) == f"{path}: cannot be written: No such file or directory"


FULL = """
import resource, signal, sys
from pathlib import Path
from refseq.errors import LogError
from refseq.logs import RecordingWriter
from tests.refseq.logs.test_mcap import drive
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
try:
    with RecordingWriter(Path(sys.argv[1]), {"world": "a"}) as writer:
        for _ in range(20):
            for view, pose in zip(*drive()):
                writer.write(view, pose)
except LogError as error:
    print(error)
"""


def test_a_disk_that_is_full_is_told_and_leaves_what_could_be_written(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    assert write_on_a_full_disk(path, 100_000) == f"{path}: cannot be written: File too large\n"
    assert not path.exists()
    assert 0 < len(read_recording(tmp_path / "run.partial.mcap").views) < 20 * COUNT


def write_on_a_full_disk(path: Path, size: int) -> str:
    """The error of a drive that has no more room than ``size`` [bytes]; the library says nothing beside it."""
    # A process that may write no file of more than that stands for the disk: the system tells it the same.
    command = [sys.executable, "-c", FULL, path, str(size)]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    assert told.stderr == ""
    return told.stdout


@pytest.mark.parametrize("size", [0, 60, 300])
def test_of_a_drive_that_a_full_disk_has_no_room_to_begin_nothing_stays(tmp_path: Path, size: int) -> None:
    """The head of the file, its metadata, the first view."""
    path = tmp_path / "run.mcap"
    assert write_on_a_full_disk(path, size) == f"{path}: cannot be written: File too large\n"
    assert list(tmp_path.iterdir()) == []


def test_neither_a_planted_link_nor_a_file_of_that_name_is_written_to(tmp_path: Path) -> None:
    views, odometry = drive()
    (tmp_path / "run.partial.mcap").write_text("my own")
    (tmp_path / "run.partial-2.mcap").symlink_to(tmp_path / "elsewhere")
    with RecordingWriter(tmp_path / "run.mcap", METADATA) as writer:
        assert writer.partial == tmp_path / "run.partial-3.mcap"
        writer.write(views[0], odometry[0])
    assert read_recording(tmp_path / "run.mcap").complete
    assert (tmp_path / "run.partial.mcap").read_text() == "my own"
    assert {path.name for path in tmp_path.iterdir()} == {"run.mcap", "run.partial.mcap", "run.partial-2.mcap"}


def test_a_drive_lies_where_a_link_leads_to_and_its_partial_file_beside_that(tmp_path: Path) -> None:
    views, odometry = drive()
    (disk := tmp_path / "disk").mkdir()
    (link := tmp_path / "run.mcap").symlink_to("disk/today.mcap")
    with RecordingWriter(link, METADATA) as writer:
        assert writer.partial == disk / "today.partial.mcap"
        writer.write(views[0], odometry[0])
    assert link.is_symlink()
    assert read_recording(disk / "today.mcap").complete
    assert len(list(disk.iterdir())) == 1


def test_what_could_not_be_finished_does_not_get_its_name_when_it_is_closed_again(tmp_path: Path) -> None:
    views, odometry = drive()
    writer = RecordingWriter(tmp_path / "run.mcap", METADATA)
    writer.write(views[0], odometry[0])
    writer._file.close()  # as a disk that takes no more
    with pytest.raises(LogError, match="cannot be written"):
        writer.close()
    writer.close()
    assert not (tmp_path / "run.mcap").exists()
    writer.discard()
    assert list(tmp_path.iterdir()) == []
