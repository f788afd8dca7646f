"""Formats in which drives are written, by name."""

from enum import StrEnum

from refseq.logs.writing import OutputFormat


class DriveFormat(StrEnum):
    """A file of Foxglove's messages, or a folder of ROS 2's in either storage."""

    MCAP = "mcap"
    ROSBAG2 = "rosbag2"
    ROSBAG2_SQLITE3 = "rosbag2-sqlite3"


def output_format(name: DriveFormat) -> OutputFormat:
    """The format of that name."""
    if name is DriveFormat.MCAP:
        from refseq.logs.foxglove.writer import RecordingFormat

        return RecordingFormat()
    from refseq.logs.ros.writer import BagFormat, BagStorage

    return BagFormat(BagStorage.MCAP if name is DriveFormat.ROSBAG2 else BagStorage.SQLITE3)
