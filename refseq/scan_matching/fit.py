"""Where one scan was taken as seen from another: coarse to fine, with its uncertainty.

At first beams are counted that meet the other's walls, on a grid of poses. From the best on, least squares move ends of
beams onto straight pieces of wall, in both directions, and far ones weigh less and less (Y. Chen and G. Medioni,
"Object modelling by registration of multiple range images", 1992; weights of S. Geman and D. McClure). What no wall
tells stays where it is assumed to be: along a bare corridor the covariance is that of the assumption.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.pose_graph import motions_between
from refseq.scan_matching.beams_at_walls import BeamsAtWalls, BeamsOfPairs, slopes_of_ways
from refseq.scan_matching.lines import ROUNDED, WallLines
from refseq.scan_matching.walls import ScanWalls

REACH, TURN = 0.7, np.radians(25.0)
"""The other scan is sought up to so far along and aside [m], and turned so far [rad]."""
GRID = np.stack(
    np.meshgrid(*[np.linspace(-far, far, n) for far, n in ((REACH, 7), (REACH, 7), (TURN, 9))], indexing="ij"),
    axis=-1,
).reshape(-1, 3)
BEAMS = 6
"""Every so many-th beam is looked at on the grid."""
STAYS = 0.01, 0.02
"""Share of the beams that a metre of shift and a radian of turn have to bring: in bare corridors all are alike."""
ASSUMED = np.array([0.5, 0.5, np.radians(15.0)])
"""Standard deviations of where the other scan is taken to be before the walls tell [m, m, rad]."""
TOLD_BEFORE = ASSUMED**-2
"""The information that this is."""
SCALES = (0.3, 0.2, 0.1, 0.1, 0.05, 0.05, 0.05)
"""Distances from a wall at which an end of a beam has a quarter of its weight [m], step by step."""
INDEPENDENT = 0.2
"""Share of the beams whose errors are taken as independent: what is off is off for many. More makes poses surer."""
BEYOND = 0.25
"""A pose may come to lie so far beyond where it was sought [m, and share of the turn]."""
FARTHEST = REACH + BEYOND
"""No pose lies farther along or aside from where it was sought [m]."""
CLOSE = 0.03
"""Ends of beams so near to a wall [m] are of it, where scores are counted. More forgives more."""
FEWEST = 20
"""Fewer beams tell nothing."""
BUNCH = 64
"""So many pairs are laid at once: more are no faster, and take more memory."""
NONE = 1e-300
"""Weight of no beams, to divide by."""
FARTHER = np.hypot(*GRID[:, :2].T) * STAYS[0] + np.abs(GRID[:, 2]) * STAYS[1]
"""Share that each pose of the grid has to bring more than the middle one."""
SIX = np.triu_indices(3)
NINE = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
"""Entries of a symmetric matrix: the six that differ, row and column, and which of them each of the nine is."""


class LaidScan:
    """A scan by degrees, ``ranges`` (360,) [m], made ready to be laid on others."""

    def __init__(self, ranges: NDArray[np.float64]) -> None:
        self._ranges = ranges

    @cached_property
    def walls(self) -> ScanWalls:
        """Its walls, to be met."""
        return ScanWalls(self._ranges)

    @cached_property
    def lines(self) -> WallLines:
        """Straight pieces of them."""
        return WallLines(self._ranges)


def laid_scan(kept: NDArray[np.uint16] | None) -> LaidScan | None:
    """A scan as maps keep it, (360,) [cm]; None where there is none, or too few of its beams end on straight walls."""
    scan = None if kept is None else LaidScan(kept / 100.0)
    return scan if scan is not None and len(scan.lines.ends) >= FEWEST else None


@dataclass(frozen=True, slots=True)
class ScanFit:
    """Where another scan was taken as seen from one: ``motion`` (3,), ahead and to the left [m], turned [rad].

    ``covariance`` (3, 3) is of the same. ``share`` is that of the beams that meet walls for both scans, of those whose
    ends both could see. ``score`` is that times the share of beams on straight walls that end at one of the other scan
    within ``CLOSE``: a place that only looks like it leaves more of them off.
    """

    motion: NDArray[np.float64]
    covariance: NDArray[np.float64]
    share: float
    score: float


def fitted(
    pairs: Sequence[tuple[LaidScan, LaidScan]], about: NDArray[np.float64] | None = None
) -> list[ScanFit | None]:
    """Lay the second scan of each pair on the first; None where too few beams meet, or only beyond where it is sought.

    It is sought ``about`` motions (P, 3), where the first was taken by default. Of a pair the same is found among
    others as alone, but for rounding.
    """
    about = np.zeros((len(pairs), 3)) if about is None else about
    bunches = [slice(start, start + BUNCH) for start in range(0, len(pairs), BUNCH)]
    return [fit for bunch in bunches for fit in _refined(pairs[bunch], about[bunch])]


def _start(one: LaidScan, other: LaidScan, about: NDArray[np.float64]) -> NDArray[np.float64]:
    """The best pose of the grid about a motion (3,), (3,)."""
    grid = GRID + about
    return np.asarray(grid[(shares(one, other, grid, BEAMS) - FARTHER).argmax()])


def shares(one: LaidScan, other: LaidScan, motions: NDArray[np.float64], every: int = 1) -> NDArray[np.float64]:
    """Share of the beams that meet walls for both, for each pose (m, 3) of the other scan in the one's."""
    met, through = one.walls.met(other.walls.points[::every], motions)
    back = other.walls.met(one.walls.points[::every], motions_between(motions, np.zeros(3)))
    met, through = met + back[0], through + back[1]
    return np.asarray(met / np.maximum(met + through, 1))


def _refined(pairs: Sequence[tuple[LaidScan, LaidScan]], about: NDArray[np.float64]) -> list[ScanFit | None]:
    """Least squares from the grids about motions (P, 3) on: Gauss and Newton, with weights that grow sharper."""
    motions = np.stack([_start(*pair, near) for pair, near in zip(pairs, about, strict=True)])
    beams, P = BeamsOfPairs([(one.lines, other.lines) for one, other in pairs]), len(pairs)
    lies = np.ones(P, np.bool_)
    for scale in SCALES:
        met = beams.met(motions)
        lies &= np.bincount(met.pair, minlength=P) >= FEWEST
        step = _step(met, motions, about, scale)
        motions = step.motions
    off = np.abs(motions - about)
    lies &= (off[:, :2].max(axis=1) <= FARTHEST) & (off[:, 2] <= TURN * (1 + BEYOND))
    covariances, met = _covariances(met, step), beams.met(motions)
    close = np.bincount(met.pair[np.abs(met.errors) < CLOSE], minlength=P) / np.maximum(beams.counts, 1)
    found: list[ScanFit | None] = [None] * P
    for p in np.flatnonzero(lies).tolist():
        share = float(shares(*pairs[p], motions[p : p + 1])[0])
        found[p] = ScanFit(motions[p], covariances[p], share, share * float(close[p]))
    return found


class _Step(NamedTuple):
    """A step of least squares: ``motions`` (P, 3) that it leads to.

    ``weights`` (n,) are those of the beams, ``by_motion`` (2 P, 3, 3) the slopes of both ways' poses, and ``known``
    (P, 3, 3) is the information that the beams hold of each motion.
    """

    motions: NDArray[np.float64]
    weights: NDArray[np.float64]
    by_motion: NDArray[np.float64]
    known: NDArray[np.float64]


def _step(met: BeamsAtWalls, motions: NDArray[np.float64], about: NDArray[np.float64], scale: float) -> _Step:
    """From motions (P, 3) on, with beams weighed by their distance from walls on a ``scale`` [m]."""
    P, by_motion = len(motions), slopes_of_ways(motions)
    weights = 1 / np.square(1 + np.square(met.errors / scale))
    whole = np.maximum(np.bincount(met.pair, weights, P), NONE)
    variance = ROUNDED**2 + np.bincount(met.pair, weights * np.square(met.errors), P) / whole
    weights *= INDEPENDENT / variance[met.pair]
    known = _of_pairs(_squares(met.way, met.slopes, weights, P), by_motion)
    slope = (_sums(met.way, met.slopes * (weights * met.errors), P)[:, None] @ by_motion).reshape(P, 2, 3).sum(axis=1)
    slope += (motions - about) * TOLD_BEFORE
    ahead = np.linalg.solve(known + np.diag(TOLD_BEFORE), slope[:, :, None])[:, :, 0]
    return _Step(motions - ahead, weights, by_motion, known)


def _covariances(met: BeamsAtWalls, step: _Step) -> NDArray[np.float64]:
    """Those of the motions, (P, 3, 3)."""
    # Of a wall whose direction is uncertain some of what it seems to tell along itself is chance.
    by_chance = _of_pairs(_squares(met.way, met.along, step.weights * met.turns, len(step.motions)), step.by_motion)
    return np.asarray(np.linalg.inv(_without_negative(step.known - by_chance) + np.diag(TOLD_BEFORE)), np.float64)


def _of_pairs(squares: NDArray[np.float64], by_motion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squares (2 P, 3, 3) of slopes by each way's pose, as those by the motion of each pair, (P, 3, 3)."""
    of_ways = by_motion.transpose(0, 2, 1) @ squares @ by_motion
    return np.asarray(of_ways.reshape(-1, 2, 3, 3).sum(axis=1))


def _sums(way: NDArray[np.intp], values: NDArray[np.float64], P: int) -> NDArray[np.float64]:
    """Sums of ``values`` (m, n) by way, (2 P, m)."""
    return np.stack([np.bincount(way, one, 2 * P) for one in values], axis=1)


def _squares(
    way: NDArray[np.intp], slopes: NDArray[np.float64], weights: NDArray[np.float64], P: int
) -> NDArray[np.float64]:
    """Weighed sums of the products of slopes (3, n) by way, (2 P, 3, 3)."""
    return _sums(way, slopes[SIX[0]] * slopes[SIX[1]] * weights, P)[:, NINE]


def _without_negative(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same (P, 3, 3) with nothing below 0 in any direction; headings are weighed as at one metre."""
    values, axes = np.linalg.eigh(information)
    return np.asarray((axes * np.maximum(values, 0.0)[:, None, :]) @ np.moveaxis(axes, 1, 2))
