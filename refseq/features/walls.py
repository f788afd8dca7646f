"""Wall-like lines of a scan and their bits (B.1, Algorithm 4, Table B.1).

Two stages: short segments of 2 to 6 points grow along the scan; then they are fused, short before long, each at most
once an iteration, while their inner end points are near and their slopes alike. Algorithm 4 as printed carries lines of
Algorithm 3 (the noise, the k-d tree), which are ignored.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import Observed
from refseq.view import LASER, Scan, View

NEAR, FAR = 2.0, 4.0
"""The bands of Table B.1: [0, 2), [2, 4) and [4, ∞) m from the scanner."""
COUNTS = (1, 2, 3)


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
class Line:
    """A straight piece of the scan: its end points, (2,) each [m], as the beams turn, and the moments that fit it.

    ``count``, ``sums`` (2,) and ``products`` (2, 2) are those of its points, so that two lines fuse without them.
    """

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    count: int
    sums: NDArray[np.float64]
    products: NDArray[np.float64]

    @classmethod
    def through(cls, points: NDArray[np.float64]) -> "Line":
        """The line of a run of points, (n, 2)."""
        return cls(points[0], points[-1], len(points), points.sum(axis=0), points.T @ points)

    def fused_with(self, after: "Line") -> "Line":
        """One line for this one and one behind it in the scan's order."""
        return Line(
            self.start,
            after.end,
            self.count + after.count,
            self.sums + after.sums,
            self.products + after.products,
        )

    @property
    def length(self) -> float:
        """Distance between the end points [m]."""
        return math.dist(self.start, self.end)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Mean of its points, (2,) [m]."""
        return self.sums / self.count

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit normal of the total-least-squares fit, (2,)."""
        centre = self.centre
        (a, b), (_, c) = self.products / self.count - np.outer(centre, centre)
        angle = 0.5 * math.atan2(2 * b, a - c)  # direction of the largest spread
        return np.array([-math.sin(angle), math.cos(angle)])

    @property
    def distance(self) -> float:
        """Perpendicular distance of the line from the scanner [m]."""
        return abs(float(self.normal @ self.centre))


def find_walls(scan: Scan, settings: WallSettings) -> list[Line]:
    """The walls of a scan: lines of at least ``settings.length``, in the order of the beams."""
    lines = fuse(grow_segments(scan, settings), settings)
    return [line for line in lines if line.length >= settings.length]


def grow_segments(scan: Scan, settings: WallSettings) -> list[Line]:
    """Stage one: runs of 2 to ``points`` neighbouring points that keep their direction."""
    seen = np.isfinite(scan.ranges)
    points = scan.points
    segments: list[Line] = []
    first = 0
    while first < len(points):
        last = _grow(points, seen, first, settings)
        if last > first:
            segments.append(Line.through(points[first : last + 1]))
        first = last + 1
    return segments


def _grow(points: NDArray[np.float64], seen: NDArray[np.bool_], first: int, settings: WallSettings) -> int:
    """Index of the last point of the segment that starts at ``first``."""
    last = first
    while last + 1 < len(points) and last + 1 - first < settings.points and seen[last] and seen[last + 1]:
        x, y = points[last + 1] - points[last]
        if math.hypot(x, y) > settings.gap:
            break
        if last > first:
            along = points[last] - points[first]
            onward = points[last + 1] - points[first]
            cross = along[0] * onward[1] - along[1] * onward[0]
            dot = along[0] * onward[0] + along[1] * onward[1]
            slack = math.atan2(2 * settings.noise, math.hypot(*along))
            if abs(math.atan2(cross, dot)) > settings.angle + slack:
                break
        last += 1
    return last


def fuse(segments: Sequence[Line], settings: WallSettings) -> list[Line]:
    """Stage two: join neighbours until no pair can be joined any more."""
    lines = list(segments)
    while True:
        joined = _fuse_once(lines, settings)
        if len(joined) == len(lines):
            return lines
        lines = joined


def _fuse_once(lines: list[Line], settings: WallSettings) -> list[Line]:
    """Fuse each line with at most one other, short pairs first."""
    pairs = sorted(range(len(lines) - 1), key=lambda i: lines[i].length + lines[i + 1].length)
    partner: dict[int, Line] = {}
    taken: set[int] = set()
    for i in pairs:
        if i in taken or i + 1 in taken:
            continue
        if (fused := _fusion(lines[i], lines[i + 1], settings)) is not None:
            partner[i] = fused
            taken |= {i, i + 1}
    return [partner.get(i, line) for i, line in enumerate(lines) if i - 1 not in partner]


def _fusion(before: Line, after: Line, settings: WallSettings) -> Line | None:
    """The common line of two neighbours, or None when they are apart, tilted, or off the common line."""
    if math.dist(before.end, after.start) > settings.reach:
        return None
    slack = math.atan2(2 * settings.noise, min(before.length, after.length))
    if abs(float(before.normal @ after.normal)) < math.cos(min(math.pi / 2, settings.tilt + slack)):
        return None
    fused = before.fused_with(after)
    normal, centre = fused.normal, fused.centre
    ends = (before.start, before.end, after.start, after.end)
    if max(abs(float(normal @ (point - centre))) for point in ends) > settings.offset:
        return None
    return fused


class WallLines:
    """Table B.1's nine bits: at least 1, 2, 3 walls at 4 m and more, at 2 to 4 m, and nearer than 2 m."""

    key = "walls/laser"
    sensor = LASER

    def __init__(self, settings: WallSettings) -> None:
        self.settings = settings

    @property
    def size(self) -> int:
        """Always nine."""
        return 3 * len(COUNTS)

    def learn(self, view: View) -> NDArray[np.intp]:
        """Bits of a reference view: the table is fixed, nothing is added."""
        return self.observe(view).ids

    def observe(self, view: View) -> Observed:
        """Ids of the bits that are set."""
        start = time.perf_counter()
        assert view.scan is not None, "the localiser asks only where the sensor is there"
        distances = np.array([line.distance for line in find_walls(view.scan, self.settings)])
        bands = (distances >= FAR, (distances >= NEAR) & (distances < FAR), distances < NEAR)
        met = [np.count_nonzero(band) >= count for band in bands for count in COUNTS]
        return Observed(np.flatnonzero(met), time.perf_counter() - start)

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Nothing was learnt."""
        return {}
