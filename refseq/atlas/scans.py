"""Scans laid on each other: whether two stretches show the same walls where a join puts them.

A place's laser words say what kind of place it is; a corridor and its way back share most of them. The ranges
themselves tell more: laid on each other, the scans of one place show walls at the same spots, those of two places that
look alike see through each other's walls somewhere. One relative pose has to do for some metres of a stretch, so that
an alignment that slid along a corridor is found as well, and by how much.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.consistency import LaidPairs
from refseq.planar import wrapped
from refseq.pose_graph import motions_between, moved, ways_along
from refseq.scan_matching.walls import ScanWalls

EVERY, SCANS = 5.0, 4
"""A window of a stretch is about so long [m], and so many pairs of its scans at most are compared."""
SLIDE, ASIDE, ASKEW = 2.25, 0.6, np.radians(16)
"""A window's relative pose is sought so far along, aside [m], and turned [rad] of where the join puts it."""
FINER = ((0.25, np.radians(2.0)), (0.1, np.radians(0.7)))
"""Then around the best, in grids of five steps to so many metres and radians either way."""
BEAMS = 6
"""Every so many-th beam is compared at first."""
NEAR = 1.0
"""Views that scans lay so near each other [m] are a pair; or as far as views are apart."""
ANOTHER_WAY = np.radians(60)
"""Views turned by so much [rad] and more are no pair, however near: a robot that comes back crosses its own way."""
BENT = (2.25, np.radians(30))
"""Windows that follow each other are one stretch where odometry leads from the pose of one to that of the next within
this [m, rad]: a window may slide so far along a bare corridor, but where paths have parted it lies elsewhere."""
STAYS = 0.01
"""Share of the scans that a metre of shift has to bring: along a bare corridor all shifts are as good."""

LONG = 15.0
"""Stretches from so many metres on tell how two odometers' scales go together: a view more or less is 6 % of them."""
RESCALED = (0.05, 0.25)
"""Odometers that tell lengths of a stretch as far apart as this, by their logarithm, have other scales: less is a view
more or less at its ends, and more no odometer is off by."""


def scale_between(length: float, its: float) -> float | None:
    """Scale that makes an odometer's length of a stretch that of another [m]; None where they tell the same, or little.

    It is that of the stretch as views were matched: no other scale is tried, as more freedom lays more on each other.
    """
    if min(length, its) < LONG or not RESCALED[0] <= abs(np.log(length / its)) <= RESCALED[1]:
        return None
    return length / its


@dataclass(frozen=True)
class ScannedPath:
    """A path's views by odometry, ``track`` (V, 3), and what the laser saw there, ``ranges`` (V, 360) [m]."""

    track: NDArray[np.float64]
    ranges: NDArray[np.float64]

    @classmethod
    def of(cls, track: NDArray[np.float64], scans: NDArray[np.uint16]) -> "ScannedPath | None":
        """A path by its odometry and scans [cm]; None where one of them is not known."""
        return cls(track, scans / 100.0) if len(track) and len(track) == len(scans) else None

    def scaled(self, scale: float) -> "ScannedPath":
        """The same path by an odometer of another scale."""
        return self if scale == 1.0 else ScannedPath(self.track * [scale, scale, 1.0], self.ranges)

    @cached_property
    def _scans(self) -> dict[int, ScanWalls]:
        return {}

    def walls(self, view: int) -> ScanWalls:
        """Scan of a view, as its map keeps it."""
        if view not in self._scans:
            self._scans[view] = ScanWalls(self.ranges[view])
        return self._scans[view]


@dataclass(frozen=True, slots=True)
class ScanWindow:
    """Some pairs of a stretch, ``pairs`` (n, 2), laid on each other by their scans.

    ``share`` is that of the beams whose ends are at walls for the other scan too, of those that it could see the end
    of; ``motion`` (3,) where the other path's view of the pair in the middle is as seen from the one's.
    """

    pairs: NDArray[np.intp]
    share: float
    motion: NDArray[np.float64]

    @property
    def middle(self) -> tuple[int, int]:
        """The views of the pair in the middle."""
        return _middle(self.pairs)


def _middle(pairs: NDArray[np.intp]) -> tuple[int, int]:
    """The pair in the middle of some."""
    one, other = pairs[len(pairs) // 2].tolist()
    return one, other


def windows(one: ScannedPath, other: ScannedPath, pairs: NDArray[np.intp]) -> list[ScanWindow]:
    """The windows of a stretch whose views are paired, (n, 2), each where its scans lie best on each other."""
    way = float(ways_along(one.track[pairs[:, 0]])[-1])
    count = min(len(pairs), max(1, round(way / EVERY)))
    return [_window(one, other, part) for part in np.array_split(pairs, count)]


@dataclass(frozen=True, slots=True)
class LaidScans:
    """The windows of a stretch between the first and the last that lie well on each other.

    ``share`` is the mean of theirs, or of all where none does; ``pairs`` (n, 2) are the views that then lie beside
    each other, rising in both; ``middles`` the pair in the middle of each window, with the motion between its views.
    """

    share: float
    pairs: NDArray[np.intp]
    middles: LaidPairs


def laid_on(one: ScannedPath, other: ScannedPath, pairs: NDArray[np.intp], alike: float, same: float) -> LaidScans:
    """Lay the scans of a stretch on each other; what is ``alike`` in a lesser share at its ends is left out.

    So is what odometry puts elsewhere than the longest part of it, since words may go on where paths have parted; and
    one window at either end that keeps the rest from the share ``same``: a view or two of it are beyond the fork. Of
    the window that is left out at either end the views on this side of the fork stay.
    """
    found = windows(one, other, pairs)
    good = [number for number, window in enumerate(found) if window.share >= alike]
    if not good:
        return LaidScans(float(np.mean([window.share for window in found])), pairs[:0], _middles(()))
    held = _longest_held(one, other, found, good)
    begin, end = _parted(found, held[0], held[-1] + 1, same)
    before = _up_to(one, other, found[max(begin - 1, 0) : begin], found[begin], same)
    behind = _up_to(one, other, found[end : end + 1], found[end - 1], same)
    kept = [*before, *found[begin:end], *behind]
    return LaidScans(float(np.mean([window.share for window in kept])), _paired(one, other, kept), _middles(kept))


def _longest_held(one: ScannedPath, other: ScannedPath, found: Sequence[ScanWindow], good: Sequence[int]) -> list[int]:
    """The most of the ``good`` windows, one behind the other, between which both paths' odometry holds."""
    parts = [[good[0]]]
    for before, number in pairwise(good):
        if _bent(one, other, found[before], found[number]):
            parts.append([])
        parts[-1].append(number)
    return max(parts, key=len)


def _bent(one: ScannedPath, other: ScannedPath, before: ScanWindow, after: ScanWindow) -> bool:
    """True where odometry puts the other path's views elsewhere than the scans of the window ``after`` do."""
    off = motions_between(_motion_from(one, other, before, after.middle), after.motion)
    return bool(np.hypot(off[0], off[1]) > BENT[0] or abs(wrapped(off[2])) > BENT[1])


def _motion_from(
    one: ScannedPath, other: ScannedPath, window: ScanWindow, pair: tuple[int, int]
) -> NDArray[np.float64]:
    """Where the other's view of a pair is as seen from the one's, (3,), as a window lies and both odometers go on."""
    (mine, its), (now, then) = window.middle, pair
    gone = motions_between(one.track[mine], one.track[now])
    return motions_between(gone, moved(window.motion, motions_between(other.track[its], other.track[then])))


def _parted(found: Sequence[ScanWindow], begin: int, end: int, same: float) -> tuple[int, int]:
    """The windows from ``begin`` to ``end`` without those at the ends that keep the rest from ``same``, as a range.

    That is the first, the last, or both, which are worse than ``same``; none if that does not help.
    """
    first, last = found[begin].share < same, found[end - 1].share < same
    for begins, ends in ((begin, end), (begin + first, end), (begin, end - last), (begin + first, end - last)):
        if begins < ends and np.mean([window.share for window in found[begins:ends]]) >= same:
            return begins, ends
    return begin, end


def _up_to(
    one: ScannedPath, other: ScannedPath, left: Sequence[ScanWindow], beside: ScanWindow, same: float
) -> list[ScanWindow]:
    """Of a window that was ``left`` out, if any, the most pairs next to the one ``beside`` that lie as it does.

    They lie on each other to the share ``same`` where odometry leads from there. One window of them, or none.
    """
    for pairs in (window.pairs for window in left):
        before = pairs[0, 0] < beside.pairs[0, 0]
        for count in range(len(pairs) - 1, 0, -1):
            part = pairs[-count:] if before else pairs[:count]
            lying = ScanPairs(one, other, part)
            _, motion = lying.refined(_motion_from(one, other, beside, _middle(part)))
            if (share := float(lying.shares(motion[None])[0])) >= same:
                return [ScanWindow(part, share, motion)]
    return []


def _middles(found: Sequence[ScanWindow]) -> LaidPairs:
    views = np.array([window.middle for window in found], np.intp).reshape(-1, 2)
    return LaidPairs(views, np.array([window.motion for window in found]).reshape(-1, 3))


def _paired(one: ScannedPath, other: ScannedPath, found: Sequence[ScanWindow]) -> NDArray[np.intp]:
    """Pairs of views: each of the one, and the nearest of the other as the scans of windows lie on each other."""
    last = np.concatenate([window.pairs[:, 1] for window in found])
    spacing = max(float(np.median(np.diff(ways_along(other.track)))), 0.1)
    reach = round(SLIDE / spacing)
    among = np.arange(max(last.min() - reach, 0), min(last.max() + reach + 1, len(other.track)))
    pairs = []
    for window in found:
        views = np.unique(window.pairs[:, 0])
        beside, off = beside_each(one, other, window.middle, window.motion, views, among)
        near = off <= max(spacing, NEAR)
        pairs.append(np.column_stack([views[near], beside[near]]))
    every = np.concatenate(pairs)
    return np.asarray(every[longest_rising(every[:, 1])], np.intp)


def beside_each(
    one: ScannedPath,
    other: ScannedPath,
    middle: tuple[int, int],
    motion: NDArray[np.float64],
    views: NDArray[np.intp],
    among: NDArray[np.intp],
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The view of the other path ``among`` some that is nearest to each of the one's ``views`` (n,), and how near [m].

    ``motion`` (3,) is where the other's view of a pair, its ``middle``, is as seen from the one's; from there on both
    go by odometry. Infinity where none looks the same way.
    """
    mine, its = middle
    there = moved(motions_between(motion, np.zeros(3)), motions_between(one.track[mine], one.track[views]))
    apart = there[:, None] - motions_between(other.track[its], other.track[among])[None]
    off = np.where(np.abs(wrapped(apart[..., 2])) < ANOTHER_WAY, np.hypot(apart[..., 0], apart[..., 1]), np.inf)
    return among[off.argmin(axis=1)], off.min(axis=1)


def longest_rising(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Indices of the longest rising part of a sequence: one number out of order costs no more than itself."""
    lengths, before = np.zeros(len(numbers), np.intp), np.full(len(numbers), -1)
    for i, number in enumerate(numbers):
        lower = np.where(numbers[:i] < number, lengths[:i], 0)
        if lower.any():
            before[i] = lower.argmax()
        lengths[i] = 1 + lower.max(initial=0)
    kept, i = [], int(lengths.argmax()) if len(numbers) else -1
    while i >= 0:
        kept.append(i)
        i = int(before[i])
    return np.array(kept[::-1], np.intp)


def _window(one: ScannedPath, other: ScannedPath, pairs: NDArray[np.intp]) -> ScanWindow:
    """Lay the scans of some pairs on each other: a coarse grid, then finer ones around the best and where they were."""
    lying = ScanPairs(one, other, pairs)
    steps = [np.linspace(-far, far, count) for far, count in ((SLIDE, 10), (ASIDE, 7), (ASKEW, 17))]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    worth = lying.worth(grid, BEAMS)
    near = np.hypot(*grid[:, :2].T) < 0.5
    found = max(
        (lying.refined(start) for start in (np.zeros(3), grid[near][worth[near].argmax()], grid[worth.argmax()])),
        key=lambda best: best[0],
    )
    return ScanWindow(pairs, float(lying.shares(found[1][None])[0]), found[1])


class ScanPairs:
    """Pairs of scans, at most ``SCANS`` of those of a window, to be laid on each other by one relative pose."""

    def __init__(self, one: ScannedPath, other: ScannedPath, pairs: NDArray[np.intp]) -> None:
        some = pairs[:: -(-len(pairs) // SCANS)]
        middle = pairs[len(pairs) // 2]
        self._walls = [(one.walls(i), other.walls(j)) for i, j in some.tolist()]
        self._mine = motions_between(one.track[middle[0]], one.track[some[:, 0]])
        self._its = motions_between(other.track[middle[1]], other.track[some[:, 1]])

    def shares(self, motions: NDArray[np.float64], every: int = 1) -> NDArray[np.float64]:
        """Share of the beams that meet walls, for each pose (m, 3) of the other's middle view in the one's."""
        met, through = np.zeros(len(motions)), np.zeros(len(motions))
        for (ours, theirs), mine, its in zip(self._walls, self._mine, self._its, strict=True):
            poses = motions_between(mine, moved(motions, its))
            back = motions_between(poses, np.zeros(3))
            for walls, points, at in ((ours, theirs.points, poses), (theirs, ours.points, back)):
                at_walls, seen_through = walls.met(points[::every], at)
                met, through = met + at_walls, through + seen_through
        return np.asarray(met / np.maximum(met + through, 1.0))

    def worth(self, motions: NDArray[np.float64], every: int = 1) -> NDArray[np.float64]:
        """Shares, less what a shift has to bring."""
        return self.shares(motions, every) - STAYS * np.hypot(motions[:, 0], motions[:, 1])

    def refined(self, start: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """The best relative pose around one, and its worth."""
        best, worth = start, 0.0
        for far, turned in FINER:
            steps = [np.linspace(-far, far, 5)] * 2 + [np.linspace(-turned, turned, 5)]
            grid = best + np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
            worths = self.worth(grid)
            best, worth = grid[worths.argmax()], float(worths.max())
        return worth, best
