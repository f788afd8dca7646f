"""Every kind of log through every command, from files that other projects' writers have made.

All are of one asynchronous drive: pictures and scans at 10 Hz, odometry at 20, truth at 5, each with a clock and a
jitter of its own, a pause of the camera, stamps that are late, and an odometer that drifts and begins elsewhere. The
second drive differs in all of these.
"""

import json
import shlex
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from refseq.logs.beliefs import read_beliefs
from refseq.planar import Pose
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.real_recordings import Log, read_real
from refseq_bench.scenarios.cli.app import exit_code
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from tests.refseq.logs.foreign import RosSetup, write_ros2_mcap, write_rosbag1, write_rosbag2
from tests.refseq.logs.foxglove_drive import FoxgloveSetup, write_foxglove, write_json
from tests.refseq.logs.robot_drive import RobotDrive, Sense

FIRST = RobotDrive(seconds=10.0, drift=0.01, gap=(3.0, 4.2), camera_delay=0.02)
SECOND = replace(
    FIRST, seed=8, start=1_700_009_000.6, origin=Pose(3.0, -2.0, 1.0), drift=-0.02, gap=(6.0, 7.1), camera_delay=-0.015,
    brightness=0.8, jitter=0.004,
)  # fmt: skip
THIN = 0.4


@dataclass(frozen=True)
class ForeignLog:
    """A log, the options that read it, and those that ``refseq log check`` gives for learning it."""

    path: Path
    options: str = ""
    learning: str = ""


def ros_setup(truth: bool, **more: Any) -> RosSetup:
    return RosSetup(truth="topic" if truth else None, **more)


def foxglove(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    return ForeignLog(write_foxglove(folder / "fox.mcap", drive, FoxgloveSetup(truth=truth)))


def foxglove_json(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    seen = drive if truth else replace(drive, truth_rate=0.0)
    return ForeignLog(write_json(folder / "json.mcap", seen))


def ros2_mcap(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    return ForeignLog(write_ros2_mcap(folder / "ros2.mcap", drive, ros_setup(truth)))


def rosbag2_mcap(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    return ForeignLog(write_rosbag2(folder / "bag", drive, ros_setup(truth, image_format="bgr8")))


def rosbag2_sqlite(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    return ForeignLog(write_rosbag2(folder / "sqlite", drive, ros_setup(truth), storage=StoragePlugin.SQLITE3))


def rosbag1(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    return ForeignLog(write_rosbag1(folder / "one.bag", drive, ros_setup(truth, image_format="mono8")))


def transforms(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    setup = RosSetup(odometry="tf", truth="tf" if truth else None, upside_down=True, laser=Pose(0.2, 0.05, 0.1))
    return ForeignLog(write_rosbag2(folder / "tf", drive, setup))


def carmen(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    """Lines as CARMEN's logger writes them, without images; the layout is that of its manual."""
    path, way = folder / "robot.clf", np.linspace(-np.pi / 2, np.pi / 2, 181)
    lines = ["PARAM robot_frontlaser_offset 0.0 0.0 host 0.0"]
    for moment in drive.moments:
        odometry, true = drive.odometry(moment.time), drive.pose(moment.time)
        end = f"{moment.time:.6f} host {moment.logged:.6f}"
        at = f"{odometry.x:.6f} {odometry.y:.6f} {odometry.heading:.6f}"
        match moment.sense:
            case Sense.SCAN:
                ranges = " ".join(f"{r:.2f}" for r in drive.ranges(moment.time, way))
                head = f"RAWLASER1 0 {-np.pi / 2:.6f} {np.pi:.6f} {np.pi / 180:.6f} 80 0.01 0"
                lines.append(f"{head} 181 {ranges} 0 {end}")
            case Sense.ODOMETRY:
                lines.append(f"ODOM {at} 0.8 0 0 {end}")
            case Sense.TRUTH if truth:
                lines.append(f"TRUEPOS {true.x:.6f} {true.y:.6f} {true.heading:.6f} {at} {end}")
    path.write_text("\n".join([*lines, ""]))
    return ForeignLog(path, learning="--features walls,boundary,sectors")


def pictures(folder: Path, drive: RobotDrive, truth: bool) -> ForeignLog:
    """A folder of pictures named by their times, with trajectories beside it."""
    made = folder / "pictures"
    made.mkdir()
    for moment in drive.moments:
        if moment.sense is Sense.PICTURE:
            cv2.imwrite(str(made / f"{moment.time:.6f}.png"), drive.picture(moment.time))
    odometry = tum(folder / "odometry.tum", drive, Sense.ODOMETRY, drive.odometry)
    options = f"--odometry {odometry}"
    if truth:
        options += f" --truth {tum(folder / 'truth.tum', drive, Sense.TRUTH, drive.pose)}"
    return ForeignLog(made, options, learning="--features dense")


def tum(path: Path, drive: RobotDrive, sense: Sense, at: Callable[[float], Pose]) -> Path:
    rows = []
    for moment in drive.moments:
        if moment.sense is sense:
            pose = at(moment.time)
            half = pose.heading / 2
            rows.append(f"{moment.time:.6f} {pose.x:.6f} {pose.y:.6f} 0 0 0 {np.sin(half):.9f} {np.cos(half):.9f}")
    path.write_text("\n".join([*rows, ""]))
    return path


WRITERS: tuple[Callable[[Path, RobotDrive, bool], ForeignLog], ...] = (
    foxglove, foxglove_json, ros2_mcap, rosbag2_mcap, rosbag2_sqlite, rosbag1, transforms, carmen, pictures,
)  # fmt: skip


@dataclass(frozen=True)
class Localised:
    """Two logs of one way, a map of the first, and the second's answers in it."""

    folder: Path
    first: ForeignLog
    second: ForeignLog
    code: int
    out: str


def refseq(line: str) -> int:
    return exit_code(shlex.split(line))


def localised(folder: Path, write: Callable[..., ForeignLog], truth: bool, capsys: Any) -> Localised:
    for name in ("first", "second"):
        (folder / name).mkdir()
    first, second = write(folder / "first", FIRST, truth), write(folder / "second", SECOND, truth)
    map_ = folder / "map.refseq"
    assert refseq(f"learn {first.path} {first.options} {first.learning} --thin {THIN} -o {map_}") == 0
    capsys.readouterr()
    code = refseq(
        f"localise {map_} {second.path} {second.options} --thin {THIN} --stage chain --json -o {folder}/beliefs.parquet"
    )
    return Localised(folder, first, second, code, capsys.readouterr().out)


@pytest.fixture(params=[pytest.param(True, id="truth"), pytest.param(False, id="no truth")])
def truth(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


def check(found: Localised, truth: bool) -> None:
    assert found.code == 0
    told = json.loads(found.out)
    views = len(read_beliefs(found.folder / "beliefs.parquet")["chain"])
    assert views == pytest.approx(SECOND.speed * SECOND.seconds / THIN, abs=5)
    assert told["views"] == views
    if truth:
        wide, narrow = next(one for one in told["stages"])["success"]
        assert (wide["within"], narrow["within"], wide["unit"]) == (1.5, 0.5, "m")
        assert wide["of"] == views
        assert wide["right"] >= 0.8 * wide["of"]
        assert narrow["right"] >= 0.6 * narrow["of"]


@pytest.mark.quick_cases("carmen", "ros2_mcap", "pictures")
@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_a_log_is_learnt_and_localised(write, tmp_path, capsys):
    """With truth; without it, and through all other commands, in the slow test below."""
    check(localised(tmp_path, write, True, capsys), truth=True)


def test_a_log_without_truth_is_localised_all_the_same(tmp_path, capsys):
    check(localised(tmp_path, ros2_mcap, False, capsys), truth=False)


def lines(found: Localised) -> Iterator[str]:
    """Commands about the second log, each to its end."""
    folder, options = found.folder, f"{found.second.options} --thin {THIN}"
    log = f"{found.second.path} {options}"
    yield f"log info {found.second.path}"
    yield f"log check {log} -o {folder}/check.html"
    yield f"log convert {log} -o {folder}/ours.mcap"
    localised = f"{folder}/map.refseq {found.second.path} {folder}/beliefs.parquet {found.second.options}"
    yield f"report {localised} -o {folder}/report.html"
    yield f"view {localised} -o {folder}/localised.rrd"
    yield f"view {log} -o {folder}/view.rrd"
    if not found.second.options:  # trajectories beside a log are of one drive
        methods = "thesis/chain" if found.first.learning else "thesis/chain,topometric"  # which lives by pictures
        yield f"compare {found.first.path} {log} --methods {methods} --report {folder}/compare.html"


@pytest.mark.slow
@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_every_command_takes_every_log(write, truth, tmp_path, capsys):
    found = localised(tmp_path, write, truth, capsys)
    check(found, truth)
    for line in lines(found):
        assert refseq(line) == 0, (line, capsys.readouterr().err)
    for name in ("check.html", "report.html", "view.rrd", "ours.mcap"):
        assert (tmp_path / name).stat().st_size > 1000


PICTURES = f"""
title = "Pictures of two days, each with its own odometry"
expect = ["success of best/chain >= 80 %"]
[reference]
log = "first/pictures"
odometry = "first/odometry.tum"
truth = "first/truth.tum"
thin = {THIN}
[query]
log = "second/pictures"
odometry = "second/odometry.tum"
truth = "second/truth.tum"
late = {{ camera-1 = -0.015 }}
[localise]
methods = ["best/chain"]
"""


def test_a_scenario_takes_odometry_beside_its_logs(tmp_path, capsys):
    for name, drive in (("first", FIRST), ("second", SECOND)):
        (tmp_path / name).mkdir()
        pictures(tmp_path / name, drive, True)
    (tmp_path / "days.toml").write_text(PICTURES)
    code = refseq(f"scenario run {tmp_path}/days.toml -j 1 -o {tmp_path}/out")
    assert code == 0, capsys.readouterr()


NAMED = """
title = "Names, clocks and odometry as the robot has them"
[reference]
log = "one.bag"
thin = {thin}
topics = {{ front = "/camera/image_raw", laser = "/scan" }}
tolerance = 0.05
late = {{ front = 0.02, laser = 0.1, truth = 0.3 }}
odometry = "/odom"
[query]
views = "2:9"
late = {{ front = 0.1 }}
"""


def test_a_scenario_reads_a_log_as_the_command_line_does(tmp_path):
    rosbag1(tmp_path, FIRST, True)
    (tmp_path / "named.toml").write_text(NAMED.format(thin=THIN))
    (case,) = load(tmp_path / "named.toml")
    topics = "front=/camera/image_raw,laser=/scan"
    late = "front=0.02,laser=0.1,truth=0.3"
    told = (
        DriveSelection(thin=THIN, topics=topics, tolerance=0.05, late=late, odometry="/odom"),
        DriveSelection("2:9", thin=THIN, topics=topics, tolerance=0.05, late="front=0.1", odometry="/odom"),
    )
    for source, selection in zip(case.sources(1), told, strict=True):
        assert isinstance(source, Log)
        found, as_told = read_real(source).views, read_drive(tmp_path / "one.bag", selection).views
        assert [(v.time, v.distance, v.turn, v.truth, *v.images) for v in found] == [
            (v.time, v.distance, v.turn, v.truth, *v.images) for v in as_told
        ]
        assert {"front"} == set(found[0].images)
