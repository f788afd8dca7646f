"""Tables of the methods' figures, in words."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from refseq_bench.scenarios.report.page import PageRow, PageTable
from refseq_bench.scenarios.report.words import distances, duration_text, metres, size_text
from refseq_bench.scenarios.scoring.comparison import Comparison, method_label
from refseq_bench.scenarios.scoring.cost import Cost
from refseq_bench.scenarios.scoring.figures import STEPS, Figures, figures_record, step_times, success_over_seeds
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.score import PLACES_OFF, RANKS, Score
from refseq_bench.scenarios.tables import NONE, counted, number, with_unknown

OUTCOMES = (Outcome.WRONG, Outcome.MISSED, Outcome.FALSE_FIX, Outcome.REJECTED)
FURTHER = (
    "method",
    f"{' / '.join(outcome.value for outcome in OUTCOMES)} [views]",
    "way to first right answer",
    "harm [views]",
    "retrieval AUC",
    "recall at 100 / 99 % precision",
    "recall@1 / 5 / 10",
    "within ±1 / 2 / 5 places",
    "calibration error (ECE)",
    "entropy: AUROC of failing",
)
LOST = (
    "method",
    "AUROC of P(lost)",
    "false alarms to catch 95 %",
    "calibration error of P(lost)",
    "way to saying lost",
    "way to recovering",
    "worst false fix",
)
WITHOUT_TRUTH = (
    "method",
    "says lost [views]",
    "jumps [steps]",
    "slope over the odometer",
    "residual",
    "entropy, mean",
    "agrees with the other methods",
)
COSTS = ("bytes a place", "features a place", "kept in all", "learning", "answering", "most memory")
"""Figures of a ``Cost``."""


@dataclass(frozen=True)
class FigureTables:
    """The tables of some methods; ``lost`` is None where no view was off the map."""

    success: PageTable
    further: PageTable
    lost: PageTable | None
    figures: PageTable
    unscored: int


def figure_tables(figures: Sequence[Figures], judged: str) -> FigureTables | None:
    """Put the figures of all methods into tables; None without any method."""
    if not figures:
        return None
    lost = tuple(_lost_row(one.method, one.wide) for one in figures if one.wide.off_map.any())
    return FigureTables(
        success=_success_table(figures, judged),
        further=PageTable(FURTHER, tuple(map(further_row, figures))),
        lost=PageTable(LOST, lost) if lost else None,
        figures=_record_table(figures),
        unscored=figures[0].wide.count(Outcome.UNSCORED),
    )


def _success_table(figures: Sequence[Figures], judged: str) -> PageTable:
    wide, narrow = (score.tolerance.label for score in (figures[0].wide, figures[0].narrow))
    several = len(figures[0].wide_runs) > 1
    headings = (
        "method",
        f"n [views], {wide} / {narrow}",
        f"success within {wide}",
        f"success within {narrow}",
        *((f"over seeds, {wide} / {narrow}",) if several else ()),
        "failures [views]",
        "median error",
        "95th percentile",
    )
    return PageTable(headings, tuple(_success_row(one, one.method == judged, several) for one in figures))


def _success_row(one: Figures, judged: bool, several: bool) -> PageRow:
    wide, narrow = one.wide, one.narrow
    cells = (
        f"{wide.success.trials} / {narrow.success.trials}",
        str(wide.success),
        str(narrow.success),
        *((" / ".join(_over_seeds(runs) for runs in (one.wide_runs, one.narrow_runs)),) if several else ()),
        str(wide.failures),
        *(with_unknown(metres(wide.error_quantile(share)), wide.unknown_errors) for share in (0.5, 0.95)),
    )
    return PageRow(method_label(one.method), cells, judged)


def _over_seeds(runs: Sequence[Score]) -> str:
    """The 95 % interval of success over seeds."""
    interval = success_over_seeds(runs)
    return NONE if interval is None else f"[{100 * interval[0]:.1f}, {100 * interval[1]:.1f}]"


def further_row(one: Figures) -> PageRow:
    """A method's row under ``FURTHER``."""
    pooled, curve, harm = one.wide, one.wide.retrieval, one.harm
    recalls = [pooled.recall(first) for first in RANKS]
    near = [pooled.within_places(places) for places in PLACES_OFF]
    cells = (
        " / ".join(str(pooled.count(outcome)) for outcome in OUTCOMES),
        distances(pooled.first_fixes),
        NONE if harm is None else f"{harm.successes} of {harm.trials}",
        NONE if curve is None else f"{curve.auc:.3f}",
        NONE if curve is None else f"{100 * curve.recall_at(1.0):.0f} / {100 * curve.recall_at(0.99):.0f} %",
        *(
            " / ".join(f"{100 * share.value:.0f}" for share in shares) + " %" if shares[0].trials else NONE
            for shares in (recalls, near)
        ),
        number(pooled.mass_reliability.error),
        number(pooled.entropy_auroc),
    )
    return PageRow(method_label(one.method), cells)


def _lost_row(method: str, pooled: Score) -> PageRow:
    cells = (
        number(pooled.auroc),
        NONE if pooled.false_alarms is None else f"{100 * pooled.false_alarms:.0f} %",
        number(pooled.lost_reliability.error),
        distances(pooled.recovery.to_lost),
        distances(pooled.recovery.to_recover),
        with_unknown(metres(pooled.worst_false_fix), pooled.unknown_false_fixes),
    )
    return PageRow(method_label(method), cells)


def consistency_page_table(figures: Sequence[Figures], judged: str) -> PageTable | None:
    """Figures without truth of all methods; None without any method."""
    rows = tuple(_consistency_row(one, one.method == judged) for one in figures)
    return PageTable(WITHOUT_TRUTH, rows) if rows else None


def _consistency_row(one: Figures, judged: bool) -> PageRow:
    found = one.consistency
    cells = (
        f"{found.lost.successes} of {found.lost.trials}",
        f"{found.jumps.successes} of {found.jumps.trials}" if found.jumps.trials else NONE,
        number(found.fit.slope),
        metres(found.fit.residual),
        NONE if math.isnan(found.entropy) else f"{found.entropy:.2f} nats",
        f"{100 * found.agreement.value:.0f} %" if found.agreement.trials else NONE,
    )
    return PageRow(method_label(one.method), cells, judged)


def cost_table(
    runs: Sequence[Comparison], methods: Sequence[str], costs: Mapping[str, Sequence[Cost]]
) -> PageTable | None:
    """Milliseconds a view for each of ``STEPS``, and the ``costs`` where they are known; None without any time."""
    taken = {method: [belief.timings for run in runs for belief in run.beliefs[method]] for method in methods}
    if not costs and not any(timing.total for timings in taken.values() for timing in timings):
        return None
    times = {method: step_times(timings).values() for method, timings in taken.items()}
    rows = (
        PageRow(method_label(m), (*(f"{t.median:.2f} / {t.p95:.2f}" for t in times[m]), *_costs(costs.get(m, ()))))
        for m in methods
    )
    return PageTable(("method", *(f"{step} [ms]" for step in STEPS), *(COSTS if costs else ())), tuple(rows))


def _costs(costs: Sequence[Cost]) -> tuple[str, ...]:
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


def _record_table(figures: Sequence[Figures]) -> PageTable:
    """All figures that a file of figures has, a row each, a column a method."""
    records = [figures_record(one) for one in figures]
    names = dict.fromkeys(name for record in records for name in record)
    rows = (PageRow(name, tuple(counted(record.get(name)) for record in records)) for name in names)
    return PageTable(("figure", *(method_label(one.method) for one in figures)), tuple(rows))
