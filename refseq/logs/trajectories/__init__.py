"""Trajectories in and out: TUM, KITTI and EuRoC files, tables of poses, positions by satellite."""

from refseq.logs.trajectories.reading import read_trajectory
from refseq.logs.trajectories.table import PoseTable, TrajectoryFormat
from refseq.logs.trajectories.writing import write_trajectory

__all__ = ["PoseTable", "TrajectoryFormat", "read_trajectory", "write_trajectory"]
