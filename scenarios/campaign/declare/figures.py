"""The figures that a scenario can expect something of: by name, with their unit and what they mean.

Those of missions are told in ``refseq_bench.scenarios.campaign.declare.mission_figures``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.recovery import median_way

if TYPE_CHECKING:
    from refseq_bench.scenarios.scoring.atlas import JoinScore
    from refseq_bench.scenarios.scoring.figures import Figures
    from refseq_bench.scenarios.scoring.metrics import Retrieval


class Unit(StrEnum):
    """Unit of a figure, as it may be written behind a number."""

    SHARE = "%"
    METRES = "m"
    VIEWS = "views"
    MILLISECONDS = "ms"
    SECONDS = "s"
    NONE = "no unit"


Of = TypeVar("Of")


def _never(_: object) -> bool:
    """No method is free of a figure that all have."""
    return False


@dataclass(frozen=True)
class Figure(Generic[Of]):
    """A figure to expect something of: how to take it from a method's figures (nan: none), its unit, its meaning.

    A share is a number from 0 to 1. One that does not need ``truth`` can be told of drives without true poses. A method
    for which ``faultless`` holds has no such figure because it failed nowhere: it cannot miss an expectation of it.
    """

    take: Callable[[Of], float]
    unit: Unit
    meaning: str
    truth: bool = True
    faultless: Callable[[Of], bool] = _never


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _retrieved(found: "Figures", take: Callable[["Retrieval"], float]) -> float:
    return take(found.wide.retrieval) if found.wide.retrieval else math.nan


def _harm(found: "Figures") -> float:
    return math.nan if found.harm is None else float(found.harm.successes)


def _joined(found: "Figures", take: Callable[["JoinScore"], float]) -> float:
    return take(found.atlas.joined) if found.atlas and found.atlas.joined else math.nan


def _mean_share(where: str, found: "Figures") -> float | None:
    shares = getattr(found.atlas.shares, where) if found.atlas else ()
    return float(np.mean(shares)) if shares else None


def _share(take: Callable[["Figures"], float], meaning: str) -> Figure["Figures"]:
    return Figure(take, Unit.SHARE, meaning)


def _views(take: Callable[["Figures"], int], meaning: str) -> Figure["Figures"]:
    return Figure(lambda found: float(take(found)), Unit.VIEWS, meaning)


def _metres(take: Callable[["Figures"], float], meaning: str) -> Figure["Figures"]:
    return Figure(take, Unit.METRES, meaning)


def _without_truth(take: Callable[["Figures"], float], unit: Unit, meaning: str) -> Figure["Figures"]:
    return Figure(take, unit, meaning, truth=False)


def _plain(take: Callable[["Figures"], float | None], meaning: str) -> Figure["Figures"]:
    return Figure(lambda found: _or_nan(take(found)), Unit.NONE, meaning)


FIGURES: Mapping[str, Figure["Figures"]] = MappingProxyType(
    {
        "success": _share(lambda f: f.wide.success.value, "right within score.within, of the views on the map"),
        "success_narrow": _share(lambda f: f.narrow.success.value, "right within score.narrow, of those on the map"),
        "within_1_place": _share(lambda f: f.wide.within_places(1).value, "at most one place from the right one"),
        "within_2_places": _share(lambda f: f.wide.within_places(2).value, "at most two places from the right one"),
        "within_5_places": _share(lambda f: f.wide.within_places(5).value, "at most five places from the right one"),
        "accuracy": _share(lambda f: f.wide.accuracy.value, "right on the map or said to be lost off it, of all views"),
        "failures": _views(lambda f: f.wide.failures, "wrong and missed"),
        "failures_narrow": _views(lambda f: f.narrow.failures, "the same within score.narrow"),
        "wrong": _views(lambda f: f.wide.count(Outcome.WRONG), "answered elsewhere, on the map"),
        "missed": _views(lambda f: f.wide.count(Outcome.MISSED), "said to be lost, on the map"),
        "false_fixes": _views(lambda f: f.wide.count(Outcome.FALSE_FIX), "answered off the map"),
        "harm": Figure(_harm, Unit.VIEWS, "wrong where the same method's single view is right"),
        "recall_1": _share(lambda f: f.wide.recall(1).value, "right place most probable, lost or not"),
        "recall_5": _share(lambda f: f.wide.recall(5).value, "right place among the 5 most probable"),
        "recall_10": _share(lambda f: f.wide.recall(10).value, "right place among the 10 most probable"),
        "auc": _plain(lambda f: _retrieved(f, lambda curve: curve.auc), "area under precision and recall"),
        "recall_at_100": _share(lambda f: _retrieved(f, lambda c: c.recall_at(1.0)), "recall at 100 % precision"),
        "recall_at_99": _share(lambda f: _retrieved(f, lambda c: c.recall_at(0.99)), "recall at 99 % precision"),
        "lost_auroc": _plain(lambda f: f.wide.auroc, "area under the ROC curve of P(lost)"),
        "lost_fpr": _share(lambda f: _or_nan(f.wide.false_alarms), "false alarms to catch 95 % of what is off the map"),
        "lost_ece": _plain(lambda f: f.wide.lost_reliability.error, "calibration error of P(lost)"),
        "ece": _plain(
            lambda f: f.wide.mass_reliability.error, "calibration error of the probability around the top place"
        ),
        "entropy_auroc": Figure(
            lambda f: _or_nan(f.wide.entropy_auroc),
            Unit.NONE,
            "chance that a wrong belief has more entropy",
            faultless=lambda f: f.wide.count(Outcome.RIGHT) > 0 and not f.wide.count(Outcome.WRONG),
        ),
        "error_median": _metres(lambda f: f.wide.error_quantile(0.5), "error along the path, median"),
        "error_p95": _metres(lambda f: f.wide.error_quantile(0.95), "error along the path, 95th percentile"),
        "worst_false_fix": _metres(
            lambda f: f.wide.worst_false_fix, "farthest that an answer off the map lay, 0 without any"
        ),
        "last_sure": _metres(
            lambda f: f.wide.last_sure_median, "from where it says that it was last sure to where it left, median"
        ),
        "to_lost": _metres(lambda f: median_way(f.wide.recovery.to_lost), "way to say lost, median"),
        "to_recover": _metres(lambda f: median_way(f.wide.recovery.to_recover), "way to be right again, median"),
        "to_first_fix": _metres(lambda f: median_way(f.wide.first_fixes), "way to the first right answer, median"),
        "to_settle": _metres(
            lambda f: median_way(f.atlas.forks) if f.atlas else math.nan, "way after a fork to P(right) > 0.9, median"
        ),
        **{
            f"sequence_{where}": _plain(partial(_mean_share, where), f"P(s) of the path driven, {meaning}, mean")
            for where, meaning in (
                ("before", "before it comes to a stretch that paths share"),
                ("on", "on such a stretch"),
                ("behind", "behind its fork"),
            )
        },
        "jumps": Figure(
            lambda f: math.nan if f.atlas is None or f.atlas.jumps is None else float(f.atlas.jumps),
            Unit.VIEWS,
            "answers that no drive led to, by true poses",
        ),
        "join_precision": _share(
            lambda f: _joined(f, lambda j: j.precision.value), "rightly joined, of views taken out"
        ),
        "join_recall": _share(lambda f: _joined(f, lambda j: j.recall.value), "joined, of views that drives share"),
        "false_joins": _plain(lambda f: _joined(f, lambda j: _or_nan(j.false_joins)), "joins of different places"),
        "duplicates": _plain(lambda f: _joined(f, lambda j: _or_nan(j.duplicates)), "places that are there twice"),
        "places_left": _without_truth(
            lambda f: _joined(f, lambda j: j.places / j.views), Unit.SHARE, "places of the atlas, of views learnt"
        ),
        "bytes_left": _without_truth(
            lambda f: _joined(f, lambda j: j.bytes_after / j.bytes_before),
            Unit.SHARE,
            "size of the atlas, of all its maps",
        ),
        "says_lost": _without_truth(lambda f: f.consistency.lost.value, Unit.SHARE, "views at which it says lost"),
        "odometry_jumps": _without_truth(
            lambda f: f.consistency.jumps.value, Unit.SHARE, "steps between answers that odometry does not allow"
        ),
        "odometry_slope": _without_truth(
            lambda f: f.consistency.fit.slope, Unit.NONE, "metres along the map for each of the odometer"
        ),
        "odometry_residual": _without_truth(
            lambda f: f.consistency.fit.residual, Unit.METRES, "what that line leaves, root of the mean square"
        ),
        "entropy": _without_truth(lambda f: f.consistency.entropy, Unit.NONE, "of the beliefs, mean [nats]"),
        "agreement": _without_truth(
            lambda f: f.consistency.agreement.value, Unit.SHARE, "answers that mean the place of the other methods'"
        ),
        "milliseconds": _without_truth(lambda f: f.cost, Unit.MILLISECONDS, "time a view without features, median"),
    }
)
"""Figures that an expectation may name."""
