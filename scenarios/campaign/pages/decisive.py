"""Power of a campaign to decide: cases that tell no methods apart, and the smallest difference that its seeds can show.

The judged method of each case is compared with every other one on the same views and seeds
(``refseq_bench.scenarios.scoring.intervals.paired``); over all cases Holm's correction is made of these comparisons.
"""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, MethodRecord
from refseq_bench.scenarios.report.words import span_words
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.scoring.intervals.paired import (
    LEVEL,
    PairedDifference,
    comparisons_shown,
    holm,
    least_p,
    paired_difference,
)
from refseq_bench.scenarios.tables import NONE, plural

PASSES, FAILS = 95.0, 5.0
"""A method passes a case from so many per cent of right answers on, and fails it up to so many: choices."""
FEW_VIEWS = 10
"""Of nine views, all of them right, the 95 % interval of their share still begins at 70 %: a choice."""
MOST_SEEDS = 7
"""From so many seeds on the number of resamples, no longer theirs, bounds what can be shown: more show nothing more."""


@dataclass(frozen=True)
class MethodComparison:
    """The judged method beside another one in a case, over so many ``seeds`` that both have.

    ``corrected`` is its p-value among all of the campaign's.
    """

    case: str
    method: str
    seeds: int
    found: PairedDifference
    corrected: float = 1.0


@dataclass(frozen=True)
class ComparisonRow:
    """A comparison in words; differences in percentage points."""

    method: str
    difference: str
    smallest: str
    p: str


@dataclass(frozen=True)
class PowerRow:
    """A case in words: seeds, smallest difference that they can show (percentage points), comparisons that show one.

    ``shown`` of ``compared`` have p ≤ 5 % by themselves, ``corrected`` after Holm's correction.
    """

    name: str
    page: str | None
    seeds: str
    smallest: str
    compared: int
    shown: int
    corrected: int


def undecided(case: CaseRecord) -> str:
    """The reason why a case tells nothing, or no methods apart; empty of one that does."""
    if case.schema_type == "localising" and 0 < case.views < FEW_VIEWS:
        asked = plural(case.views, "view")
        return f"decides nothing: it asked about {asked}; shares tell something of {FEW_VIEWS} or more"
    shares = [_right_percent(one) for one in case.methods]
    known = [share for share in shares if not math.isnan(share)]
    if len(known) < 2:
        return ""
    if min(known) >= PASSES:
        return f"decides nothing: all {len(known)} methods are right at {PASSES:g} % or more"
    if max(known) <= FAILS:
        return f"decides nothing: none of {len(known)} methods is right at more than {FAILS:g} %"
    return ""


def _right_percent(one: MethodRecord) -> float:
    """Right answers on the map and rejected views off it [%]; of missions those completed."""
    accuracy = one.figures.get("accuracy_percent")
    return float(accuracy) if isinstance(accuracy, int | float) else 100 * one.success.share


def compared(case: CaseRecord) -> list[MethodComparison]:
    """The judged method beside each other one, by the seeds that both answered; none of fewer than two seeds."""
    judged = case.method(case.judged)
    if judged is None:
        return []
    return [found for one in case.methods if one is not judged and (found := _pair(case.name, judged, one))]


def _pair(case: str, ours: MethodRecord, other: MethodRecord) -> MethodComparison | None:
    seeds = [seed for seed in ours.runs if seed in other.runs and ours.runs[seed].of and other.runs[seed].of]
    if len(seeds) < 2:
        return None
    mine, theirs = (tuple(one.runs[seed].right / one.runs[seed].of for seed in seeds) for one in (ours, other))
    found = paired_difference(mine, theirs, floor=1 / min(ours.runs[seed].of for seed in seeds))
    return MethodComparison(case, other.method, len(seeds), found)


def corrected(record: CampaignRecord) -> list[MethodComparison]:
    """All comparisons of a campaign, with Holm's correction over them."""
    found = [one for case in record.cases for one in compared(case)]
    raised = holm([one.found.p for one in found])
    return [replace(one, corrected=p) for one, p in zip(found, raised, strict=True)]


def comparison_rows(case: CaseRecord) -> list[ComparisonRow]:
    """The comparisons of a case in words."""
    return [
        ComparisonRow(method_label(one.method), points(one.found.difference, sign=True), points(one.found.smallest),
                      p_words(one.found.p, one.seeds))
        for one in compared(case)
    ]  # fmt: skip


def power_rows(cases: Iterable[CaseRecord], found: Iterable[MethodComparison]) -> list[PowerRow]:
    """The cases that compare methods, a row each, by the campaign's ``corrected`` comparisons."""
    by_case: dict[str, list[MethodComparison]] = {}
    for one in found:
        by_case.setdefault(one.case, []).append(one)
    return [_power_row(case, by_case[case.name]) for case in cases if case.name in by_case]


def _power_row(case: CaseRecord, found: Sequence[MethodComparison]) -> PowerRow:
    return PowerRow(
        name=case.name,
        page=case.page,
        seeds=seeds_words(found),
        smallest=points(smallest_shown(found)),
        compared=len(found),
        shown=sum(one.found.p <= LEVEL for one in found),
        corrected=sum(one.corrected <= LEVEL for one in found),
    )


def seeds_words(found: Sequence[MethodComparison]) -> str:
    """Number of seeds that comparisons are made over; the least and the most where methods broke at some."""
    return "" if not found else span_words(sorted({one.seeds for one in found}))


def smallest_shown(found: Sequence[MethodComparison]) -> float:
    """The smallest difference that a case's seeds can show, the median over the methods; infinite: none."""
    return statistics.median(one.found.smallest for one in found)


def smallest_words(case: CaseRecord) -> list[str]:
    """The smallest difference that a case's seeds can show, in words; nothing where nothing is compared."""
    found = compared(case)
    if not found:
        return []
    smallest = points(smallest_shown(found))
    return ["no difference can be shown" if smallest == NONE else f"differences from {smallest} points on can be shown"]


def power_line(found: Sequence[MethodComparison]) -> str:
    """Differences that a campaign's ``corrected`` comparisons show, told; empty where nothing is compared."""
    if not found:
        return ""
    count, seeds = len(found), max(one.seeds for one in found)
    after, before = sum(one.corrected <= LEVEL for one in found), sum(one.found.p <= LEVEL for one in found)
    line = (
        f"{after} of {count} comparisons with the judged method show a difference after Holm's correction, "
        f"{before} before it"
    )
    if comparisons_shown(seeds) >= count:
        return line
    enough = next((number for number in range(seeds + 1, MOST_SEEDS + 1) if comparisons_shown(number) >= count), None)
    return f"{line}; {seeds} seeds can show none of so many" + (f", {enough} could" if enough else "")


def points(share: float, *, sign: bool = False) -> str:
    """A difference of shares in percentage points; an infinite one is none."""
    return NONE if math.isinf(share) else f"{100 * share:{'+' if sign else ''}.1f}"


def p_words(p: float, seeds: int) -> str:
    """A p-value; the least that so many seeds can give is told as that."""
    return f"≤ {p:.2g}" if seeds > 1 and p <= least_p(seeds) * (1 + 1e-9) else f"{p:.2g}"
