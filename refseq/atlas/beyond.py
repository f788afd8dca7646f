"""Walls before and after a join: they are the same where both paths go on beside each other.

Look-alikes lie on each other for as long as they are alike, and the search for overlaps cuts a stretch to just that: a
corridor laid on its way back fits for 25 m. Then both paths go on, along walls that fit no longer; where a join is true
they still do.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.scans import LaidScans, ScannedPath, ScanPairs, beside_each
from refseq.pose_graph import motions_between, moved, ways_along

FAR, ASIDE, LEAST = 10.0, 1.5, 5
"""So far [m] beyond a stretch paths are looked at, where so many views at least lie so near each other [m]."""
LOOSE = np.stack(
    np.meshgrid(*[np.linspace(-0.6, 0.6, 7)] * 2, np.radians(np.linspace(-8.0, 8.0, 9)), indexing="ij"), axis=-1
).reshape(-1, 3)
"""Each pair of scans may lie so far from where odometry puts it [m, m, rad]: it drifts, and robots turn on the spot."""
BEAMS = 3
"""Every so many-th beam is compared."""


@dataclass(frozen=True, slots=True)
class ScansBeyond:
    """``share`` of the beams that meet the same walls beyond an end of a stretch, for so many ``metres`` at most."""

    share: float
    metres: float


def beyond(one: ScannedPath, other: ScannedPath, laid: LaidScans) -> ScansBeyond | None:
    """Lay scans on each other beyond the end of a stretch where they do so worse; None where paths part at both."""
    sides = [_beyond(one, other, laid, end) for end in (0, -1)]
    return min((side for side in sides if side), key=lambda side: side.share, default=None)


def _beyond(one: ScannedPath, other: ScannedPath, laid: LaidScans, end: int) -> ScansBeyond | None:
    mine, its = laid.middles.views[end].tolist()
    motion = laid.middles.motions[end]
    views, among = (_after(path, laid.pairs[end, side], end) for side, path in enumerate((one, other)))
    if not len(views) or not len(among):
        return None
    beside, off = beside_each(one, other, (mine, its), motion, views, among)
    views, beside = views[off <= ASIDE], beside[off <= ASIDE]
    if len(views) < LEAST:
        return None
    from_mine = motions_between(one.track[mine], one.track[views])
    from_its = moved(motion, motions_between(other.track[its], other.track[beside]))
    put = motions_between(from_mine, from_its)
    shares = [
        ScanPairs(one, other, np.array([pair])).shares(at + LOOSE, BEAMS).max()
        for pair, at in zip(zip(views, beside, strict=True), put, strict=True)
    ]
    return ScansBeyond(float(np.mean(shares)), float(np.ptp(ways_along(one.track)[views])))


def _after(path: ScannedPath, edge: int, end: int) -> NDArray[np.intp]:
    """Views of a path within reach beyond its view ``edge``: before it for the ``end`` 0, after it for -1."""
    way = ways_along(path.track)
    on = way - way[edge] if end else way[edge] - way
    return np.flatnonzero((on > 0) & (on <= FAR))
