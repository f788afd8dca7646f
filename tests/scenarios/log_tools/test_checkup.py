"""The checkup of logs with one thing wrong each, written as ROS does: verdicts, warnings, and a late laser's offset."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.errors import RefseqError
from refseq.map.learning import learn as learn_map
from refseq.planar import Pose
from refseq_bench.scenarios.drives.inputs import DriveSelection, read_drive
from refseq_bench.scenarios.log_tools.checkup import check_log
from refseq_bench.scenarios.log_tools.facts import facts_of
from refseq_bench.scenarios.log_tools.verdicts import Usability
from tests.refseq.logs.foreign import RosSetup, write_rosbag2
from tests.refseq.logs.robot_drive import HERE, RobotDrive

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
    assert any("turns to the left" in fact.text for fact in facts_of(found))


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
    assert ["learn" in localise.commands[0], "localise" in localise.commands[1]] == [True, True]


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


@dataclass(frozen=True)
class Troubled(RobotDrive):
    """A robot with a laser that is ``blind``, or a camera whose pictures change their size."""

    blind: bool = False
    changing: bool = False

    def ranges(self, time: float, bearings: NDArray[np.float64], mount: Pose = HERE) -> NDArray[np.float32]:
        found = super().ranges(time, bearings, mount)
        return np.full_like(found, np.inf) if self.blind else found

    def picture(self, time: float) -> NDArray[np.uint8]:
        found, later = super().picture(time), time > self.start + self.seconds / 2
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
    with pytest.raises(RefseqError):
        learn_map(read_drive(bag, DriveSelection(thin=0.85)).views)
