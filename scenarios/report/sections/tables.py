"""The tables of a report: what the figures of each method are in words."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scenarios.report.page import duration_text, metres, number, size_text, ways
from scenarios.scoring.comparison import Comparison, method_label
from scenarios.scoring.cost import Cost
from scenarios.scoring.figures import STEPS, Figures, figures_record, step_times, success_over_seeds
from scenarios.scoring.outcome import Outcome
from scenarios.scoring.score import PLACES_OFF, RANKS, Score
from scenarios.scoring.tables import NONE


@dataclass(frozen=True)
class MethodRow:
    """One method's figures, in words; ``judged`` says whether verdicts are about it."""

    label: str
    views: str
    success: str
    success_narrow: str
    over_seeds: str
    failures: str
    median: str
    p95: str
    judged: bool


@dataclass(frozen=True)
class FurtherRow:
    """More figures of one method, in words."""

    label: str
    outcomes: str
    first_fix: str
    harm: str
    auc: str
    recall: str
    first_places: str
    near_places: str
    calibration: str
    entropy: str


@dataclass(frozen=True)
class LostRow:
    """How one method did off the map, in words."""

    label: str
    auroc: str
    false_alarms: str
    calibration: str
    to_lost: str
    to_recover: str
    worst: str


@dataclass(frozen=True)
class CostRow:
    """What one method cost, in words."""

    label: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class CostTable:
    """Milliseconds a view for each of ``STEPS``, and where costs are known (``kept``) what they tell beside."""

    headings: tuple[str, ...]
    rows: tuple[CostRow, ...]
    kept: bool


@dataclass(frozen=True)
class FigureRow:
    """One figure of all methods, as the files of figures have it."""

    name: str
    values: tuple[str, ...]


def method_row(one: Figures, *, judged: bool) -> MethodRow:
    """The row of the first table."""
    wide, narrow = one.wide, one.narrow
    return MethodRow(
        label=method_label(one.method),
        views=f"{wide.success.trials} / {narrow.success.trials}",
        success=str(wide.success),
        success_narrow=str(narrow.success),
        over_seeds=" / ".join(_over_seeds(runs) for runs in (one.wide_runs, one.narrow_runs)),
        failures=str(wide.failures),
        median=metres(wide.error_quantile(0.5)),
        p95=metres(wide.error_quantile(0.95)),
        judged=judged,
    )


def _over_seeds(runs: Sequence[Score]) -> str:
    """The 95 % interval of success over seeds."""
    found = success_over_seeds(runs)
    return NONE if found is None else f"[{100 * found[0]:.1f}, {100 * found[1]:.1f}]"


def further_row(one: Figures) -> FurtherRow:
    """The row of the second table."""
    pooled, curve, spoilt = one.wide, one.wide.retrieval, one.harm
    kinds = (Outcome.WRONG, Outcome.MISSED, Outcome.FALSE_FIX, Outcome.REJECTED)
    return FurtherRow(
        label=method_label(one.method),
        outcomes=" / ".join(str(pooled.count(kind)) for kind in kinds),
        first_fix=ways(pooled.first_fixes),
        harm=NONE if spoilt is None else f"{spoilt.successes} of {spoilt.trials}",
        auc=NONE if curve is None else f"{curve.auc:.3f}",
        recall=NONE if curve is None else f"{100 * curve.recall_at(1.0):.0f} / {100 * curve.recall_at(0.99):.0f} %",
        first_places=_first_places(pooled),
        near_places=_near_places(pooled),
        calibration=number(pooled.top_reliability.error),
        entropy=number(pooled.entropy_auroc),
    )


def lost_row(method: str, pooled: Score) -> LostRow:
    """The row of the table of what happened off the map."""
    return LostRow(
        label=method_label(method),
        auroc=number(pooled.auroc),
        false_alarms=NONE if pooled.false_alarms is None else f"{100 * pooled.false_alarms:.0f} %",
        calibration=number(pooled.lost_reliability.error),
        to_lost=ways(pooled.recovery.to_lost),
        to_recover=ways(pooled.recovery.to_recover),
        worst=metres(pooled.worst_false_fix),
    )


def _first_places(pooled: Score) -> str:
    """Recall at 1, 5 and 10 places [%]."""
    recalls = [pooled.recall(first) for first in RANKS]
    return NONE if not recalls[0].trials else " / ".join(f"{100 * share.value:.0f}" for share in recalls) + " %"


def _near_places(pooled: Score) -> str:
    """Answers within 1, 2 and 5 places of the right one [%]."""
    near = [pooled.within_places(places) for places in PLACES_OFF]
    return NONE if not near[0].trials else " / ".join(f"{100 * share.value:.0f}" for share in near) + " %"


def cost_table(runs: Sequence[Comparison], methods: Sequence[str], costs: Mapping[str, Sequence[Cost]]) -> CostTable:
    """What each method cost; no row where no time was taken."""
    taken = {method: [belief.timings for run in runs for belief in run.beliefs[method]] for method in methods}
    headings = (*(f"{step} [ms]" for step in STEPS), *(KEPT if costs else ()))
    if not costs and not any(timing.total for timings in taken.values() for timing in timings):
        return CostTable(headings, (), False)
    times = {method: step_times(timings).values() for method, timings in taken.items()}
    rows = (
        CostRow(method_label(m), (*(f"{t.median:.2f} / {t.p95:.2f}" for t in times[m]), *_kept(costs.get(m, ()))))
        for m in methods
    )
    return CostTable(headings, tuple(rows), bool(costs))


KEPT = ("bytes a place", "features a place", "kept in all", "learning", "answering", "most memory")
"""What a ``Cost`` tells."""


def _kept(costs: Sequence[Cost]) -> tuple[str, ...]:
    """The mean over the drives, of memory the most."""
    if not costs:
        return ()
    places = math.fsum(cost.places for cost in costs)
    kept = math.fsum(cost.bytes_kept for cost in costs)
    features = [cost.features for cost in costs if cost.features is not None]
    return (
        size_text(kept / places),
        f"{math.fsum(features) / places:.0f}" if features else NONE,
        size_text(kept / len(costs)),
        duration_text(math.fsum(cost.learn_s for cost in costs) / len(costs)),
        duration_text(math.fsum(cost.answer_s for cost in costs) / len(costs)),
        size_text(max(cost.peak_bytes for cost in costs)),
    )


def figure_rows(found: Sequence[Figures]) -> list[FigureRow]:
    """All figures that a file of figures has, a row each, a column a method."""
    records = [figures_record(one) for one in found]
    names = dict.fromkeys(name for record in records for name in record)
    return [FigureRow(name, tuple(_plain(record.get(name)) for record in records)) for name in names]


def _plain(value: object) -> str:
    return NONE if value is None else str(value)
