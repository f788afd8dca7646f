"""Tables of figures on the terminal, a row a method."""

import math
from collections.abc import Sequence

import numpy as np

from refseq_bench.scenarios.scoring.atlas import JoinScore, SequenceShares
from refseq_bench.scenarios.scoring.consistency.consistency import Consistency
from refseq_bench.scenarios.scoring.figures import Figures
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.recovery import DistanceOrNever, median_way
from refseq_bench.scenarios.scoring.score import RANKS, Score
from refseq_bench.scenarios.tables import NONE, TextTable, counted, number, with_unknown


def figures_table(title: str, found: Sequence[Figures]) -> TextTable:
    """All figures on the terminal, a row a method, of one method at least."""
    parts = (found[0].wide, found[0].narrow)
    table = TextTable(
        "method",
        *(f">within {part.tolerance.label}\nof {part.success.trials}, %" for part in parts),
        ">failed",
        ">AUC",
        ">recall, %\n@1/5/10",
        ">recall, % at\nprec. 100/99",
        ">ECE",
        ">lost\nAUROC",
        ">FPR@\n95TPR",
        f">error [{parts[0].tolerance.unit}]\nmed./p95",
        ">ms a\nview",
        title=title,
    )
    for one in found:
        table.add_row(one.method, *_cells(one))
    return table


def _cells(one: Figures) -> list[str]:
    wide, curve = one.wide, one.wide.retrieval
    recalls = [wide.recall(first) for first in RANKS]
    return [
        _percent(wide.success),
        _percent(one.narrow.success),
        counted(wide.failures if wide.scored else None),
        number(curve.auc if curve else None),
        "/".join(f"{100 * recall.value:.0f}" for recall in recalls) if recalls[0].trials else NONE,
        "/".join(f"{100 * curve.recall_at(precision):.0f}" for precision in (1.0, 0.99)) if curve else NONE,
        number(wide.mass_reliability.error),
        number(wide.auroc),
        number(wide.false_alarms),
        _errors(wide),
        f"{one.cost:.2f}",
    ]


def _errors(wide: Score) -> str:
    """Median and 95th percentile of the error along the path."""
    if not wide.scored:
        return NONE
    return with_unknown("/".join(_metres(wide.error_quantile(share)) for share in (0.5, 0.95)), wide.unknown_errors)


def lost_table(title: str, found: Sequence[Figures]) -> TextTable | None:
    """Figures of the methods off the map and on coming back to it; ``None`` where nothing of the kind happened."""
    if not any(one.wide.off_map.any() or any(one.wide.recovery) for one in found):
        return None
    table = TextTable(
        "method",
        ">false fixes\nof off-map",
        ">worst\n[m]",
        ">ECE of\nP(lost)",
        ">way to lost [m]\nmedian (never)",
        ">way to recover [m]\nmedian (never)",
        ">way to first fix [m]\nmedian (never)",
        title=title,
    )
    for one in found:
        wide, off_map = one.wide, int(one.wide.off_map.sum())
        table.add_row(
            one.method,
            f"{wide.count(Outcome.FALSE_FIX)} of {off_map}",
            with_unknown(_metres(wide.worst_false_fix), wide.unknown_false_fixes),
            number(wide.lost_reliability.error),
            *(ways_text(ways) for ways in (*wide.recovery, wide.first_fixes)),
        )
    return table


def ways_text(ways: Sequence[DistanceOrNever]) -> str:
    """Median [m], and how many never got there; never where at least half did not."""
    never = f" ({count} of {len(ways)})" if (count := ways.count(None)) else ""
    median = median_way(ways)
    return ("never" if math.isinf(median) else _metres(median)) + never


def join_cells(joined: JoinScore | None) -> list[str]:
    """Cells of what was merged: joins, precision, recall, places, duplicates, bytes."""
    if joined is None:
        return [NONE] * 6
    return [
        f"{joined.joins} ({counted(joined.false_joins)})",
        _percent(joined.precision),
        _percent(joined.recall),
        f"{joined.places} of {joined.views}",
        counted(joined.duplicates),
        f"{joined.bytes_after / 1000:.0f} of {joined.bytes_before / 1000:.0f}",
    ]


def shares_cell(shares: SequenceShares) -> str:
    """Mean P(s) of the path driven before, on and behind what paths share."""
    return " / ".join(number(float(np.mean(part)) if part else None) for part in shares)


def consistency_table(kind: str, found: Sequence[tuple[str, Consistency]]) -> TextTable:
    """Figures that need no truth, a row a stage or a method; ``kind`` says which they are."""
    table = TextTable(
        kind,
        ">says lost",
        ">jumps",
        ">slope over\nodometer",
        ">residual\n[m]",
        ">entropy\n[nats]",
        ">agrees with\nothers, %",
        title="without truth",
    )
    for name, one in found:
        table.add_row(name, *consistency_cells(one))
    return table


def consistency_cells(one: Consistency) -> tuple[str, ...]:
    """Cells of what needs no truth: lost, jumps, slope and residual over the odometer, entropy, agreement."""
    return (
        f"{one.lost.successes} of {one.lost.trials}",
        f"{one.jumps.successes} of {one.jumps.trials}" if one.jumps.trials else NONE,
        _metres(one.fit.slope),
        _metres(one.fit.residual),
        _metres(one.entropy),
        f"{100 * one.agreement.value:.0f}" if one.agreement.trials else NONE,
    )


def _percent(share: Proportion) -> str:
    if not share.trials:
        return NONE
    low, high = share.interval
    return f"{100 * share.value:.1f} [{100 * low:.0f}, {100 * high:.0f}]"


def _metres(value: float) -> str:
    return NONE if math.isnan(value) else f"{value:.2f}"
