"""Validity of the bench: the order of methods on simulated twins beside their order on the real sets.

Cases ``SCENARIO/real/SET`` and ``SCENARIO/twin/SET`` are a pair. Methods count that answered both cases of all pairs.
"""

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from refseq_bench.scenarios.campaign.pages.text_report import markdown_table
from refseq_bench.scenarios.campaign.store.result_file import (
    CampaignRecord,
    CaseRecord,
    MethodRecord,
    RunRecord,
    cases_by_scenario,
)
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.intervals.rank_agreement import (
    RankAgreement,
    RankCorrelation,
    Scores,
    changed_pairs,
    mean_scores,
    rank_agreement,
)
from refseq_bench.scenarios.tables import NONE

if TYPE_CHECKING:
    from refseq_bench.scenarios.report.plots.order import OrderPanel

REAL, TWIN = "real", "twin"
FIGURES = ("success", "auc")
"""Figures that order methods: success within the wider tolerance, and the area under precision and recall."""
TOLD = 8
"""Pairs of methods that change places of which a page tells."""
BLOCK = re.compile(r"(?<=<!-- validity -->\n).*?(?=<!-- end validity -->)", re.DOTALL)


@dataclass(frozen=True)
class SetPair:
    """A real set and its twin: scores of the methods, a column a seed."""

    name: str
    real: Scores
    twin: Scores


@dataclass(frozen=True)
class Validity:
    """Pairs of a scenario, and the methods that are ordered; ``left_out`` are lines that say what is missing."""

    scenario: str
    title: str
    methods: tuple[str, ...]
    pairs: tuple[SetPair, ...]
    left_out: tuple[str, ...]

    @property
    def means(self) -> tuple[Scores, Scores]:
        """Mean scores over the real sets and over the twins, (M,) each."""
        return mean_scores([pair.real for pair in self.pairs]), mean_scores([pair.twin for pair in self.pairs])


def validities(campaigns: Sequence[CampaignRecord], figure: str) -> list[Validity]:
    """The validity of each scenario that has pairs, by one of ``FIGURES``; of a case judged twice the later counts.

    Raises ``ScenarioError`` where no scenario has a pair with answers.
    """
    if figure not in FIGURES:
        raise ScenarioError(f"figure {figure!r} is unknown; valid are {', '.join(FIGURES)}")
    found = [_validity(cases, figure) for cases in cases_by_scenario(campaigns).values()]
    if not any(one.pairs for one in found):
        raise ScenarioError(
            "no real set and its twin were both answered; valid is a campaign with cases real/NAME and twin/NAME, as "
            "refseq scenario run validity makes it"
        )
    return [one for one in found if one.pairs]


def _validity(cases: Sequence[CaseRecord], figure: str) -> Validity:
    sides: dict[str, dict[str, CaseRecord]] = {REAL: {}, TWIN: {}}
    for case in cases:
        side, _, name = case.name.partition("/")[2].partition("/")
        if side in sides and name:
            sides[side][name] = case
    names = dict.fromkeys((*sides[REAL], *sides[TWIN]))
    missing = {name: why for name in names if (why := _missing(name, sides))}
    paired = [(name, sides[REAL][name], sides[TWIN][name]) for name in names if name not in missing]
    scores = [[_by_method(case, figure) for case in (real, twin)] for _, real, twin in paired]
    every = list(itertools.chain.from_iterable(scores))
    methods = tuple(name for name in (every[0] if every else ()) if all(name in one for one in every))
    pairs = (
        SetPair(name, *(np.array([one[method] for method in methods]) for one in of_set))
        for (name, *_), of_set in zip(paired, scores, strict=True)
    )
    dropped = sorted({name for one in every for name in one} - set(methods))
    lines = [*missing.values(), *(f"{name}: has no {figure} in all cases" for name in dropped)]
    return Validity(cases[0].scenario, cases[0].title, methods, tuple(pairs) if methods else (), tuple(lines))


def _missing(name: str, sides: Mapping[str, Mapping[str, CaseRecord]]) -> str:
    """The reason why a set is left out, in a line; empty where it is whole."""
    for side, of_side in sides.items():
        case = of_side.get(name)
        if case is None:
            return f"{name}: has no case {side}/{name}"
        if not any(method.success.of for method in case.methods):
            return f"{name}: {case.name} has no answers: {case.reasons[0] if case.reasons else case.verdict_word}"
    return ""


def _by_method(case: CaseRecord, figure: str) -> dict[str, list[float]]:
    """Scores by seed of each method that has one at all seeds."""
    found = {one.method: [_score(run, figure) for run in _runs(one)] for one in case.methods}
    return {method: scores for method, scores in found.items() if scores and not any(map(math.isnan, scores))}


def _runs(one: MethodRecord) -> list[RunRecord]:
    return [one.runs[seed] for seed in sorted(one.runs)]


def _score(run: RunRecord, figure: str) -> float:
    if figure == "auc":
        return math.nan if run.auc is None else run.auc
    return run.right / run.of if run.of else math.nan


# --- what is told ---


def panels(one: Validity) -> "list[OrderPanel]":
    """Points of a scatter plot of each set, and of the mean over sets."""
    from refseq_bench.scenarios.report.plots.order import OrderPanel  # matplotlib, which no text asks for

    each = [OrderPanel(pair.name, mean_scores([pair.twin]), mean_scores([pair.real])) for pair in one.pairs]
    real, twin = one.means
    return [*each, OrderPanel("mean over sets", twin, real)] if len(each) > 1 else each


def report_of(campaigns: Sequence[CampaignRecord]) -> str:
    """All that a page tells of some campaigns, in Markdown. Raises ``ScenarioError`` as ``validities`` does."""
    areas = {one.scenario: one for one in validities(campaigns, "auc")}
    told = []
    for one in validities(campaigns, "success"):
        told.append(f"\n### {one.title}\n\n{report(one)}")
        if (area := areas.get(one.scenario)) and area.pairs:
            told.append(f"\nBy the area under precision and recall instead of success:\n\n{agreement_table(area)}")
    return "".join(told)


def report(one: Validity) -> str:
    """All that a page tells of a scenario, in Markdown."""
    parts = [agreement_table(one), *([yardstick_table(one)] if len(one.pairs) > 1 else []), score_table(one)]
    changed = list(changed_lines(one))
    parts += ["Pairs of methods that change places, by the means over sets:\n\n" + "".join(changed)] if changed else []
    parts += ["".join(f"* left out: {line}\n" for line in one.left_out)] if one.left_out else []
    return "\n".join(parts)


def agreement_table(one: Validity) -> str:
    """Rank correlation of each set with its twin, and of the means."""
    groups = [(pair.name, [pair.real], [pair.twin]) for pair in one.pairs]
    if len(groups) > 1:
        groups.append(("mean over sets", [pair.real for pair in one.pairs], [pair.twin for pair in one.pairs]))
    rows = [(name, *_cells(rank_agreement(real, twin))) for name, real, twin in groups]
    heads = (f"real and twin, {len(one.methods)} methods", "Spearman's ρ", "Kendall's τ", "pairs in the same order")
    return markdown_table(heads, rows)


def _cells(found: RankAgreement) -> tuple[str, str, str]:
    return _correlation(found.spearman), _correlation(found.kendall), f"{found.alike} of {found.pairs}"


def _correlation(found: RankCorrelation) -> str:
    if math.isnan(found.value):
        return NONE
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


def yardstick_table(one: Validity) -> str:
    """Rank correlation of each real set with its own twin, with the other real sets, and with their twins."""
    rows = []
    for pair in one.pairs:
        others = [other for other in one.pairs if other is not pair]
        groups = ([pair.twin], [other.real for other in others], [other.twin for other in others])
        rows.append((pair.name, *(_mean_of_pairs(pair.real, group) for group in groups)))
    return markdown_table(("ρ, τ of a real set", "with its twin", "with another real set", "with another's twin"), rows)


def _mean_of_pairs(real: Scores, others: Sequence[Scores]) -> str:
    found = [rank_agreement([real], [other]) for other in others]
    spearman = [one.spearman.value for one in found if not math.isnan(one.spearman.value)]
    kendall = [one.kendall.value for one in found if not math.isnan(one.kendall.value)]
    return f"{np.mean(spearman):.2f}, {np.mean(kendall):.2f}" if spearman else NONE


def score_table(one: Validity) -> str:
    """Scores [%] of all methods on each set, real and twin, those best on real sets first."""
    real, twin = one.means
    rows = []
    for row in np.argsort(-real, kind="stable"):
        cells = [f"{_percent(pair.real[row])}, {_percent(pair.twin[row])}" for pair in one.pairs]
        rows.append((f"`{one.methods[row]}`", f"{100 * real[row]:.0f}, {100 * twin[row]:.0f}", *cells))
    return markdown_table(("real, twin [%]", "mean", *(pair.name for pair in one.pairs)), rows)


def _percent(runs: Scores) -> str:
    return f"{100 * float(runs.mean()):.0f}"


def changed_lines(one: Validity) -> Iterator[str]:
    """A line for each of the clearest pairs that the bench orders otherwise than reality does."""
    for pair in changed_pairs(*one.means)[:TOLD]:
        yield (
            f"* `{one.methods[pair.better]}` is {100 * pair.lead:.0f} points better than `{one.methods[pair.worse]}` "
            f"on real sets, {100 * pair.lag:.0f} worse on the twins\n"
        )


def page_with(text: str, body: str, page: str) -> str:
    """The page with another text between its two comments; what it tells there of other scenarios stays.

    Raises ``ScenarioError`` for one without them.
    """
    if len(blocks := BLOCK.findall(text)) != 1:
        raise ScenarioError(f"{page}: has no place for it; valid is <!-- validity -->, <!-- end validity --> once")
    both = _by_title(blocks[0]) | _by_title(body)
    return BLOCK.sub(lambda _: "".join(both.values()), text)


def _by_title(body: str) -> dict[str, str]:
    """Parts of a text by the lines of their titles, one a scenario; what stands before the first has none."""
    parts = re.split(r"^(?=### )", body, flags=re.MULTILINE)
    return {part.partition("\n")[0] if part.startswith("### ") else "": part for part in parts}
