"""Small logs of a robot's drive to damage, written by other projects' software, made once a process."""

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

import cv2
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from refseq.logs import read_recording, write_carmen
from tests.refseq.logs.foreign import RosSetup, write_ros2_mcap, write_rosbag1, write_rosbag2
from tests.refseq.logs.foxglove_drive import FoxgloveSetup, write_foxglove, write_json
from tests.refseq.logs.robot_drive import RobotDrive

DRIVE = RobotDrive(seconds=1.0, camera_rate=3.0, laser_rate=5.0, odometry_rate=5.0)
MCAPS = ("foxglove.mcap", "raw.mcap", "json.mcap", "ros2.mcap")
BAGS = ("none.bag", "bz2.bag", "lz4.bag")
FOLDERS = ("sqlite3", "messages", "mcap")


@cache
def log_files() -> Path:
    """A folder of ``MCAPS``, ``BAGS``, rosbag2 ``FOLDERS``, ``carmen.clf``, and ``pictures`` in two formats."""
    folder = Path(tempfile.mkdtemp(prefix="logs-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    write_foxglove(folder / "foxglove.mcap", DRIVE)
    write_foxglove(folder / "raw.mcap", DRIVE, FoxgloveSetup(raw="mono8", tf=True))
    write_json(folder / "json.mcap", DRIVE)
    write_ros2_mcap(folder / "ros2.mcap", DRIVE, RosSetup(odometry="tf"))
    compressions = (None, Rosbag1Writer.CompressionFormat.BZ2, Rosbag1Writer.CompressionFormat.LZ4)
    for name, compression in zip(BAGS, compressions, strict=True):
        write_rosbag1(folder / name, DRIVE, RosSetup(image_format="jpeg"), compression)
    write_rosbag2(folder / "sqlite3", DRIVE, RosSetup(image_format="bgr8"), StoragePlugin.SQLITE3)
    write_rosbag2(folder / "messages", DRIVE, RosSetup(), StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    write_rosbag2(folder / "mcap", DRIVE, RosSetup(odometry="tf"), StoragePlugin.MCAP)
    write_carmen(folder / "carmen.clf", read_recording(folder / "foxglove.mcap").views, {"robot": "r"})
    (folder / "pictures").mkdir()
    for number in range(3):
        for ending in ("png", "jpg"):
            picture = DRIVE.picture(DRIVE.start + number)
            cv2.imwrite(str(folder / "pictures" / f"{ending}-{number}.{ending}"), picture)
    return folder
