"""Truth that does not fit its drive: of another log or another time, with columns swapped, in other units.

Odometry drifts, and yet over a few metres it tells the way that was driven; a truth that tells another way, piece by
piece, is not of this drive, and a score by it would mean nothing.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import dead_reckoned
from refseq.planar import wrapped
from refseq.pose_graph import cuts, motions_between, ways_along
from refseq.view import View
from refseq_bench.scenarios.drives.truth.clock import true_poses, truth_clock
from refseq_bench.scenarios.errors import ScenarioError

PIECES = (5.0, 20.0)
"""The way is compared in pieces of so many metres by odometry, and those count that fit better: odometry drifts over
long ones, and positions by satellite tremble over short ones."""
OFF, TURNED = 0.3, np.radians(30.0)
"""A piece fits whose end the truth puts no farther from where odometry does than this share of its length, and whose
turn is no other by more than this [rad]. Of the raw logs of fr079, ACES and MIT CSAIL 95 to 97 % of the pieces fit."""
FEWEST = 4
"""Pieces below which nothing is told."""
REFUSED, DOUBTED = 0.65, 0.8
"""A truth of which a lesser share of pieces fits is refused, or told of. A mirrored way fits where it is straight."""
STRETCHED = 0.08
"""Share by which odometry and truth may differ in length; the raw logs differ by 1 to 5 %."""
ASIDE = np.radians(45.0)
"""Headings that point so far beside the way driven [rad] are told of: a sensor that looks aside, or columns swapped."""
KNOWN = 0.9
"""Share of the views that should have a true pose; with less it is told."""


@dataclass(frozen=True, slots=True)
class TruthFit:
    """Agreement of true poses with odometry: ``fitting`` of ``pieces`` of the way, ``metres`` long each, tell the same.

    Its headings are turned by ``aside`` [rad] against the odometry's throughout; odometry shows ``length`` metres for
    each true one, the median over pieces that fit, nan where none does.
    """

    metres: float
    pieces: int
    fitting: int
    aside: float
    length: float

    @property
    def share(self) -> float:
        """Share of the pieces that fit."""
        return self.fitting / self.pieces


def truth_fit(views: Sequence[View]) -> TruthFit | None:
    """Compare the true poses of views with their odometry; None where there is too little of either."""
    return _fit_where_known(true_poses(views), dead_reckoned(views))


def _fit_where_known(truth: NDArray[np.float64], odometry: NDArray[np.float64]) -> TruthFit | None:
    """The same of poses of views, (n, 3) each, those of the truth nan where they are not known."""
    known = np.isfinite(truth).all(axis=1)
    return fit_of(truth[known], odometry[known]) if known.sum() >= 2 and len(odometry) else None


def fit_of(truth: NDArray[np.float64], odometry: NDArray[np.float64]) -> TruthFit | None:
    """Compare poses with those by odometry, (n, 3) each of x, y [m], heading [rad], piece by piece of the way."""
    found = filter(None, (_fit_of(truth, odometry, metres) for metres in PIECES))
    return max(found, key=lambda fit: fit.share, default=None)


def _fit_of(truth: NDArray[np.float64], odometry: NDArray[np.float64], metres: float) -> TruthFit | None:
    """The same by pieces of so many metres; None where they are too few."""
    way = ways_along(odometry)
    ends = cuts(way, metres)
    if len(ends) <= FEWEST:
        return None
    true, told = (_motions(poses[ends]) for poses in (truth, odometry))
    length = np.diff(way[ends])
    turns_fit = np.abs(wrapped(true[:, 2] - told[:, 2])) < TURNED
    asides = np.arctan2(true[:, 1], true[:, 0]) - np.arctan2(told[:, 1], told[:, 0])  # (pieces,)
    counts = [int((turns_fit & _ends_fit(true, told, aside, length)).sum()) for aside in (0.0, *asides.tolist())]
    best = int(np.argmax(counts))  # of equals the first: headings as they are
    aside = 0.0 if best == 0 else float(wrapped(asides[best - 1]))
    fits = turns_fit & _ends_fit(true, told, aside, length)
    shown = np.hypot(*told[fits, :2].T) / np.maximum(np.hypot(*true[fits, :2].T), 1e-9)
    return TruthFit(metres, len(length), counts[best], aside, float(np.median(shown)) if len(shown) else float("nan"))


def _motions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Each pose as seen from the one before, (n - 1, 3)."""
    return motions_between(poses[:-1], poses[1:])


def _ends_fit(
    true: NDArray[np.float64], told: NDArray[np.float64], aside: float, length: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """True for motions that end alike, those told turned by ``aside``."""
    turn = np.array([[np.cos(aside), np.sin(aside)], [-np.sin(aside), np.cos(aside)]])
    return np.asarray(np.hypot(*(true[:, :2] - told[:, :2] @ turn).T) < OFF * length)


@dataclass(frozen=True, slots=True)
class TruthDoubt:
    """A sentence about true poses that do not go with their drive's odometry; ``refused`` where hardly any does."""

    told: str
    refused: bool = False


def truth_doubt(views: Sequence[View], truth: str, drive: str, late: float = 0.0) -> TruthDoubt | None:
    """Doubt about the true poses of some views, None: nothing against them.

    ``truth`` and ``drive`` are their names, ``late`` [s] is what the truth was set back by.
    """
    fit = truth_fit(views)
    if fit is None:
        return None
    clock = _told_clock(views, drive, late)
    scale = "" if clock or fit.share >= DOUBTED else _told_scale(views, drive)
    told = scale or f"{fit.fitting} of {fit.pieces} pieces of {fit.metres:g} m go as the odometry of {drive} does"
    if fit.share < REFUSED:
        valid = "the true poses of this drive at its times, x before y, in metres, headings in radians"
        seems = f"; {clock}" if clock else ""
        return TruthDoubt(f"{truth}: tells another way: {told}; valid are {valid}{seems}", refused=True)
    if clock:
        return TruthDoubt(f"{truth}: {clock}")
    if fit.share < DOUBTED:
        causes = "" if scale else "; look for a mirrored axis, other units or times, or odometry that slipped"
        return TruthDoubt(f"{truth}: hardly fits: {told}{causes}")
    if abs(fit.aside) > ASIDE:
        aside = f"{np.degrees(fit.aside):+.0f}° beside the way of {drive}"
        return TruthDoubt(f"{truth}: its headings point {aside}: a sensor that looks aside, or x and y swapped")
    if abs(fit.length - 1) > STRETCHED:
        return TruthDoubt(f"{truth}: the odometry of {drive} shows {fit.length:.2f} m for each metre of it")
    return None


UNITS = {"centimetres": 100.0, "millimetres": 1000.0, "feet": 1 / 0.3048, "inches": 1 / 0.0254}
"""Units, and how many are a metre."""
NEARLY = 0.06
"""Share by which a scale may be off a unit's: that of odometry is off by up to 5 %."""


def _told_scale(views: Sequence[View], drive: str) -> str:
    """A sentence on odometry that goes the true way in another unit; empty unless it fits when that is set right."""
    truth, odometry = true_poses(views), dead_reckoned(views)
    known = np.isfinite(truth).all(axis=1)
    if not len(odometry) or known.sum() < 2:
        return ""
    truth, odometry = truth[known], odometry[known]
    ends = cuts(ways_along(truth), PIECES[0])
    lengths = [np.hypot(*np.diff(poses[ends, :2], axis=0).T) for poses in (odometry, truth)]
    scale = float(np.median(lengths[0] / np.maximum(lengths[1], 1e-9))) if len(ends) > 1 else 0.0
    if scale <= 0 or abs(scale - 1) <= STRETCHED:
        return ""
    fit = fit_of(truth, odometry / np.array([scale, scale, 1.0]))
    if fit is None or fit.share < DOUBTED:
        return ""
    told = f"the odometry of {drive} goes {scale:.3g} m for each metre of it, and fits but for that"
    for unit, count in UNITS.items():
        for whose, of in (("the odometry", scale), ("the truth", 1 / scale)):
            if abs(of / count - 1) < NEARLY:
                return f"{told}: is {whose} in {unit}?"
    return f"{told}: one of both is not in metres"


def _told_clock(views: Sequence[View], drive: str, late: float) -> str:
    """A sentence on true poses of another clock than the odometry; empty unless they fit when that is set right."""
    clock = truth_clock(views)
    if clock is None:
        return ""
    fit = _fit_where_known(true_poses(views, clock.late), dead_reckoned(views))
    if fit is None or fit.share < DOUBTED:
        return ""
    word, right = "late" if clock.late > 0 else "early", late + clock.late
    return (
        f"its clock is {abs(clock.late):.2f} ± {clock.error:.2f} s {word} against the odometry of {drive}, by corners "
        f"and speed; --late truth={right:.2f} sets it right"
    )


def check_truth(views: Sequence[View], truth: str, drive: str, late: float = 0.0) -> None:
    """Refuse a truth, given beside a drive, that tells another way; what is doubtful is a warning.

    ``late`` [s] is what it was set back by. Raises ``ScenarioError``.
    """
    doubt = truth_doubt(views, truth, drive, late)
    if doubt and doubt.refused:
        raise ScenarioError(doubt.told)
    if doubt:
        _warn(doubt.told)
    known = sum(view.truth is not None for view in views)
    if 0 < known < KNOWN * len(views):
        _warn(f"{truth}: has true poses of {known} of the {len(views)} views of {drive}; the others are not scored")


def _warn(line: str) -> None:
    logging.getLogger(__name__).warning("%s", line)
