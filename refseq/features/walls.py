"""Wall-like lines of a scan and their bits (B.1, Algorithm 4, Table B.1).

Two stages: short segments of 2 to 6 points grow along the scan; then they are fused, short before long, each at most
once an iteration, while their inner end points are near and their slopes alike. Algorithm 4 as printed carries lines of
Algorithm 3 (the noise, the k-d tree), which are ignored.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from refseq.features.scan_bits import ScanBits
from refseq.view import Scan

NEAR, FAR = 2.0, 4.0
"""The bands of Tables B.1 and B.2: [0, 2), [2, 4) and [4, ∞) m from the scanner."""
COUNTS = (1, 2, 3)

FINEST = 1440
"""Beams of a scan in which lines are sought: four a degree, over a turn. Six points of a finer scan are a segment too
short against the noise to have a direction, and the time to join segments grows with the square of their number.
"""
LATEST = 512
"""Scans whose lines are kept: walls and doors of one are asked for after each other, and learning passes over its drive
three times. More spares longer drives the same; each takes about 3 kB."""
BLOCK = 1 << 20
"""Numbers that are held at a time while it is looked for gaps between lines."""


@dataclass(frozen=True, slots=True)
class WallSettings:
    """Algorithm 4's limits and those of the fusion; lengths [m], angles [rad].

    ``gap`` d, ``angle`` D and ``points`` #P rule the growth of segments. ``noise`` is what one range may be off: a
    segment that is short against it has no sharp slope, so every angle limit is widened by what the noise can turn it.
    ``reach`` is the largest gap that is fused over, ``tilt`` the largest difference of slopes, ``offset`` the farthest
    that an end point may lie from the common line, ``length`` the shortest wall kept. The thesis gives ``points`` and
    ``length``; the others are choices near those of CARMEN's line extraction (facts.md).
    """

    gap: float = 0.3
    angle: float = math.radians(20)
    points: int = 6
    noise: float = 0.015
    reach: float = 0.5
    tilt: float = math.radians(8)
    offset: float = 0.06
    length: float = 2.0


@dataclass(frozen=True, slots=True)
class ScanLines:
    """Straight pieces of a scan, m of them, in the order in which the beams meet them.

    ``first`` and ``last`` (m,) are the beams of their end points ``start`` and ``end`` (m, 2) [m]; ``moments`` (m, 6)
    are the sums of 1, x, y, x², xy and y² over their points, so that lines fuse and are fitted without the points.
    """

    first: NDArray[np.intp]
    last: NDArray[np.intp]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    moments: NDArray[np.float64]

    @classmethod
    def through(cls, points: NDArray[np.float64], first: NDArray[np.intp]) -> "ScanLines":
        """Cut the points of a scan, (n, 2), into runs that begin at the beams ``first`` (rising, from 0 on)."""
        last = np.append(first, len(points))[1:] - 1
        x, y = points.T
        products = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        return cls(first, last, points[first], points[last], np.add.reduceat(products, first, axis=0))

    def __len__(self) -> int:
        return len(self.first)

    def __getitem__(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> "ScanLines":
        """Some of the lines."""
        return ScanLines(self.first[which], self.last[which], self.start[which], self.end[which], self.moments[which])

    def merged_with(self, others: "ScanLines") -> "ScanLines":
        """These and others, in the order of the beams."""
        order = np.argsort(np.concatenate([self.first, others.first]))
        return ScanLines(
            *(np.concatenate([getattr(self, f.name), getattr(others, f.name)])[order] for f in fields(self))
        )

    def fused_with(self, after: "ScanLines") -> "ScanLines":
        """One line for each of these and its fellow behind it in the scan's order."""
        return ScanLines(self.first, after.last, self.start, after.end, self.moments + after.moments)

    @property
    def count(self) -> NDArray[np.intp]:
        """Numbers of points, (m,)."""
        return self.moments[:, 0].astype(np.intp)

    @property
    def length(self) -> NDArray[np.float64]:
        """Distances between the end points, (m,) [m]."""
        return _norms(self.end - self.start)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Means of the points, (m, 2) [m]."""
        return self.moments[:, 1:3] / self.moments[:, :1]

    @property
    def direction(self) -> NDArray[np.float64]:
        """Unit vectors of the total-least-squares fits, (m, 2), from start to end."""
        x, y = self.centre.T
        a, b, c = (self.moments[:, 3:] / self.moments[:, :1]).T
        angle = 0.5 * np.arctan2(2 * (b - x * y), (a - x * x) - (c - y * y))  # of the largest spread
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.where(_dots(along, self.end - self.start)[:, None] < 0, -along, along)

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normals of the fits, (m, 2)."""
        along = self.direction
        return np.stack([-along[:, 1], along[:, 0]], axis=1)

    @property
    def distance(self) -> NDArray[np.float64]:
        """Perpendicular distances of the lines from the scanner, (m,) [m]."""
        return np.abs(_dots(self.normal, self.centre))


def find_walls(scan: Scan, settings: WallSettings) -> ScanLines:
    """The walls of a scan: lines of at least ``settings.length``."""
    return walls_in(find_lines(scan, settings), settings)


def walls_in(lines: ScanLines, settings: WallSettings) -> ScanLines:
    """As ``find_walls``, where the scan's ``lines`` are known already."""
    return lines[lines.length >= settings.length]


def find_lines(scan: Scan, settings: WallSettings) -> ScanLines:
    """All lines of a scan, however short: both stages of Algorithm 4."""
    return _lines(_ThisScan(scan), replace(settings, length=0.0))  # which lines are walls is asked of them later


class _ThisScan:
    """A scan as a key: itself, and not one of the same ranges."""

    __slots__ = ("scan",)

    def __init__(self, scan: Scan) -> None:
        self.scan = scan

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ThisScan) and other.scan is self.scan

    def __hash__(self) -> int:
        return id(self.scan)


@lru_cache(maxsize=LATEST)
def _lines(this: _ThisScan, settings: WallSettings) -> ScanLines:
    return fuse(grow_segments(this.scan, settings), settings)


def grow_segments(scan: Scan, settings: WallSettings) -> ScanLines:
    """Stage one: runs of 2 to ``points`` neighbouring points that keep their direction."""
    scan = _thinned(scan)
    points = scan.points
    steps = _norms(np.diff(points, axis=0))
    seen = scan.returned
    steps[~(seen[:-1] & seen[1:])] = np.inf
    # Plain floats: the growth is a loop over single points, where NumPy's scalars are slow.
    path, gaps = points.tolist(), steps.tolist()
    first, at = [], 0
    while at < len(path):
        first.append(at)
        at = _grown(path, gaps, at, settings)
    runs = ScanLines.through(points, np.array(first, np.intp))
    return runs[runs.count >= 2]


def _thinned(scan: Scan) -> Scan:
    """The scan with at most ``FINEST`` beams, each so many-th."""
    every = -(-len(scan.ranges) // FINEST)
    return scan if every <= 1 else replace(scan, ranges=scan.ranges[::every], step=scan.step * every)


def _grown(path: list[list[float]], gaps: list[float], first: int, settings: WallSettings) -> int:
    """The point after the segment that starts at ``first``: the first one too far, too far aside, or one too many."""
    x0, y0 = path[first]
    for new in range(first + 1, min(first + settings.points, len(path))):
        if gaps[new - 1] > settings.gap:
            return new
        if new == first + 1:
            continue
        (x, y), (x1, y1) = path[new - 1], path[new]
        along_x, along_y, onward_x, onward_y = x - x0, y - y0, x1 - x0, y1 - y0
        turn = math.atan2(along_x * onward_y - along_y * onward_x, along_x * onward_x + along_y * onward_y)
        if abs(turn) > settings.angle + math.atan2(2 * settings.noise, math.hypot(along_x, along_y)):
            return new
    return min(first + settings.points, len(path))


def fuse(segments: ScanLines, settings: WallSettings) -> ScanLines:
    """Stage two: join lines until no pair can be joined any more."""
    lines, before = segments, 0
    while len(lines) != before:
        before, lines = len(lines), _fuse_once(lines, settings)
    return lines


def _fuse_once(lines: ScanLines, settings: WallSettings) -> ScanLines:
    """Fuse each line with at most one other, short pairs first."""
    one, other = _partners(lines, settings)
    lengths = lines.length
    free = np.ones(len(lines), np.bool_)
    pairs = []
    for pair in np.argsort(lengths[one] + lengths[other], kind="stable"):
        if free[one[pair]] and free[other[pair]]:
            free[[one[pair], other[pair]]] = False
            pairs.append(pair)
    return lines[free].merged_with(lines[one[pairs]].fused_with(lines[other[pairs]]))


def _partners(lines: ScanLines, settings: WallSettings) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs that may fuse: each line with the next in the scan that is near, not tilted, and on the common line.

    The next one that fits, not only the neighbour: the thesis asks for near inner end points, and a thin thing in
    front of a wall does not make two walls of it; what is seen behind its line does.
    """
    one, other = np.nonzero(np.triu(_norms(lines.end[:, None] - lines.start[None, :]) <= settings.reach, 1))
    length, direction = lines.length, lines.direction
    slack = np.arctan2(2 * settings.noise, np.minimum(length[one], length[other]))
    tilted = np.abs(_dots(direction[one], direction[other])) < np.cos(np.minimum(np.pi / 2, settings.tilt + slack))
    one, other = one[~tilted], other[~tilted]
    fused = lines[one].fused_with(lines[other])
    normal, centre = fused.normal, fused.centre
    ends = (lines.start[one], lines.end[one], lines.start[other], lines.end[other])
    fits = np.all([np.abs(_dots(normal, end - centre)) <= settings.offset for end in ends], axis=0)
    one, other, normal, centre = one[fits], other[fits], normal[fits], centre[fits]
    size = max(1, BLOCK // max(1, len(lines)))  # pairs: a block of them against all lines
    blocks = [slice(at, at + size) for at in range(0, len(one), size)]
    closed = [~_open_between(lines, one[some], other[some], normal[some], centre[some]) for some in blocks]
    fits = np.concatenate([np.zeros(0, np.bool_), *closed])
    one, first = np.unique(one[fits], return_index=True)
    return one, other[fits][first]


def _open_between(
    lines: ScanLines,
    one: NDArray[np.intp],
    other: NDArray[np.intp],
    normal: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """True where a line between those of a pair, (p,), lies behind their common line: the wall has a gap there."""
    number = np.arange(len(lines))
    between = (number > one[:, None]) & (number < other[:, None])
    distance = _dots(normal, centre)[:, None]  # of the common line, with the sign of its normal
    behind = normal @ lines.centre.T * np.sign(distance) > np.abs(distance)
    return np.asarray(np.any(between & behind, axis=1), np.bool_)


def _norms(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths of vectors, (…, 2)."""
    return np.hypot(vectors[..., 0], vectors[..., 1])


def _dots(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scalar products of vectors, (…, 2)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def count_bits(distances: NDArray[np.float64], counts: Sequence[int]) -> NDArray[np.intp]:
    """Bits of Tables B.1 and B.2 that are set: for the far, the middle and the near band, as many as each of counts."""
    bands = (distances >= FAR, (distances >= NEAR) & (distances < FAR), distances < NEAR)
    return np.flatnonzero([np.count_nonzero(band) >= count for band in bands for count in counts])


class WallLines(ScanBits):
    """Table B.1's nine bits: at least 1, 2, 3 walls at 4 m and more, at 2 to 4 m, and nearer than 2 m."""

    key = "walls/laser"

    def __init__(self, settings: WallSettings) -> None:
        self.settings = settings

    @property
    def size(self) -> int:
        """Always nine."""
        return 3 * len(COUNTS)

    def bits(self, scan: Scan) -> NDArray[np.intp]:
        """Ids of the bits that are set."""
        return count_bits(find_walls(scan, self.settings).distance, COUNTS)
