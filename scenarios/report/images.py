"""Images and scans of a view, as a page holds them."""

import base64

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan

FRAME_WIDTH = 320
"""Width of a frame [pixels]."""
SCAN_REACH = 12.0
"""Range of a drawn scan [m]."""


def picture(image: NDArray[np.uint8]) -> str:
    """A frame as a small JPEG data URI."""
    height, width = image.shape
    small = cv2.resize(image, (FRAME_WIDTH, round(FRAME_WIDTH * height / width)), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()


def scan_outline(scan: Scan) -> str:
    """A scan as an SVG path, the robot at (0, 0) looking up, in decimetres; beyond ``SCAN_REACH`` nothing is drawn."""
    near = scan.ranges < SCAN_REACH
    ranges = np.where(near, scan.ranges, 0.0).astype(float)
    left, ahead = ranges * np.sin(scan.bearings), ranges * np.cos(scan.bearings)
    points = np.round(np.stack([-left, -ahead], axis=1) * 10).astype(int)
    begins = near & ~np.concatenate([[False], near[:-1]])
    # Beams next to each other often end in the same decimetre.
    moved = np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])
    kept = np.flatnonzero(near & (begins | moved))  # a beam alone is a point: a line of no length
    return " ".join(
        f"M{points[n, 0]},{points[n, 1]}h0" if begins[n] else f"L{points[n, 0]},{points[n, 1]}" for n in kept.tolist()
    )
