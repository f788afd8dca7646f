import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import RrdReader

from refseq.view import View
from refseq.viewer.recording import write_recording
from refseq.viewer.timelines import TimePoint, set_time_point, time_points_of
from tests.refseq.viewer.readback import same, verified

pytestmark = pytest.mark.filterwarnings("error")  # Rerun only warns about data that it cannot take


class Numbers:
    """A tab with one line."""

    def __init__(self, name: str, count: int = 3) -> None:
        self.name = name
        self.count = count

    def layout(self) -> rrb.Container:
        return rrb.Horizontal(rrb.TimeSeriesView(origin=f"{self.name}/line"))

    def send(self, stream: rr.RecordingStream) -> None:
        for number in range(self.count):
            set_time_point(stream, TimePoint(number, 2.0 * number, 0.85 * number))
            stream.log(f"{self.name}/line", rr.Scalars(number))


def test_every_tab_is_in_one_recording_with_one_layout(tmp_path: Path) -> None:
    path = tmp_path / "two.rrd"
    write_recording(path, [Numbers("one"), Numbers("other")], name="two tabs")
    reader = RrdReader(path)
    assert len(reader.recordings()) == len(reader.blueprints()) == 1
    assert {"/one/line", "/other/line"} <= {chunk.entity_path for chunk in reader.stream()}
    assert verified(path)


def test_same_input_twice_compares_equal(tmp_path: Path) -> None:
    for name in ("a.rrd", "b.rrd"):
        write_recording(tmp_path / name, [Numbers("one", 50), Numbers("other")], name="twice")
    write_recording(tmp_path / "c.rrd", [Numbers("one", 49), Numbers("other")], name="twice")
    assert same(tmp_path / "a.rrd", tmp_path / "b.rrd")
    assert not same(tmp_path / "a.rrd", tmp_path / "c.rrd")


def test_three_time_lines_tell_the_same_moments(tmp_path: Path) -> None:
    write_recording(tmp_path / "a.rrd", [Numbers("one")], name="times")
    (chunk,) = [c for c in RrdReader(tmp_path / "a.rrd").stream() if c.entity_path == "/one/line"]
    batch = chunk.to_record_batch()
    assert batch.column("view").to_pylist() == [0, 1, 2]
    assert [time.total_seconds() for time in batch.column("time").to_pylist()] == [0.0, 2.0, 4.0]
    assert batch.column("distance_cm").to_pylist() == [0, 85, 170]


def test_a_robot_that_reverses_travels_on() -> None:
    drive = [View(0.0, distance=9.0), View(2.0, distance=1.0), View(5.0, distance=-0.5)]
    assert list(time_points_of(drive)) == [TimePoint(0, 0.0, 0.0), TimePoint(1, 2.0, 1.0), TimePoint(2, 5.0, 1.5)]


def test_a_tab_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    class Failing(Numbers):
        def send(self, stream: rr.RecordingStream) -> None:
            raise ValueError("no")

    path = tmp_path / "old.rrd"
    path.write_bytes(b"old")
    with pytest.raises(ValueError, match="no"):
        write_recording(path, [Failing("bad")], name="bad")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("room", [0, 50, 4000, -200])  # [bytes]: before its header, behind it, in its data, in its end
def test_file_that_a_disk_has_no_room_for_leaves_the_older_one(tmp_path: Path, room: int) -> None:
    path, tabs = tmp_path / "a.rrd", [Numbers("one", 500)]
    write_recording(path, tabs, name="full")
    older = path.read_bytes()
    with no_file_over(room % len(older)), pytest.raises(OSError, match="File too large"):
        write_recording(path, tabs, name="full")
    assert path.read_bytes() == older
    assert [file.name for file in tmp_path.iterdir()] == ["a.rrd"]


@contextmanager
def no_file_over(size: int) -> Iterator[None]:
    """Within it this process writes no file of more than ``size`` bytes."""
    told = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, told)
