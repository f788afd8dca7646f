"""Straight pieces of wall about each beam of a scan, so that others can be laid on them to the centimetre.

In a crowded room, of table legs, boxes and chairs, little is straight for long, and scans would lie nowhere: there
pieces are shorter (docs/decisions/0057-crowded-rooms.md). Elsewhere the longer tell their direction better.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.scan_matching.panorama import DEGREES

LENGTH, MOST = 0.15, 8
"""A piece reaches so far from its middle to both sides [m], and over so many degrees at most."""
SHORTER, CROWDED = 0.1, 0.5
"""Where that is straight about fewer than such a share of the beams, so far [m]."""
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
        pieces = _pieces(ranges, LENGTH)
        if pieces.straight.sum() < CROWDED * np.count_nonzero(ranges):
            pieces = _pieces(ranges, SHORTER)
        self.straight = np.flatnonzero(pieces.straight)
        self.ends = _ends(ranges[self.straight], self.straight)
        counts, self.centres, along, across, angles = (moments[self.straight] for moments in pieces[:-1])
        self.normals = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
        self.reaches = np.sqrt(3 * along)  # of points spread evenly over a piece
        spread = across / np.maximum(counts - 2, 1.0) + ROUNDED**2 / counts
        self.turns = spread / along
        self.numbers = np.full(DEGREES, -1)
        self.numbers[self.straight] = np.arange(len(self.straight))


class _Pieces(NamedTuple):
    """About each degree, (360,) each: the ends of beams that a piece has, their mean (360, 2), their variances.

    Those are ``along`` and ``across`` it [m²]; ``angles`` are its directions, and where it is not ``straight`` there is
    no wall.
    """

    counts: NDArray[np.float64]
    means: NDArray[np.float64]
    along: NDArray[np.float64]
    across: NDArray[np.float64]
    angles: NDArray[np.float64]
    straight: NDArray[np.bool_]


def _widths(ranges: NDArray[np.float64], length: float) -> NDArray[np.intp]:
    """Degrees to both sides that make a piece, (360,): near walls are dense, and noise turns a short piece."""
    steps = np.maximum(ranges, 0.01) * np.radians(1.0)
    return np.asarray(np.clip(np.ceil(length / steps), 1, MOST), np.intp)


def _ends(ranges: NDArray[np.float64], degrees: NDArray[np.intp]) -> NDArray[np.float64]:
    """Ends of beams, (n, 2) [m]."""
    bearings = BEARINGS[degrees]
    return np.asarray(ranges[:, None] * np.stack([np.cos(bearings), np.sin(bearings)], axis=1))


def _pieces(ranges: NDArray[np.float64], length: float) -> _Pieces:
    """The pieces of wall that reach so far to both sides."""
    x, y = _ends(ranges, np.arange(DEGREES)).T
    products = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1) * (ranges > 0)[:, None]
    sums = np.cumsum(np.concatenate([np.zeros((1, 6)), products[-MOST:], products, products[:MOST]]), axis=0)
    width, middle = _widths(ranges, length), np.arange(DEGREES) + MOST
    moments = sums[middle + width + 1] - sums[middle - width]
    counts = np.maximum(moments[:, 0], 1.0)
    means = moments[:, 1:3] / counts[:, None]
    xx, xy, yy = (moments[:, 3:] / counts[:, None] - means[:, [0, 0, 1]] * means[:, [0, 1, 1]]).T
    half, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    across = np.maximum(half - spread, 0.0)
    whole = moments[:, 0] >= 2 * width + 1
    straight = (ranges > 0) & whole & (np.sqrt(across) < STRAIGHT + GROWING * ranges)
    return _Pieces(counts, means, half + spread, across, np.arctan2(2 * xy, xx - yy) / 2, straight)
