"""Foxglove's messages of what a view holds, ready to be logged or sent."""

import math

import cv2
import numpy as np
from foxglove import messages
from numpy.typing import NDArray

from refseq.logs.source import NANOSECONDS
from refseq.planar import Pose
from refseq.view import LASER, Scan

FAST_PNG = (
    *(int(cv2.IMWRITE_PNG_COMPRESSION), 1),
    *(int(cv2.IMWRITE_PNG_FILTER), int(cv2.IMWRITE_PNG_FILTER_AVG)),
    *(int(cv2.IMWRITE_PNG_STRATEGY), int(cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY)),
)
"""A quarter less time than OpenCV's default, and a twelfth smaller: noise leaves no repetitions to look for, and the
mean of two neighbours has less of it than one."""


def nanoseconds_of(time: float) -> int:
    """A time [s] in nanoseconds."""
    return round(time * NANOSECONDS)


def stamp_message(time: float) -> messages.Timestamp:
    """A time [s]."""
    seconds, rest = divmod(nanoseconds_of(time), NANOSECONDS)
    return messages.Timestamp(sec=seconds, nsec=rest)


def picture_message(camera: str, image: NDArray[np.uint8], stamp: messages.Timestamp) -> messages.CompressedImage:
    """A picture as PNG: without loss."""
    data = cv2.imencode(".png", image, FAST_PNG)[1].tobytes()
    return messages.CompressedImage(timestamp=stamp, frame_id=camera, data=data, format="png")


def scan_message(scan: Scan, stamp: messages.Timestamp) -> messages.LaserScan:
    """A scan of at least one beam; Foxglove's has no range of the laser."""
    bearings = scan.bearings
    return messages.LaserScan(
        timestamp=stamp,
        frame_id=LASER,
        start_angle=float(bearings[0]),
        end_angle=float(bearings[-1]),
        ranges=scan.ranges.astype(float).tolist(),
    )


def pose_message(pose: Pose) -> messages.Pose:
    """A pose in the plane."""
    half = pose.heading / 2
    return messages.Pose(
        position=messages.Vector3(x=pose.x, y=pose.y, z=0.0),
        orientation=messages.Quaternion(x=0.0, y=0.0, z=math.sin(half), w=math.cos(half)),
    )
