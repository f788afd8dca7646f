from pathlib import Path

from refseq_bench.scenarios.drives.viewer_recording import is_recorded
from tests.refseq.logs.foreign import RosSetup, write_rosbag2
from tests.refseq.logs.robot_drive import RobotDrive


def test_a_bag_is_a_drive_and_a_missions_folder_is_shown_as_it_was_recorded(tmp_path: Path) -> None:
    bag = write_rosbag2(tmp_path / "bag", RobotDrive(seconds=0.3), RosSetup(image_format=None))
    assert not is_recorded(bag)
    assert is_recorded(tmp_path / "show.rrd")
    mission = tmp_path / "mission"
    mission.mkdir()
    assert is_recorded(mission), "and record_at says what is missing in it"
    (mission / "picture.png").touch()
    (mission / "mission.rrd").touch()
    assert is_recorded(mission)
