"""Views of a map found again in its recording: of one that was thinned, and read with options of its own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from refseq.map.map import Map, beside
from refseq.planar import Pose
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.drives.learnt_views import place_views, read_comparison, reading_notes
from refseq_bench.scenarios.errors import ScenarioError
from tests.refseq.logs.foreign import write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive
from tests.refseq.rooms import named_maps
from tests.refseq.viewer.readback import entities
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

THIN = 0.8
CAMERA = "/camera/image_raw/compressed"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_rosbag2(tmp_path_factory.mktemp("bags") / "bag", RobotDrive(seconds=4.0))


def map_of(bag: Path, selection: DriveSelection) -> Map:
    drive = read_drive(bag, selection)
    return learn(drive.views, features=["walls", "dense"], metadata=reading_notes(selection), name="there")


@pytest.mark.parametrize(
    "selection",
    [
        DriveSelection(thin=THIN),
        DriveSelection(thin=THIN, noise_seed=3, views="5:30"),
        DriveSelection(thin=THIN, topics=f"front={CAMERA}", late="front=0.04,laser=-0.01", tolerance=0.03),
    ],
)
def test_each_place_has_the_pictures_that_it_was_learnt_from(bag: Path, selection: DriveSelection) -> None:
    learnt, drive = map_of(bag, selection), read_drive(bag, selection)
    found = place_views(learnt, Path("map.refseq"), bag)
    assert len(found) == len(drive.views) == len(learnt)
    for one, view in zip(found, drive.views, strict=True):
        assert (one.time, one.sensors, one.truth) == (view.time, view.sensors, view.truth)
        assert all((one.images[name] == image).all() for name, image in view.images.items())
        assert one.distance == pytest.approx(view.distance)


def test_a_map_notes_no_late_truth() -> None:
    """Truth may have come from a file, and be of no log that the places are found in again."""
    assert reading_notes(DriveSelection(late="truth=3.7")) == {}
    assert reading_notes(DriveSelection(late="laser=0.125,truth=3.7")) == {"read_with_late": "laser=0.125"}


def test_true_poses_are_those_of_the_map(tmp_path: Path) -> None:
    """They may have come from a file, which the recording does not know."""
    views = corridor_drive(np.random.default_rng(1), count=4, size=24)
    learnt = learn(views)
    with RecordingWriter(tmp_path / "blind.mcap", {}) as writer:
        for number, view in enumerate(views):
            writer.write(replace(view, truth=None), Pose(float(number), 0.0, 0.0))
    found = place_views(learnt, Path("map.refseq"), tmp_path / "blind.mcap")
    assert tuple(view.truth for view in found) == learnt.poses
    assert all(pose is not None for pose in learnt.poses)


def test_recordings_and_maps_without_those_views_are_told(bag: Path) -> None:
    learnt = map_of(bag, DriveSelection(thin=THIN))
    path = learnt.paths[0]
    old = replace(learnt, paths=(replace(path, times=np.zeros(0)),))
    other = replace(learnt, paths=(replace(path, times=path.times + 0.05),))
    both = beside(named_maps(["there", "again"], [learnt, learnt]))
    for map_, told in (
        (
            old,
            rf"views, the map {len(learnt)} places and no times of them, as maps of earlier versions have none; vali",
        ),
        (other, rf"has no view at \d+\.\d+ s, as view 0 of the map's {len(learnt)} is; valid is the recording that"),
        (both, r"bag: has the pictures of one drive, map.refseq is a map of several; valid is no reference"),
        (
            learnt.noted({"read_with_tolerance": "much"}),
            "there: its map notes a tolerance of 'much'; valid is a number",
        ),
    ):
        with pytest.raises(ScenarioError, match=told):
            place_views(map_, Path("map.refseq"), bag)
    whole = map_of(bag, DriveSelection())
    old = replace(whole, paths=(replace(whole.paths[0], times=np.zeros(0)),))
    assert len(place_views(old, Path("map.refseq"), bag)) == len(whole)


def test_the_commands_ask_no_option_for_the_first_drive(refseq: Refseq, bag: Path, tmp_path: Path) -> None:
    """``learn`` notes in the map how it read the drive; ``read_comparison`` is what ``report`` begins with."""
    map_file, beliefs, show = (tmp_path / name for name in ("map.refseq", "b.parquet", "show.rrd"))
    options = f"--topics front={CAMERA} --late front=0.04"
    learning = f"{options} --thin {THIN} --features dense --sensors front"
    assert refseq("learn", bag, *learning.split(), "-o", map_file).code == 0
    assert (
        refseq("localise", map_file, bag, *options.split(), "--thin", "2", "--stage", "uniform", "-o", beliefs).code
        == 0
    )
    assert refseq("view", map_file, "--reference", bag, "-o", show).code == 0
    assert {"/map/places/frames/front"} <= entities(show)
    found = read_comparison(map_file, bag, beliefs, bag, DriveSelection(late="camera=0.04"))
    assert all("front" in view.images for view in found.reference_views)
    assert len(found.reference_views) == len(Map.load(map_file)) > len(found.query_views)
