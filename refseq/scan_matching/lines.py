"""Straight pieces of wall about each beam of a scan, so that others can be laid on them to the centimetre."""

import numpy as np
from numpy.typing import NDArray

from refseq.scan_matching.panorama import DEGREES

LENGTH, MOST = 0.15, 8
"""A piece reaches so far from its middle to both sides [m], and over so many degrees at most."""
STRAIGHT, GROWING = 0.02, 0.004
"""Ends of beams are a straight piece up to such a deviation from it [m], and so much more a metre of range."""
ROUNDED = 0.005
"""Ranges are off by so much at least [m]: maps keep them in centimetres."""
BEARINGS = np.radians(np.arange(DEGREES))


class WallLines:
    """Pieces of wall of a scan by degrees, ``ranges`` (360,) [m], 0 where nothing came back.

    ``straight`` are the n degrees about which walls are straight. ``ends`` (n, 2) are the ends of those beams,
    ``centres`` and ``normals`` (n, 2) the middle and direction of the piece, ``reaches`` (n,) half its length [m],
    ``turns`` (n,) the variance of its direction [rad²], by how far the ends of its beams lie off it. ``numbers`` (360,)
    tell which piece is at a degree, −1 where there is none.
    """

    def __init__(self, ranges: NDArray[np.float64]) -> None:
        ends = ranges[:, None] * np.stack([np.cos(BEARINGS), np.sin(BEARINGS)], axis=1)
        counts, means, along, across, angles = _pieces(ends, ranges)
        whole = counts >= 2 * _widths(ranges) + 1
        good = (ranges > 0) & whole & (np.sqrt(across) < STRAIGHT + GROWING * ranges)
        self.straight = np.flatnonzero(good)
        self.ends, self.centres = ends[good], means[good]
        self.normals = np.stack([-np.sin(angles[good]), np.cos(angles[good])], axis=1)
        self.reaches = np.sqrt(3 * along[good])  # of points spread evenly over a piece
        spread = across[good] / np.maximum(counts[good] - 2, 1.0) + ROUNDED**2 / counts[good]
        self.turns = spread / along[good]
        self.numbers = np.full(DEGREES, -1)
        self.numbers[self.straight] = np.arange(len(self.straight))


def _widths(ranges: NDArray[np.float64]) -> NDArray[np.intp]:
    """Degrees to both sides that make a piece, (360,): near walls are dense, and noise turns a short piece."""
    steps = np.maximum(ranges, 0.01) * np.radians(1.0)
    return np.asarray(np.clip(np.ceil(LENGTH / steps), 1, MOST), np.intp)


def _pieces(
    ends: NDArray[np.float64], ranges: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Returns about each degree: their number, mean (360, 2), variance along and across the piece, its direction."""
    x, y = ends.T
    products = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1) * (ranges > 0)[:, None]
    sums = np.cumsum(np.concatenate([np.zeros((1, 6)), products[-MOST:], products, products[:MOST]]), axis=0)
    width, middle = _widths(ranges), np.arange(DEGREES) + MOST
    moments = sums[middle + width + 1] - sums[middle - width]
    count = np.maximum(moments[:, 0], 1.0)
    means = moments[:, 1:3] / count[:, None]
    xx, xy, yy = (moments[:, 3:] / count[:, None] - means[:, [0, 0, 1]] * means[:, [0, 1, 1]]).T
    half, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    angles = np.arctan2(2 * xy, xx - yy) / 2
    return moments[:, 0], means, half + spread, np.maximum(half - spread, 0.0), angles
