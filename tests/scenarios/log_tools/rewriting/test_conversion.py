"""Converted logs, read back: nothing that a format has a place for may be lost on the way."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.errors import LogError
from refseq.logs import RecordingWriter, open_log, plan_views, read_recording
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.rewriting.conversion import LogFormat, convert, format_of, odometer
from tests.refseq.logs.foreign import write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive
from tests.support import corridor_drive

NAMES = {LogFormat.MCAP: "out.mcap", LogFormat.ROSBAG2: "out", LogFormat.CARMEN: "out.clf"}


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return write_rosbag2(tmp_path_factory.mktemp("log") / "in", RobotDrive(seconds=5.0, drift=0.02))


@pytest.fixture(scope="module")
def views(bag):
    return read_recording(bag).views


@pytest.mark.parametrize("form", NAMES)
def test_a_conversion_keeps_motion_truth_scans_and_pictures(form, bag, views, tmp_path):
    target = tmp_path / NAMES[form]
    done = convert(plan_views(open_log(bag)), target, form, {"source": "in"})
    found = read_recording(target)
    assert done.views == len(found.views) == len(views)
    assert found.metadata["source"] == "in"
    exact = 1e-6 if form is not LogFormat.CARMEN else 0.006  # CARMEN's ranges are in centimetres
    for before, after in zip(views, found.views, strict=True):
        assert after.time == pytest.approx(before.time, abs=1e-5)
        assert (after.distance, after.turn) == pytest.approx((before.distance, before.turn), abs=1e-5)
        assert (after.truth.x, after.truth.y) == pytest.approx((before.truth.x, before.truth.y), abs=1e-5)
        if before.scan is not None:
            near = before.scan.ranges < 80
            assert after.scan.ranges[near] == pytest.approx(before.scan.ranges[near], abs=exact)
    assert done.left_out == (("pictures of camera",) if form is LogFormat.CARMEN else ())
    if form is not LogFormat.CARMEN:
        for before, after in zip(views, found.views, strict=True):
            assert all((after.images[name] == before.images[name]).all() for name in before.images)


def test_carmen_tells_what_it_has_no_place_for(tmp_path):
    with RecordingWriter(tmp_path / "in.mcap", {"world": "hallway", "notes": "two cups \n of tea"}) as writer:
        for view, pose in odometer(corridor_drive(np.random.default_rng(0), count=5, size=48)):
            writer.write(replace(view, behaviour="MN:5"), pose)
    done = convert(plan_views(open_log(tmp_path / "in.mcap")), tmp_path / "out.clf", LogFormat.CARMEN, {})
    assert "behaviours" in done.left_out
    (blanks,) = (words for words in done.left_out if "metadata" in words)
    assert blanks == "blanks and line ends in the metadata's notes, now underscores"
    assert open_log(tmp_path / "out.clf").metadata["notes"] == "two_cups_of_tea"


def test_poses_alone_need_no_picture(bag, views, tmp_path):
    convert(plan_views(open_log(bag)), tmp_path / "out.tum", LogFormat.TUM, {})
    table = np.loadtxt(tmp_path / "out.tum")
    assert table.shape == (len(views), 8)
    steps = np.hypot(*np.diff(table[:, 1:3], axis=0).T)
    assert steps == pytest.approx([abs(view.distance) for view in views[1:]], abs=1e-5)


def test_true_poses_do_where_there_is_no_odometry(tmp_path):
    drive = RobotDrive(seconds=3.0, odometry_rate=0.0)
    plan = plan_views(open_log(write_rosbag2(tmp_path / "in", drive)))
    assert not plan.findings.odometry
    convert(plan, tmp_path / "out.tum", LogFormat.TUM, {})
    assert len(np.loadtxt(tmp_path / "out.tum")) == len(plan.views)


def test_a_log_without_poses_is_no_trajectory(tmp_path):
    plan = plan_views(
        open_log(write_rosbag2(tmp_path / "in", RobotDrive(seconds=3.0, odometry_rate=0.0, truth_rate=0)))
    )
    with pytest.raises(ScenarioError, match="has no poses; valid for tum is a log with odometry or truth"):
        convert(plan, tmp_path / "out.tum", LogFormat.TUM, {})


def test_thinned_views_are_those_that_are_written(bag, tmp_path):
    plan = plan_views(open_log(bag)).thinned(0.5)
    convert(plan, tmp_path / "out.mcap", LogFormat.MCAP, {})
    steps = [view.distance for view in read_recording(tmp_path / "out.mcap").views]
    assert min(itertools.islice(steps, 1, None)) >= 0.49


@pytest.mark.parametrize("form", [LogFormat.MCAP, LogFormat.ROSBAG2])
def test_nothing_is_left_of_a_conversion_that_fails(form, bag, tmp_path, monkeypatch):
    plan = plan_views(open_log(bag))

    def broken(plan):
        yield plan.views[0]
        raise LogError("a picture is damaged")

    monkeypatch.setattr(type(plan), "read", broken)
    with pytest.raises(LogError, match="damaged"):
        convert(plan, tmp_path / NAMES[form], form, {})
    assert list(tmp_path.iterdir()) == []


def test_the_format_is_that_of_the_name_unless_it_is_asked_for(tmp_path):
    assert format_of(tmp_path / "out.MCAP", None) is LogFormat.MCAP
    assert format_of(tmp_path / "out", "rosbag2") is LogFormat.ROSBAG2
    with pytest.raises(ScenarioError, match="its name tells no format"):
        format_of(tmp_path / "out", None)
    with pytest.raises(ScenarioError, match="format 'ply' is unknown"):
        format_of(tmp_path / "out", "ply")


@pytest.mark.parametrize(
    ("name", "form", "told"),
    [
        ("out.mcap", "tum", "its name tells mcap, --format tum; valid is a name that ends in .tum"),
        ("out.tum", "carmen", "its name tells tum, --format carmen; valid is a name that ends in .log, .clf, .carmen"),
        ("out.mcap", "rosbag2", "its name tells mcap, --format rosbag2; valid is a name without an ending"),
    ],
)
def test_a_name_that_tells_another_format_is_refused(name, form, told):
    with pytest.raises(ScenarioError) as caught:
        format_of(Path(name), form)
    assert str(caught.value) == f"{name}: {told}"


@pytest.mark.parametrize("form", NAMES)
def test_what_is_made_of_a_log_that_was_cut_off_is_incomplete_too(form, bag, tmp_path):
    convert(plan_views(open_log(bag)), tmp_path / "whole.mcap", LogFormat.MCAP, {})
    content = (tmp_path / "whole.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(content[: len(content) // 2])
    convert(plan_views(open_log(tmp_path / "cut.mcap")), tmp_path / NAMES[form], form, {})
    made = open_log(tmp_path / NAMES[form])
    assert not made.complete
    assert made.damage.replace("_", " ") == "unexpected end of file"
