"""The checkup of logs with one thing wrong each, written as ROS does: verdicts, warnings, and a late laser's offset."""

import math
import os
import re
import subprocess
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, cast

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.errors import RefseqError
from refseq.logs.source import Channel, LogSource, Role
from refseq.map.learning import learn as learn_map
from refseq.planar import Pose
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.log_tools.checkup import LogCheckup, check_log, taken_as
from refseq_bench.scenarios.log_tools.facts import facts_of
from refseq_bench.scenarios.log_tools.page import write_checkup
from refseq_bench.scenarios.log_tools.survey import LogSurvey, TopicSurvey
from refseq_bench.scenarios.log_tools.timing import Timing
from refseq_bench.scenarios.log_tools.verdicts import Usability
from tests.refseq.logs.foreign import RosMessages, RosSetup, write_rosbag2
from tests.refseq.logs.robot_drive import HERE, Moment, RobotDrive, Sense

DRIVE = RobotDrive(seconds=12.0)
WORKS, LIMITED, FAILS = Usability.WORKS, Usability.LIMITED, Usability.FAILS


@dataclass(frozen=True)
class Swaying(RobotDrive):
    """A robot that looks from side to side on its way, with a laser whose stamps are ``late`` [s]."""

    late: float = 0.0

    def pose(self, time: float) -> Pose:
        since = time - self.start
        return Pose(1.0 + self.speed * since, 0.0, 0.6 * math.sin(1.1 * since) + 0.2 * math.sin(2.7 * since))

    def ranges(self, time: float, bearings: NDArray[np.float64], mount: Pose = HERE) -> NDArray[np.float32]:
        return super().ranges(time - self.late, bearings, mount)


@pytest.mark.parametrize(
    ("drive", "setup", "verdicts", "warning"),
    [
        (DRIVE, RosSetup(), (WORKS, WORKS, WORKS), ""),
        (DRIVE, RosSetup(odometry=None, truth=None), (FAILS, LIMITED, LIMITED), ""),
        (DRIVE, RosSetup(truth=None, stamped=False), (WORKS, WORKS, LIMITED), "all stamps of zero"),
        (replace(DRIVE, seconds=2.0, speed=0.1), RosSetup(), (FAILS, LIMITED, WORKS), ""),
        (replace(DRIVE, gap=(3, 6)), RosSetup(), (WORKS, WORKS, WORKS), "1 pause, the longest of 3.0 s"),
        (
            replace(DRIVE, camera_delay=1.5),
            RosSetup(),
            (WORKS, WORKS, WORKS),
            "by another clock than /odom: +1.50",
        ),
    ],
)
def test_a_log_serves_for_what_it_holds(
    tmp_path: Path, drive: RobotDrive, setup: RosSetup, verdicts: tuple[Usability, ...], warning: str
) -> None:
    found = check_log(write_rosbag2(tmp_path / "bag", drive, setup), DriveSelection())
    assert tuple(one.usability for one in found.verdicts) == verdicts
    assert [one.task for one in found.verdicts] == ["learn", "localise", "score"]
    assert warning in " ".join(found.warnings)
    assert bool(found.warnings) == bool(warning)
    assert found.usable
    assert all(command.startswith("refseq ") for one in found.verdicts for command in one.commands)


def test_a_late_laser_is_told_by_its_turns_and_set_right(tmp_path: Path) -> None:
    bag = write_rosbag2(tmp_path / "bag", Swaying(seconds=20.0, late=-0.2))
    found = check_log(bag, DriveSelection())
    offset = found.offsets["laser"]
    assert offset is not None
    assert offset.lag == pytest.approx(-0.2, abs=0.03)
    assert any(
        "early against topic /odom" in line and f"--late laser={offset.lag:.2f}" in line for line in found.warnings
    )
    assert f" --late laser={offset.lag:.2f} " in found.verdicts[0].commands[0]
    assert any("turns to the left" in fact.text for fact in facts_of(found))


@pytest.mark.parametrize(("mounts", "told"), [(True, False), (False, True)])
def test_a_laser_that_hangs_upside_down_is_told_unless_its_mount_says_so(
    tmp_path: Path, mounts: bool, told: bool
) -> None:
    setup = RosSetup(upside_down=True, mounts=mounts, image_format=None, laser=Pose(0.0, 0.0, 0.4))
    found = check_log(write_rosbag2(tmp_path / "bag", Swaying(seconds=20.0), setup), DriveSelection())
    offset = found.offsets["laser"]
    assert offset is not None
    assert (offset.correlation < 0) is told
    assert [("the other way" in line) for line in found.warnings] == [True] * told


@dataclass(frozen=True)
class OtherClock(RobotDrive):
    """A robot whose log is written ``written`` [s] after the drive, by another clock for what its laser sees."""

    written: float = 0.0

    @cached_property
    def moments(self) -> tuple[Moment, ...]:
        return tuple(
            replace(one, logged=one.logged + self.written * (one.sense is Sense.SCAN)) for one in super().moments
        )


class OtherLaser(RosMessages):
    """Messages of a robot whose laser stamps by a clock that is ``OFF`` [s]."""

    OFF = 3.7

    def _scan(self, time: float) -> Any:
        scan = super()._scan(time)
        scan.header.stamp.sec, scan.header.stamp.nanosec = divmod(round((time + self.OFF) * 1e9), 10**9)
        return scan


class MonthsAgo(OtherLaser):
    OFF = -300 * 86400.0


@pytest.mark.quick_cases("MonthsAgo-png")
@pytest.mark.parametrize("image_format", ["png", None])
@pytest.mark.parametrize("laser", [OtherLaser, MonthsAgo])
def test_what_it_proposes_for_a_laser_of_another_clock_reads_its_scans(
    tmp_path: Path, laser: type[OtherLaser], image_format: str | None
) -> None:
    bag = write_rosbag2(tmp_path / "bag", DRIVE, RosSetup(image_format=image_format), made_by=laser)
    found = check_log(bag, DriveSelection())
    late = f"laser={laser.OFF:.2f}"
    (line,) = [line for line in found.warnings if "another clock" in line]
    assert f"--late {late} sets them right" in line
    for verdict in found.verdicts[:2]:
        assert f"with --late {late} as its clocks differ" in verdict.reason
        assert all(f" --late {late} " in command for command in verdict.commands)
    views = read_drive(bag, DriveSelection(thin=0.85, late=late)).views
    assert len(views) == found.views > 8
    assert all(view.scan is not None for view in views)
    assert not [line for line in check_log(bag, DriveSelection(late=late)).warnings if "clock" in line]


def test_a_clock_that_is_months_off_leaves_the_page_s_times_readable(tmp_path: Path) -> None:
    """Its own times begin at its first message; all others', the duration and the axis are as without it."""
    found = check_log(write_rosbag2(tmp_path / "bag", replace(DRIVE, gap=(3, 6)), made_by=MonthsAgo), DriveSelection())
    assert found.survey.duration == pytest.approx(12.0, abs=0.2)
    assert [topic.name for topic in found.survey.other_times] == ["/scan"]
    assert any(
        line.startswith("/scan: its stamps lie 300.0 days before those of the others") for line in found.warnings
    )
    assert any("the longest of 3.0 s at 3.0 s" in line for line in found.warnings), found.warnings
    write_checkup(tmp_path / "page.html", found)
    page = (tmp_path / "page.html").read_text()
    assert "their clocks are others: /scan." in page
    assert not re.findall(r"[^=+-]\b\d{4,}\.\d+ s\b", page)
    assert max(map(float, re.findall(r">(\d+)</text>", page))) <= 15


@pytest.mark.parametrize(("later", "apart"), [(50.0, False), (1800.0, True)])
def test_topics_are_told_by_their_own_start_where_no_drive_has_both(later: float, apart: bool) -> None:
    def topic(name: str, role: Role, first: float) -> TopicSurvey:
        return TopicSurvey(Channel(name, "", "", 9, role), Timing(9, first, first + 20.0))

    laser = topic("/scan", Role.LASER, 100.0)
    topics = (laser, topic("/odom", Role.ODOMETRY, 120.0 + later), topic("/tf_static", Role.TRANSFORMS, 0.0))
    found = LogSurvey(cast(LogSource, None), topics)
    assert found.other_times == ((laser,) if apart else ())
    assert (found.start, found.duration) == ((120.0 + later, 20.0) if apart else (100.0, 40.0 + later))
    assert [found.zero(one) for one in topics] == [100.0, found.start, found.start]


def test_the_times_of_logging_are_not_believed_where_they_part_a_sensor_from_the_odometry(tmp_path: Path) -> None:
    """A converter that wrote the scans an hour after all else has not changed their stamps."""
    found = check_log(write_rosbag2(tmp_path / "bag", OtherClock(seconds=12.0, written=3600.0)), DriveSelection())
    assert found.warnings == ()
    assert "--late" not in " ".join(found.verdicts[0].commands)


def test_a_late_sensor_that_the_log_does_not_hold_is_refused(tmp_path: Path) -> None:
    bag = write_rosbag2(tmp_path / "bag", replace(DRIVE, seconds=2.0))
    with pytest.raises(RefseqError, match="late sensor 'sonar' is not in it; valid are camera, laser"):
        check_log(bag, DriveSelection(late="sonar=1"))


def test_a_path_that_is_driven_twice_is_split(tmp_path: Path) -> None:
    """The second half of a log can be asked where it is on the first."""

    @dataclass(frozen=True)
    class Twice(RobotDrive):
        def pose(self, time: float) -> Pose:
            angle = 4 * math.pi * (time - self.start) / self.seconds
            return Pose(10.0 + 2.0 * math.sin(angle), -2.0 * math.cos(angle), angle)

    found = check_log(write_rosbag2(tmp_path / "bag", Twice(seconds=32.0)), DriveSelection())
    localise = next(one for one in found.verdicts if one.task == "localise")
    assert "driven twice" in localise.reason
    told = re.search(r"ask the rest, (\d+) of whose (\d+) views are on that map", localise.reason)
    assert told is not None
    on_map, asked = map(int, told.groups())
    assert asked - 2 <= on_map <= asked, "the second round is the first one's"
    assert asked == pytest.approx(found.views / 2, abs=2)
    assert ["learn" in localise.commands[0], "localise" in localise.commands[1]] == [True, True]


def test_a_name_that_is_no_utf_8_can_be_pasted_from_the_commands(tmp_path: Path) -> None:
    name = Path(os.fsdecode(b"it's \xfcf\xff.mcap"))
    bag = write_rosbag2(tmp_path / "bag", DRIVE, RosSetup(truth=None)).rename(tmp_path / name)
    found = check_log(bag, DriveSelection())
    learn = found.verdicts[0].commands[0]
    assert learn.isascii()
    words = subprocess.run(["bash", "-c", f"printf '%s\\0' {learn}"], capture_output=True, check=True).stdout
    assert os.fsencode(tmp_path / name) in words.split(b"\0")
    assert os.fsencode(name.with_suffix(".refseq")) in words.split(b"\0")


def test_a_path_that_is_nearly_straight_has_a_width(tmp_path: Path) -> None:
    found = check_log(write_rosbag2(tmp_path / "bag", DRIVE, RosSetup()), DriveSelection())
    assert 0 < min(found.travel.width, found.travel.height) < 1
    drive = next(fact.text for fact in facts_of(found) if fact.about == "drive")
    sides = re.search(r" in ([0-9.]+) × ([0-9.]+) m;", drive)
    assert sides is not None
    shown = sorted(map(float, sides.groups()))
    assert shown == pytest.approx(sorted((found.travel.width, found.travel.height)), abs=0.5)
    assert shown[0] == pytest.approx(min(found.travel.width, found.travel.height), abs=0.05)


def test_odometry_that_began_anew_is_told_and_its_first_part_proposed(tmp_path: Path) -> None:
    """The wheels' driver is restarted: no robot goes 9 m in a tenth of a second, and nothing is driven twice."""

    @dataclass(frozen=True)
    class Restarted(RobotDrive):
        def odometry(self, time: float) -> Pose:
            return super().odometry(time if time < self.start + 16.0 else time - 16.0)

    bag = write_rosbag2(tmp_path / "bag", Restarted(seconds=32.0), RosSetup(truth=None))
    found = check_log(bag, DriveSelection())
    assert any("poses jump by 9." in line and "at 15.9 s" in line for line in found.warnings), found.warnings
    learn, localise = found.verdicts[:2]
    assert (learn.usability, found.travel.revisited) == (LIMITED, 0.0)
    assert "twice" not in localise.reason
    assert found.travel.length == pytest.approx(0.8 * 32.0, abs=0.4), "the jump is no way"
    assert found.travel.width > 0.8 * 30.0, "nor does it lead back"
    words = learn.commands[0].split()
    before = read_drive(bag, DriveSelection(views=words[words.index("--views") + 1]))
    assert max(abs(view.distance) for view in before.views) < 1.0
    assert sum(view.distance for view in before.views) == pytest.approx(12.8, abs=0.3)
    assert (localise.usability, "the odometry jumps" in localise.reason) == (LIMITED, True)


@dataclass(frozen=True)
class Circling(RobotDrive):
    """A robot that drives round once, whose odometer counts headings ``count`` times, and from ``turned`` [rad]."""

    count: float = 1.0
    turned: float = 0.0

    def pose(self, time: float) -> Pose:
        angle = 2 * math.pi * (time - self.start) / self.seconds
        return Pose(10.0 + 2.0 * math.sin(angle), -2.0 * math.cos(angle), angle)

    def odometry(self, time: float) -> Pose:
        true = self.pose(time)
        return Pose(true.x, true.y, self.count * true.heading + self.turned)


@pytest.mark.parametrize(
    ("count", "turned", "told"),
    [
        (-1.0, 0.0, "its headings turn against its path: they count clockwise, or one axis is mirrored"),
        (-1.0, math.pi / 2, "x and y are swapped, or headings are bearings from north"),
        (1.0, -math.pi / 2, "its headings point 90° to the right of its way throughout"),
        (1.0, math.pi, "by its headings the robot drives straight back over 100 % of 12 m"),
        (0.0, 1.0, "its heading stays the same while its path of 12 m turns"),
        (1.0, 0.0, ""),
    ],
)
def test_headings_that_contradict_the_path_are_told_by_check_and_by_what_reads_the_drive(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, count: float, turned: float, told: str
) -> None:
    setup = RosSetup(truth=None, image_format=None)
    bag = write_rosbag2(tmp_path / "bag", Circling(seconds=16.0, count=count, turned=turned), setup)
    found = check_log(bag, DriveSelection())
    warned = [line for line in found.warnings if "heading" in line]
    assert len(warned) == bool(told)
    for verdict in found.verdicts[:2]:
        assert (verdict.usability is LIMITED, "headings contradict its path" in verdict.reason) == (bool(told),) * 2
    assert found.travel.length == pytest.approx(4 * math.pi, abs=0.4), "positions tell the way, whatever the headings"
    read_drive(bag, DriveSelection(thin=0.85))
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == bool(told)
    assert all(line.startswith(f"{bag}: topic /odom: ") and told in line for line in lines)
    assert all(told in line and "a table of time,x,y alone (--odometry FILE)" in line for line in warned)


@pytest.mark.parametrize(("count", "told"), [(0, "none of its messages is read"), (3, "a second camera")])
def test_a_camera_that_is_not_taken_is_told_why(tmp_path: Path, count: int, told: str) -> None:
    plan = check_log(picture_folder(tmp_path / "drive", 2.0), DriveSelection()).plan
    topic = TopicSurvey(Channel("/cam", "foxglove.CompressedImage", "json", 3, Role.CAMERA), Timing(count))
    assert taken_as(topic, plan) == f"ignored: {told}"


@pytest.mark.parametrize("grey", [0, 128])
def test_a_camera_alone_that_sees_nothing_does_not_work(tmp_path: Path, grey: int) -> None:
    """The table and all else are told as of any log: it was an error without the file's name."""
    bag = write_rosbag2(tmp_path / "bag", Troubled(seconds=12.0, grey=grey), RosSetup(scans=False))
    found = check_log(bag, DriveSelection())
    told = f"camera: its pictures are of one grey level, {grey} of 255: it sees nothing"
    assert [(one.usability, one.reason) for one in found.verdicts[:2]] == 2 * [(FAILS, told)]
    assert found.cost is None
    assert not found.usable


class FarSeeing(RosMessages):
    """Messages of a laser that declares a range of 80 km."""

    def _scan(self, time: float) -> Any:
        scan = super()._scan(time)
        scan.range_max = 80_000.0
        return scan


@dataclass(frozen=True)
class Troubled(RobotDrive):
    """A robot with a laser that is ``blind`` or tells ranges in another ``unit`` [m], or pictures that change size."""

    blind: bool = False
    changing: bool = False
    grey: int | None = None
    unit: float = 1.0

    def ranges(self, time: float, bearings: NDArray[np.float64], mount: Pose = HERE) -> NDArray[np.float32]:
        found = super().ranges(time, bearings, mount)
        return np.full_like(found, np.inf) if self.blind else found / np.float32(self.unit)

    def picture(self, time: float) -> NDArray[np.uint8]:
        found, later = super().picture(time), time > self.start + self.seconds / 2
        if self.grey is not None:
            return np.full_like(found, self.grey)
        return np.tile(found, (2, 2)) if self.changing and later else found


@pytest.mark.parametrize(
    ("drive", "encoding", "told", "well"),
    [
        (Troubled(seconds=12.0, blind=True), "png", "laser: no beam came back in", "camera"),
        (
            Troubled(seconds=12.0, changing=True),
            "png",
            "pictures are 64 × 48 pixels, 60 are not, the first at",
            "laser",
        ),
        (DRIVE, "mono7", "'mono7'", "laser"),
        (
            Troubled(seconds=12.0, grey=0),
            "png",
            "camera: its pictures are of one grey level, 0 of 255: it sees",
            "laser",
        ),
        (Troubled(seconds=12.0, grey=128), "jpeg", "its pictures are of one grey level, 128 of 255", "laser"),
    ],
)
def test_what_it_proposes_for_a_log_with_a_sensor_in_trouble_works(
    tmp_path: Path, drive: RobotDrive, encoding: str, told: str, well: str
) -> None:
    bag = write_rosbag2(tmp_path / "bag", drive, RosSetup(image_format=encoding))
    learn = check_log(bag, DriveSelection()).verdicts[0]
    assert learn.usability is LIMITED
    assert told in learn.reason
    assert learn.reason.endswith(f"; by {well} alone")
    assert f" --sensors {well} " in learn.commands[0]
    views = read_drive(bag, DriveSelection(thin=0.85), [well]).views
    assert len(learn_map(views, sensors=[well])) == len(views) > 8
    if isinstance(drive, Troubled) and drive.grey is not None:
        return  # a map is learnt of what the laser saw
    with pytest.raises(RefseqError):
        learn_map(read_drive(bag, DriveSelection(thin=0.85)).views)


def checked_without_laser(bag: Path, image_format: str | None, words: str) -> LogCheckup:
    """The checkup of a bag whose laser is left out of the commands, for a reason in these ``words``."""
    found = check_log(bag, DriveSelection())
    for verdict in found.verdicts[:2]:
        assert re.match(words, verdict.reason)
        assert verdict.usability is (LIMITED if image_format else FAILS)
        assert all(" --sensors camera " in command for command in verdict.commands)
    return found


@pytest.mark.parametrize("image_format", ["png", None])
def test_a_laser_in_millimetres_is_not_learnt_and_told_where_it_is(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, image_format: str | None
) -> None:
    setup = RosSetup(image_format=image_format)
    bag = write_rosbag2(tmp_path / "bag", Troubled(seconds=12.0, unit=1e-3), setup, made_by=FarSeeing)
    found = checked_without_laser(
        bag, image_format, r"laser: half of its ranges are beyond \d+ m: are they in metres\?"
    )
    assert found.usable is bool(image_format)
    read_drive(bag, DriveSelection(thin=0.85), ["camera"] if image_format else None)
    assert len(caplog.records) == (0 if image_format else 1)
    read_drive(bag, DriveSelection(thin=0.85))
    assert "laser: half of its ranges are beyond" in caplog.records[-1].getMessage()


@pytest.mark.parametrize("image_format", ["png", None])
def test_a_laser_in_centimetres_is_told_by_the_way_that_it_shows(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, image_format: str | None
) -> None:
    setup = RosSetup(image_format=image_format)
    bag = write_rosbag2(tmp_path / "bag", Troubled(seconds=12.0, unit=1e-2), setup, made_by=FarSeeing)
    words = r"laser: its scans show a way \d+ times as long as the odometry's: are its ranges in centimetres\?"
    checked_without_laser(bag, image_format, words)
    read_drive(bag, DriveSelection(thin=0.85))
    assert re.search(words, caplog.records[-1].getMessage())


@pytest.mark.parametrize(("unit", "usability"), [(1.0, WORKS), (0.015, FAILS)])
def test_a_laser_that_is_said_to_see_less_far_than_it_shows_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, unit: float, usability: Usability
) -> None:
    """A CARMEN log's laser sees nothing beyond 82 m: of one in another unit next to nothing is left."""
    drive, log = RobotDrive(seconds=16.0), tmp_path / "drive.log"
    bearings = np.radians(np.arange(180) - 90)
    lines = []
    for time in np.arange(0.0, 16.0, 0.5):
        pose, ranges = drive.pose(drive.start + time), drive.ranges(drive.start + time, bearings) / unit
        place = f"{pose.x:.3f} {pose.y:.3f} {pose.heading:.4f}"
        lines.append(
            f"FLASER 180 {' '.join(f'{one:.2f}' for one in ranges)} {place} {place} {time:.2f} robot {time:.2f}"
        )
    log.write_text("\n".join(lines) + "\n")
    learn = check_log(log, DriveSelection()).verdicts[0]
    told = "laser: half of its scans show nothing within 82 m: are its ranges in metres?"
    assert (learn.usability, learn.reason == told) == (usability, usability is FAILS)
    read_drive(log, DriveSelection(thin=0.85))
    assert any(told in one.getMessage() for one in caplog.records) is (usability is FAILS)


def picture_folder(folder: Path, per_second: float, count: int = 40) -> Path:
    """A folder of pictures whose names are their times [ms]."""
    folder.mkdir()
    picture = np.random.default_rng(1).integers(0, 255, (480, 640), np.uint8)
    for number in range(count):
        name = f"{1_760_000_000_000 + round(1000 * number / per_second)}.png"
        cv2.imwrite(str(folder / name), np.roll(picture, number, axis=1))
    return folder


@pytest.mark.quick_cases("0.01-time,x,y", "0.001-time,x [furlong],y")
@pytest.mark.parametrize(("unit", "header"), [(1e-3, "time,x,y"), (1e-2, "time,x,y"), (1e-3, "time,x [furlong],y")])
def test_odometry_in_other_units_does_not_work(tmp_path: Path, unit: float, header: str) -> None:
    """Exit code 1: the log cannot be localised as it is told to be read."""
    folder, table = picture_folder(tmp_path / "drive", 2.0), tmp_path / "odometry.csv"
    table.write_text("\n".join([header, *(f"{1_760_000_000 + k / 2},{0.4 * k / unit:.1f},0" for k in range(40))]))
    found = check_log(folder, DriveSelection(odometry=str(table)))
    doubt = f"the robot goes {0.8 / unit:.0f} m/s: are its poses in metres?"
    reason = f"{doubt} A table names another unit in its header: x [mm]"
    assert [(one.usability, one.reason, one.commands) for one in found.verdicts[:2]] == 2 * [(FAILS, reason, ())]
    assert not found.usable
    table.write_text(table.read_text().replace(header, {1e-3: "time,x [mm],y [mm]", 1e-2: "time,x [cm],y [cm]"}[unit]))
    assert check_log(folder, DriveSelection(odometry=str(table))).verdicts[0].usability is WORKS


def test_a_way_that_is_assumed_tells_nothing_of_units(tmp_path: Path) -> None:
    found = check_log(picture_folder(tmp_path / "drive", 50.0), DriveSelection())
    assert found.verdicts[0].usability is WORKS
    assert found.warnings == ()


def test_a_late_camera_of_a_picture_folder_is_told_and_set_right(tmp_path: Path) -> None:
    """Its names tell times of one clock, the odometry beside it those of another."""
    drive, late, folder = Swaying(seconds=20.0), 0.3, tmp_path / "drive"
    folder.mkdir()
    walls = cv2.resize(np.random.default_rng(1).random((8, 60)), (600, 48), interpolation=cv2.INTER_CUBIC)
    for time in drive.start + np.arange(0.0, 20.0, 0.1):
        left = round(250 - 120 * drive.pose(time).heading)
        picture = np.clip(200 * walls[:, left : left + 64], 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"{round(1000 * (time + late))}.png"), picture)
    poses = [(time, drive.pose(time)) for time in drive.start + np.arange(-2.0, 22.0, 0.05)]
    table = tmp_path / "odometry.csv"
    rows = "".join(f"{time:.3f},{pose.x:.4f},{pose.y:.4f},{pose.heading:.5f}\n" for time, pose in poses)
    table.write_text(f"time,x,y,yaw\n{rows}")
    found = check_log(folder, DriveSelection(odometry=str(table)))
    offset = found.offsets["camera-1"]
    assert offset is not None
    assert offset.lag == pytest.approx(late, abs=0.05)
    assert found.selection.late == f"camera-1={offset.lag:.2f}"
    assert any(f"--late {found.selection.late} sets them right" in warning for warning in found.warnings)
    views = read_drive(folder, found.selection).views
    assert views[0].time == pytest.approx(drive.start, abs=0.05)
