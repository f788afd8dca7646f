"""Views of a log whose sensors have clocks and rates of their own, against the drive as a function of time."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from refseq.errors import LogError
from refseq.logs import PairingOptions, RecordingWriter, open_log, plan_views, read_recording
from refseq.logs.decoding.picture import CompressedPicture
from refseq.logs.pairing.moments import Moments
from refseq.logs.pairing.schedule import Schedule
from refseq.logs.recording import TimedData
from refseq.logs.trajectories import read_trajectory
from refseq.logs.trajectory import Trajectory
from refseq.map.learning import learn
from refseq.planar import Pose, after_motion, motion_between
from refseq.view import Scan, View
from tests.refseq.logs.foxglove_drive import BEARINGS, TOPICS, FoxgloveSetup, write_foxglove, write_json
from tests.refseq.logs.robot_drive import RobotDrive, Sense

DRIVE = RobotDrive(seconds=8.0)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_foxglove(tmp_path_factory.mktemp("logs") / "drive.mcap", DRIVE)


def assert_as_driven(views: tuple[View, ...], drive: RobotDrive, at_rest: float = 0.01) -> None:
    """Each view holds what there was to see at its time, and where the robot was."""
    for view in views:
        truth = drive.pose(view.time)
        np.testing.assert_array_equal(view.images["cam0"], drive.picture(view.time))
        assert view.truth
        assert motion_between(truth, view.truth) == pytest.approx((0, 0), abs=at_rest)
    for before, view in pairwise(views):
        expected = motion_between(drive.odometry(before.time), drive.odometry(view.time))
        assert (view.distance, view.turn) == pytest.approx(expected, abs=2e-3)


def test_views_are_taken_at_the_camera_s_times_with_motion_interpolated(log: Path) -> None:
    recording = read_recording(log)
    assert_as_driven(recording.views[2:-2], DRIVE)
    assert sum(view.distance for view in recording.views) == pytest.approx(0.8 * 7.9, abs=0.1)
    assert recording.has_odometry
    findings = recording.findings
    assert findings
    assert findings.leading == TOPICS[Sense.PICTURE]
    assert findings.odometry == "topic /odom"
    assert findings.views == len(recording.views)


def test_a_scan_belongs_to_the_view_that_is_nearest(log: Path) -> None:
    stamps = np.array([moment.time for moment in DRIVE.moments if moment.sense is Sense.SCAN])
    views = read_recording(log).views
    assert sum(view.scan is not None for view in views) > 0.95 * len(views)
    for view in views[1:-1]:
        assert view.scan is not None
        nearest = stamps[np.abs(stamps - view.time).argmin()]
        np.testing.assert_allclose(view.scan.ranges, DRIVE.ranges(nearest, BEARINGS), rtol=1e-6)


def test_each_sample_goes_to_one_view_and_a_tolerance_keeps_far_ones_out(log: Path) -> None:
    views = read_recording(log, PairingOptions(tolerance=0.01)).views
    assert all(view.scan is None for view in views)  # the laser comes 37 ms later, or 63 earlier
    fast = read_recording(log, PairingOptions(leading="laser")).views
    assert sum(view.scan is not None for view in fast) == 80


def test_late_stamps_are_set_back_before_sensors_are_paired(log: Path) -> None:
    pictures = {round(view.time - 0.3, 4): view.images["cam0"] for view in read_recording(log).views}
    views = [view for view in read_recording(log, PairingOptions(late={"cam0": 0.3})).views if view.images]
    assert len(views) > 70
    for view in views[1:]:
        np.testing.assert_array_equal(view.images["cam0"], pictures[round(view.time, 4)])
        assert view.truth
        assert motion_between(DRIVE.pose(view.time), view.truth) == pytest.approx((0, 0), abs=0.01)
        assert view.scan is not None
        assert np.abs(view.scan.ranges - DRIVE.ranges(view.time, BEARINGS)).mean() < 0.1


def test_a_map_of_an_asynchronous_log_is_as_long_as_the_way(log: Path) -> None:
    recording = read_recording(log, thin=0.5)
    map_ = learn(recording.views, features=["sectors", "boundary"])
    assert len(map_) == pytest.approx(0.8 * 7.9 / 0.5, abs=2)
    assert map_.paths[0].length == pytest.approx(0.8 * 7.9, abs=0.6)


def test_json_gives_the_same_views_as_protobuf(log: Path, tmp_path: Path) -> None:
    same = read_recording(write_json(tmp_path / "drive.mcap", DRIVE)).views
    for one, other in zip(read_recording(log).views, same, strict=True):
        assert (one.time, one.distance, one.turn) == (other.time, other.distance, other.turn)
        assert one.truth == other.truth
        np.testing.assert_array_equal(one.images["cam0"], other.images["cam0"])
        assert (one.scan is None) == (other.scan is None)
        if one.scan and other.scan:
            np.testing.assert_array_equal(one.scan.ranges, other.scan.ranges)


def test_only_pictures_that_thinning_keeps_are_decoded(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decoded = []
    plain = CompressedPicture.decode

    def counted(picture: CompressedPicture) -> object:
        decoded.append(picture)
        return plain(picture)

    monkeypatch.setattr(CompressedPicture, "decode", counted)
    plan = plan_views(open_log(log))
    assert (len(plan), decoded) == (pytest.approx(80, abs=2), [])
    views = tuple(plan.thinned(1.0).read())
    assert decoded == []
    assert all(dict(view.images) for view in views)
    assert len(decoded) == len(views) < 10


def test_thinning_the_plan_is_thinning_the_views(log: Path) -> None:
    from refseq.logs.thin import every

    thinned = read_recording(log, views=slice(5, 70), thin=0.7).views
    for one, other in zip(thinned, every(read_recording(log).views[5:70], 0.7), strict=True):
        assert replace(one, images={}, scan=None) == replace(other, images={}, scan=None)
        np.testing.assert_array_equal(one.images["cam0"], other.images["cam0"])


def test_views_are_found_again_by_their_times(log: Path) -> None:
    plan = plan_views(open_log(log)).between(slice(5, 70))
    thinned = plan.with_noise(np.random.default_rng(3)).thinned(0.7)  # not those that thinning alone would keep
    kept = [plan.views.index(one) for view in thinned.views for one in plan.views if one.time == view.time]
    found = plan_views(open_log(log)).at([view.time for view in thinned.views])
    for number, view in enumerate(found.views):
        between = plan.views[kept[number - 1] + 1 : kept[number] + 1] if number else ()
        assert view.time == thinned.views[number].time
        assert view.distance == pytest.approx(sum(one.distance for one in between))
        assert view.turn == pytest.approx(sum(one.turn for one in between))
    seen = [view.images["cam0"] for view in thinned.read()]
    for view, image in zip(found.read(), seen, strict=True):
        np.testing.assert_array_equal(view.images["cam0"], image)


@pytest.mark.parametrize("times", [[-1.0], [1e9], "twice", "back"])
def test_a_time_at_which_nothing_was_seen_is_refused(log: Path, times: list[float] | str) -> None:
    plan = plan_views(open_log(log))
    first, second = (view.time for view in plan.views[:2])
    asked = {"twice": [first, first], "back": [second, first]}.get(times, times) if isinstance(times, str) else times
    with pytest.raises(LogError, match=r"has no view \d at .* s; valid are beliefs of views of this log"):
        plan.at(asked)


def test_transforms_stand_for_odometry(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "tf.mcap", DRIVE, FoxgloveSetup(tf=True))
    recording = read_recording(path)
    assert recording.findings
    assert recording.findings.odometry == "transforms odom → base_link"
    assert_as_driven(recording.views[2:-2], DRIVE)


def test_stamps_of_zero_are_told_and_the_log_time_stands_for_them(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "zero.mcap", DRIVE, FoxgloveSetup(stamped=False))
    recording = read_recording(path)
    logged = [moment.logged for moment in DRIVE.moments if moment.sense is Sense.PICTURE]
    assert [view.time for view in recording.views[1:-1]] == pytest.approx(logged[1:-1], abs=1e-6)
    assert recording.findings
    assert {found.unstamped for found in recording.findings.channels.values()} == {80, 160, 40}


def test_a_log_without_odometry_is_said_to_be_one(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "still.mcap", DRIVE, FoxgloveSetup(odometry=False, truth=False))
    recording = read_recording(path)
    assert not recording.has_odometry
    assert not any(view.has_odometry or view.distance for view in recording.views)
    with pytest.raises(LogError, match=r"still\.mcap: has no odometry to thin by; valid are all its views, or"):
        read_recording(path, thin=0.5)


def test_a_trajectory_from_elsewhere_is_odometry_or_truth(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "still.mcap", DRIVE, FoxgloveSetup(odometry=False, truth=False))
    times = DRIVE.start + np.arange(0, 8, 0.02)
    way = Trajectory.of(times, [DRIVE.pose(time) for time in times])
    views = read_recording(path, odometry=way, truth=way).views
    assert_as_driven(views, replace(DRIVE, origin=DRIVE.pose(DRIVE.start)))


def test_odometry_of_another_day_is_refused(log: Path) -> None:
    way = Trajectory(np.array([0.0, 5.0]), np.zeros((2, 3)))
    with pytest.raises(LogError, match=r"a trajectory given lies at 0\.000 to 5\.000 s, the views at 17\d+\.\d+ to"):
        read_recording(log, odometry=way)


def test_views_before_the_odometry_begins_are_counted_and_go(log: Path) -> None:
    times = DRIVE.start + np.arange(3, 8, 0.05)
    way = Trajectory.of(times, [DRIVE.pose(time) for time in times])
    findings = read_recording(log, odometry=way).findings
    assert findings
    assert findings.without_odometry == pytest.approx(30, abs=2)
    assert findings.views + findings.without_odometry == pytest.approx(80, abs=1)


def test_a_camera_that_pauses_leaves_views_of_the_laser(tmp_path: Path) -> None:
    drive = replace(DRIVE, gap=(3.0, 5.0))
    recording = read_recording(write_foxglove(tmp_path / "gap.mcap", drive))
    inside = [view for view in recording.views if 3.1 < view.time - drive.start < 4.9]
    assert len(inside) >= 10
    assert all(view.scan is not None and not view.images for view in inside)
    assert recording.findings
    camera = recording.findings.channels[TOPICS[Sense.PICTURE]]
    assert camera.longest_gap == pytest.approx(2.0, abs=0.15)
    assert camera.gap_at - drive.start == pytest.approx(2.95, abs=0.1)


def test_names_and_topics_are_the_user_s(log: Path) -> None:
    named = read_recording(log, PairingOptions(names={TOPICS[Sense.PICTURE]: "front"}))
    assert named.sensors == {"front", "laser"}
    alone = read_recording(log, PairingOptions(topics=("/scan",)))
    assert alone.sensors == {"laser"}


def test_a_late_truth_is_set_back(log: Path) -> None:
    views = read_recording(log, PairingOptions(late={"truth": 0.5})).views
    known = [view for view in views if view.truth is not None]
    assert len(views) - 10 < len(known) < len(views)  # behind its last pose but half a second there is none
    for view in known[:-5]:
        assert view.truth
        assert motion_between(DRIVE.pose(view.time + 0.5), view.truth) == pytest.approx((0, 0), abs=0.01)


@pytest.mark.parametrize("late", [0.0, 0.3])
def test_a_late_truth_of_a_log_that_numbers_its_moments_is_set_back(tmp_path: Path, late: float) -> None:
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        for k in range(20):
            pose = Pose(float(k), 0.0, 0.0)
            writer.write(View(float(k), scan=Scan(np.ones(9, np.float32), 0.0, 0.1), truth=pose), pose)
    found = read_recording(tmp_path / "drive.mcap", PairingOptions(late={"truth": late})).views
    assert [view.truth.x for view in found[:-1] if view.truth] == pytest.approx(np.arange(19) + late)
    with pytest.raises(LogError, match=r"valid is a late sensor that is the only one, where .*, or a late truth"):
        read_recording(tmp_path / "drive.mcap", PairingOptions(late={"truth": late, "laser": 0.1}))


def test_a_late_trajectory_is_held_against_the_log_once_it_is_set_right(log: Path, tmp_path: Path) -> None:
    shown = [(DRIVE.start + k / 10, DRIVE.pose(DRIVE.start + k / 10)) for k in range(80)]
    rows = [f"{time + 3600},{pose.x},{pose.y}" for time, pose in shown]
    (tmp_path / "gps.csv").write_text("\n".join(["time,x,y", *rows]))
    given = read_trajectory(tmp_path / "gps.csv")
    with pytest.raises(LogError, match="valid is a trajectory of the same time"):
        read_recording(log, PairingOptions(truth=given))
    for view in read_recording(log, PairingOptions(truth=given, late={"truth": 3600})).views[1:70]:
        assert view.truth
        assert (view.truth.x, view.truth.y) == pytest.approx(
            (DRIVE.pose(view.time).x, DRIVE.pose(view.time).y), abs=0.05
        )


def test_a_trajectory_is_held_against_sensors_whose_late_clocks_are_set_right(tmp_path: Path) -> None:
    """A robot whose own clock is an hour late, and a way that somebody else measured by the right one."""
    late = replace(DRIVE, start=DRIVE.start + 3600)
    rows = [(DRIVE.start + k / 10, DRIVE.pose(DRIVE.start + k / 10)) for k in range(80)]
    (tmp_path / "gps.csv").write_text("\n".join(["time,x,y", *(f"{time},{pose.x},{pose.y}" for time, pose in rows)]))
    options = PairingOptions(odometry=read_trajectory(tmp_path / "gps.csv"), late={"cam0": 3600, "laser": 3600})
    views = read_recording(write_foxglove(tmp_path / "late.mcap", late), options).views
    assert len(views) == pytest.approx(80, abs=2)
    assert abs(views[0].time - DRIVE.start) < 0.2
    assert sum(view.distance for view in views) == pytest.approx(0.8 * 7.9, abs=0.15)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            PairingOptions(topics=("/nowhere",)),
            r"topic '/nowhere' of a sensor is not in it; valid are /cam0",
        ),
        (PairingOptions(topics=("/odom",)), r"topic '/odom' of a sensor holds 160 foxglove\.Odometry; valid are /cam0"),
        (
            PairingOptions(odometry="/scan"),
            r"topic '/scan' of poses holds 80 foxglove\.LaserScan; valid are /odom",
        ),
        (PairingOptions(leading="rear"), r"leading sensor 'rear' is not in it; valid are cam0, laser"),
        (
            PairingOptions(tolerance=-1.0),
            r"tolerance -1\.0 s is not valid; it should be a",
        ),
        (PairingOptions(late={"rear": 0.1}), r"late sensor 'rear' is not in it; valid are cam0, laser"),
        (PairingOptions(late={"laser": math.inf}), r"laser late by inf s is not valid; it should be finite"),
        (PairingOptions(late={"truth": math.nan}), r"truth late by nan s is not valid; it should be finite"),
        (PairingOptions(tolerance=math.nan), r"tolerance nan s is not valid; it should be"),
        (PairingOptions(names={"/scan": "cam0"}), r"laser /scan is named 'cam0'; valid is 'laser'"),
    ],
)
def test_options_that_do_not_fit_are_named(log: Path, options: PairingOptions, message: str) -> None:
    with pytest.raises(LogError, match=rf"drive\.mcap: {message}") as caught:
        read_recording(log, options)
    assert "\n" not in str(caught.value)


def test_dead_reckoning_by_the_views_follows_the_odometer(log: Path) -> None:
    views = read_recording(log).views
    pose = DRIVE.odometry(views[0].time)
    for view in views[1:]:
        pose = after_motion(pose, view.distance, view.turn)
    assert motion_between(pose, DRIVE.odometry(views[-1].time)) == pytest.approx((0, 0), abs=0.05)


def test_views_are_without_damaged_pictures_and_it_is_told(log: Path, tmp_path: Path) -> None:
    whole = plan_views(open_log(log))
    plan = plan_views(open_log(write_foxglove(tmp_path / "hurt.mcap", DRIVE, FoxgloveSetup(cut=(3.0, 4.0)))))
    hurt = plan.findings.damaged["cam0"]
    assert len(hurt) == pytest.approx(10, abs=1)
    without = [view.time for view in plan.read() if "cam0" not in view.images]
    assert [f"at {time:.3f} s" for time in without] == list(hurt)
    assert list(plan.findings.losses()) == [f"cam0: {len(hurt)} pictures are damaged and left out, the first {hurt[0]}"]
    assert [view.time for view in plan.views] == [view.time for view in whole.views]


def test_behaviours_told_at_moments_whose_pictures_are_damaged_are_told_at_the_one_before() -> None:
    told = ("MN:8", "", "MT:90", "", "MN:5", "")
    data = tuple(TimedData(float(n), odometry=Pose(0.4 * n, 0.0, 0.0), behaviour=words) for n, words in enumerate(told))
    whole = Schedule(Moments(np.arange(6.0), {"/cam0": np.arange(6)}, np.zeros(0, np.int64)), data)
    assert [one.behaviour for one in whole.without({}).data] == list(told)
    assert [one.behaviour for one in whole.without({"/cam0": [2, 3, 4]}).data] == ["MN:8", "MT:90@0.40; MN:5@1.20", ""]
    assert [one.behaviour for one in whole.without({"/cam0": [0, 2]}).data] == ["MN:8; MT:90@0.40", "", "MN:5", ""]


def test_a_camera_of_which_no_picture_is_whole_is_refused(tmp_path: Path) -> None:
    path = write_foxglove(tmp_path / "hurt.mcap", replace(DRIVE, seconds=2.0), FoxgloveSetup(cut=(-9.0, 9.0)))
    views = read_recording(path).views
    with pytest.raises(LogError, match=r"topic /cam0/\S+: an image cannot be decoded"):
        dict(views[3].images)


def test_a_step_from_view_to_view_would_lose_their_motion(log: Path) -> None:
    with pytest.raises(LogError, match="views with a step of 2 are not valid; valid is a stretch, and to thin it"):
        read_recording(log, views=slice(0, 10, 2))
