from dataclasses import replace
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import Stage
from refseq.errors import LogError
from refseq.logs import Recording, open_log, read_recording
from refseq.logs.formats import DriveFormat, output_format
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.view import LASER, View
from refseq_bench import robots
from refseq_bench.scenarios.drives.drive import Drive, check_sensors
from refseq_bench.scenarios.drives.record import Progress, open_bench, record
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.drives.recorder import drive_and_sense, operator_for
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.errors import StuckError
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser_model import RangeMode
from tests.worlds.conftest import SMALL

needs_vulkan = pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device on this machine")
STEPS = Trigger(distance=0.4)


@pytest.fixture
def plan(tmp_path: Path) -> str:
    """Path of a short corridor's plan."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL.format(top="", end=""))
    return str(path)


@pytest.fixture
def blind(plan: str) -> Drive:
    """A drive of 6 m that records the laser only."""
    return Drive(world=plan, renderer=RendererKind.NONE, trigger=STEPS)


def same(one: View, other: View) -> bool:
    assert one.scan is not None
    assert other.scan is not None
    poses = (one.time, one.distance, one.turn, one.truth) == (other.time, other.distance, other.turn, other.truth)
    return poses and one.scan.ranges.tobytes() == other.scan.ranges.tobytes()


@pytest.mark.quick_cases("mcap")
@pytest.mark.parametrize("form", DriveFormat)
def test_what_is_returned_is_what_the_file_holds(blind: Drive, tmp_path: Path, form: DriveFormat) -> None:
    path = tmp_path / "new" / "folder" / "drive.mcap"
    recording = record(blind, path, form=output_format(form))
    read = read_recording(path)
    assert read.complete
    assert dict(read.metadata) == dict(recording.metadata)
    assert len(read.views) == len(recording.views) > 10
    for view, other in zip(recording.views, read.views, strict=True):
        assert view.scan is not None
        assert other.scan is not None
        assert np.array_equal(view.scan.ranges, other.scan.ranges)
        assert view.distance == pytest.approx(other.distance, abs=1e-9)
    assert [file.name for file in path.parent.iterdir()] == ["drive.mcap"]


def test_the_scans_of_a_long_drive_are_not_held(blind: Drive, tmp_path: Path) -> None:
    recording = record(blind, tmp_path / "drive.mcap", whole=False)
    written = read_recording(tmp_path / "drive.mcap").views
    assert [view.scan is not None for view in recording.views] == [True] + [False] * (len(written) - 1)
    assert all(view.scan is not None for view in written)
    assert recording.sensors == {LASER}


def test_equal_drives_give_equal_recordings_and_beliefs_bit_for_bit(blind: Drive, tmp_path: Path) -> None:
    runs: list[Recording] = [record(blind, tmp_path / f"{k}.mcap") for k in range(2)]
    assert all(same(one, other) for one, other in zip(runs[0].views, runs[1].views, strict=True))
    sequences = [learn(run.views, features=("walls", "boundary", "sectors")) for run in runs]
    beliefs = [localise(sequence, run.views, seed=3) for sequence, run in zip(sequences, reversed(runs), strict=True)]
    for stage in Stage:
        for one, other in zip(beliefs[0][stage], beliefs[1][stage], strict=True):
            assert one.places.tobytes() == other.places.tobytes()
            assert (one.lost, one.best, one.path, one.entropy) == (other.lost, other.best, other.path, other.entropy)


def test_another_seed_gives_another_drive(plan: str, tmp_path: Path) -> None:
    one, other = (
        record(Drive(world=plan, renderer=RendererKind.NONE, seed=seed), tmp_path / f"{seed}.mcap") for seed in (1, 2)
    )
    assert [view.truth for view in one.views] != [view.truth for view in other.views]


def test_a_change_is_drawn_from_the_drives_seed_or_its_own_and_told(blind: Drive, tmp_path: Path) -> None:
    busy = replace(blind, change="people=1", seed=4)
    plans = []
    for drive in (busy, replace(busy, change_seed=4), replace(busy, change_seed=9), replace(busy, change="none")):
        with open_bench(drive) as bench:
            plans.append(bench.world.plan.person)
    assert plans[0] == plans[1] != plans[2]
    assert plans[3] == ()
    metadata = record(replace(busy, trigger=Trigger(distance=4.0)), tmp_path / "busy.mcap").metadata
    assert (metadata["change"], metadata["change_seed"]) == ("people=1.0", "4")


def test_the_near_mode_of_the_laser_ends_at_8_metres(blind: Drive) -> None:
    reach = []
    for mode in RangeMode:
        with open_bench(replace(blind, world="hallway", laser=mode)) as bench:
            scan = bench.sense().scan
            assert scan is not None
            reach.append(float(scan.ranges[np.isfinite(scan.ranges)].max()))
    near, far = reach
    assert near < 8.19 < far


@needs_vulkan
def test_the_same_seed_gives_the_same_pictures_within_one_grey_level(plan: str) -> None:
    pictures = []
    for _ in range(2):
        with open_bench(Drive(world=plan, trigger=STEPS)) as bench:
            taken = islice(drive_and_sense(bench, operator_for(bench, 1), STEPS), 3)
            pictures.append([image.astype(int) for one in taken for image in one.view.images.values()])
    assert len(pictures[0]) == 3 * 2
    assert all(picture.std() > 1 for picture in pictures[0]), "noise alone differs from pixel to pixel"
    assert max(int(np.abs(a - b).max()) for a, b in zip(*pictures, strict=True)) <= 1


@needs_vulkan
def test_only_the_sensors_asked_for_are_recorded_and_a_camera_takes_the_same_pictures_alone(plan: str) -> None:
    pictures = []
    for sensors in (("camera-2",), None):
        with open_bench(Drive(world=plan, trigger=STEPS, sensors=sensors)) as bench:
            pictures.append(bench.sense().images)
    assert set(pictures[0]) == {"camera-2"}
    assert set(pictures[1]) == {"camera-1", "camera-2"}
    assert np.abs(pictures[0]["camera-2"].astype(int) - pictures[1]["camera-2"]).max() <= 1


@pytest.mark.skipif(gl_backend() is None, reason="no EGL or OSMesa on this machine")
def test_without_a_camera_nothing_is_rendered_and_without_the_laser_there_is_no_scan(plan: str, tmp_path: Path) -> None:
    with open_bench(Drive(world=plan, sensors=("laser",))) as bench:
        assert bench.renderer.kind is RendererKind.NONE
    short = Trigger(distance=4.0)
    alone = Drive(world=plan, renderer=RendererKind.CLASSIC, trigger=short, sensors=("camera-1",))
    assert record(alone, tmp_path / "images.mcap").sensors == {"camera-1"}


def test_a_sensor_that_the_robot_has_not_is_told_with_those_that_it_has() -> None:
    with pytest.raises(
        ScenarioError, match=r"^sensor 'sonar' is not on robot 'robuter'; valid are camera-1, camera-2, laser$"
    ):
        check_sensors(("laser", "sonar"), robots.load("robuter"))


def test_nothing_to_record_is_refused_and_leaves_nothing(plan: str, tmp_path: Path) -> None:
    drive = Drive(world=plan, renderer=RendererKind.NONE, sensors=("camera-1",))
    with pytest.raises(ScenarioError, match="renderer 'none' takes no images"):
        record(drive, tmp_path / "x" / "drive.mcap")
    assert not (tmp_path / "x").exists()


def test_a_folder_in_the_recordings_place_is_told_and_left_alone(blind: Drive, tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    path.mkdir()
    with pytest.raises(LogError, match=r"drive.mcap: is a folder; valid is the name of a recording to write$"):
        record(blind, path)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["drive.mcap", "small.toml"]


def test_a_file_in_the_folders_place_is_told(blind: Drive, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(ScenarioError, match=r"taken/drive.mcap: cannot be written: .*taken: File exists$"):
        record(blind, tmp_path / "taken" / "drive.mcap")


def test_a_recording_lies_where_a_link_leads_to_in_a_folder_that_is_made(blind: Drive, tmp_path: Path) -> None:
    (tmp_path / "drive.mcap").symlink_to("disk/today.mcap")
    record(blind, tmp_path / "drive.mcap")
    assert [file.name for file in (tmp_path / "disk").iterdir()] == ["today.mcap"]


def stop_at(count: int, error: BaseException) -> Progress:
    def progress(along: float, length: float | None, views: int) -> None:
        if views == count:
            raise error

    return progress


@pytest.mark.quick_cases("StuckError-mcap", "KeyboardInterrupt-rosbag2")
@pytest.mark.parametrize("form", DriveFormat)
@pytest.mark.parametrize("error", [KeyboardInterrupt, StuckError])
def test_a_drive_that_ends_before_its_time_lies_beside_the_older_one_and_says_so(
    blind: Drive, tmp_path: Path, form: DriveFormat, error: type[BaseException]
) -> None:
    path = tmp_path / "drive"
    record(blind, path, form=output_format(form))
    before = content_of(path)
    with pytest.raises(error) as caught:
        record(blind, path, stop_at(4, error("the robot is\nstuck")), form=output_format(form))
    assert content_of(path) == before
    assert read_recording(path).complete
    partial = tmp_path / ("drive.partial.mcap" if form is DriveFormat.MCAP else "drive.partial/drive")
    told = f"{path} stays as it was; {partial} holds 4 views, incomplete: use it as it is, or record again"
    assert caught.value.__notes__ == [told]
    read = read_recording(partial)
    assert not read.complete
    assert len(read.views) == 4
    assert read.metadata["robot"] == "robuter"
    assert read.metadata["cause"] == ("the robot is stuck" if error is StuckError else "interrupted")
    assert abs((datetime.now(UTC) - datetime.fromisoformat(read.metadata["ended"][:19] + "+00:00")).seconds) < 600
    source = open_log(partial)
    list(source.samples())
    assert source.damage == f"{read.metadata['cause']}, {read.metadata['ended']}"


def content_of(path: Path) -> dict[str, bytes]:
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    return {file.name: file.read_bytes() for file in files}


def test_an_interruption_before_the_first_view_keeps_what_was_there(
    blind: Drive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(bench: Bench) -> View:
        raise KeyboardInterrupt

    path = tmp_path / "drive.mcap"
    path.write_text("an older recording")
    monkeypatch.setattr(Bench, "sense", interrupted)
    with pytest.raises(KeyboardInterrupt) as stop:
        record(blind, path)
    assert stop.value.__notes__ == [f"{path} is not written"]
    assert path.read_text() == "an older recording"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["drive.mcap", "small.toml"]


def test_progress_is_told_at_every_view_and_rises_to_the_end(blind: Drive, tmp_path: Path) -> None:
    told: list[tuple[float, float, int]] = []
    recording = record(blind, tmp_path / "drive.mcap", lambda *what: told.append(what))
    along, lengths, views = zip(*told, strict=True)
    assert views == tuple(range(1, len(recording.views) + 1))
    assert list(along) == sorted(along)
    assert set(lengths) == {6.0}
    assert 5.0 < along[-1] <= 6.0
