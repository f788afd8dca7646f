"""The pages of a campaign: one for each case, and the index that leads to them."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios import plots
from scenarios.campaign.frames import FromStore
from scenarios.campaign.judging import Judged, tolerances
from scenarios.campaign.junit import told
from scenarios.campaign.outcomes import Verdict
from scenarios.campaign.result_file import CampaignRecord, CaseRecord, JudgementRecord, ShareRecord
from scenarios.campaign.store import Store
from scenarios.comparison import method_label
from scenarios.drawn import MOST
from scenarios.figures import NONE
from scenarios.outline import outline_of
from scenarios.page import duration_text, rendered
from scenarios.plots import Dial, FloorOutline, Plot
from scenarios.record import Drive, plan_of
from scenarios.report import details, facts
from scenarios.section import Section, Terms, section
from worlds.errors import WorldsError
from worlds.light import light_named

OPEN = "open"
"""Stands for the verdict of a case that was not judged."""


# --- a case ---


@dataclass(frozen=True)
class ExpectationRow:
    """An expectation in words: its verdict, what is written, what decided."""

    verdict: str
    text: str
    told: str


def case_page(result: Judged, record: CaseRecord, campaign: CampaignRecord, store: Store) -> str:
    """The page of a case that was judged; ``campaign`` tells of the versions and the machine."""
    return rendered(
        "case.html.j2",
        title=f"{record.name}: {verdict_word(record)}",
        case=record,
        verdict=verdict_word(record),
        scenario=result.case.scenario,
        expectations=[_expectation(one) for one in record.judgements],
        traces=[(one.reason, one.details) for one in record.mishaps if one.details],
        it=_section(result, store),
        facts=facts(result.comparisons),
        details=details(result.comparisons),
        varied=[(key, _words(value)) for key, value in record.varied.items()],
        resolved=json.dumps(record.resolved, indent=2, ensure_ascii=False),
        seconds=duration_text(record.seconds),
        campaign=campaign,
    )


def verdict_word(record: CaseRecord) -> str:
    """A case's verdict as it is written."""
    return OPEN if record.verdict is None else record.verdict.value


def _expectation(one: JudgementRecord) -> ExpectationRow:
    verdict = {True: Verdict.PASSED, False: Verdict.FAILED, None: Verdict.SKIPPED}[one.met]
    return ExpectationRow(verdict.value, one.text, ("not judged: " if one.met is None else "") + told(one))


def _section(result: Judged, store: Store) -> Section | None:
    """What was driven and answered; None where no drive was answered."""
    if not result.comparisons:
        return None
    terms = Terms(
        *tolerances(result.case),
        judged=result.case.scenario.judged,
        costs=result.costs,
        pictures=FromStore([tasks[0] for tasks in result.answered.values()], store),
        outline=_outline(result),
        figures=result.figures,
    )
    return section(result.case.name, result.comparisons, terms)


def _outline(result: Judged) -> FloorOutline | None:
    """The walls, where the query was driven in a floor plan; doors and things as on its day."""
    _, query = result.case.sources(next(iter(result.answered)))
    if not isinstance(query, Drive):
        return None
    try:
        return outline_of(plan_of(query))
    except WorldsError:
        return None  # a plan that was taken away after the drive


# --- the index ---


@dataclass(frozen=True)
class IndexRow:
    """A case in words."""

    name: str
    page: str | None
    verdict: str
    judged: str
    success: str
    success_narrow: str
    failures: str
    met: str
    reason: str
    seconds: str


@dataclass(frozen=True)
class DialShown:
    """What one key does to the cases of a scenario: the plot, and of all methods the success at each value."""

    scenario: str
    key: str
    values: tuple[str, ...]
    plot: Plot
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    left_out: int


def index_page(record: CampaignRecord, dials: Sequence[DialShown]) -> str:
    """The page of a campaign."""
    blocking = [case for case in record.cases if case.blocking]
    others = [case for case in record.cases if not case.blocking]
    return rendered(
        "campaign.html.j2",
        title=f"Campaign: {verdict_line(record)}",
        groups=[
            (heading, [index_row(case) for case in cases])
            for heading, cases in (("Cases that decide", blocking), ("Not blocking", others))
            if cases
        ],
        campaign=record,
        seconds=duration_text(record.seconds),
        dials=dials,
    )


def verdict_line(record: CampaignRecord) -> str:
    """The verdicts of the cases that decide, counted; then those that do not."""
    parts = []
    for blocking, after in ((True, ""), (False, " (not blocking)")):
        counts = [(record.count(verdict, blocking=blocking), verdict.value) for verdict in Verdict]
        left = sum(case.verdict is None and case.blocking is blocking for case in record.cases)
        words = ", ".join(f"{count} {word}" for count, word in [*counts, (left, "not judged")] if count)
        parts += [words + after] if words else []
    return "; ".join(parts) or "no case"


def index_row(case: CaseRecord) -> IndexRow:
    """A case's row in the table of verdicts."""
    judged = case.method(case.judged)
    met, expected = case.met
    return IndexRow(
        name=case.name,
        page=case.page,
        verdict=verdict_word(case),
        judged=method_label(case.judged),
        success=share_words(judged.success, judged.within_m) if judged else NONE,
        success_narrow=share_words(judged.success_narrow, judged.narrow_m) if judged else NONE,
        failures=f"{judged.success.of - judged.success.right} of {judged.success.of}" if judged else NONE,
        met=f"{met} of {expected}" if expected else NONE,
        reason=case.reasons[0] + (f" (and {len(case.reasons) - 1} more)" if len(case.reasons) > 1 else "")
        if case.reasons
        else "",
        seconds=duration_text(case.seconds),
    )


def share_words(share: ShareRecord, within: float) -> str:
    """A success rate with its interval and its tolerance."""
    if not share.of:
        return NONE
    return f"{100 * share.share:.1f} % [{100 * share.low:.0f}, {100 * share.high:.0f}] in {within:g} m"


def dial_of(cases: Sequence[CaseRecord]) -> DialShown | None:
    """Success over the one key that the cases of a scenario vary; None where there is not one key, or not two cases.

    The same methods are drawn as on the cases' pages where these agree: those that most of them draw.
    """
    keys = {tuple(case.varied) for case in cases}
    if len(cases) < 2 or len(keys) != 1 or len(next(iter(keys))) != 1:
        return None
    ((key,),) = keys
    values = [case.varied[key] for case in cases]
    methods = list(dict.fromkeys(one.method for case in cases for one in case.methods))
    shares = {method: np.array([_shares(case, method) for case in cases]) for method in methods}
    if not methods:
        return None
    shown = _most_drawn(cases, methods)
    drawing = Dial(key, [_words(value) for value in values], _positions(key, values), {m: shares[m] for m in shown})
    return DialShown(
        scenario=cases[0].scenario,
        key=key,
        values=tuple(_words(value) for value in values),
        plot=plots.dial(drawing),
        rows=tuple((method_label(m), tuple(_cell(case, m) for case in cases)) for m in methods),
        left_out=len(methods) - len(shown),
    )


def _most_drawn(cases: Sequence[CaseRecord], methods: Sequence[str]) -> list[str]:
    counts = {m: sum(one.drawn for case in cases for one in case.methods if one.method == m) for m in methods}
    chosen = sorted(methods, key=lambda method: (-counts[method], methods.index(method)))[:MOST]
    return [method for method in methods if method in chosen]


def _shares(case: CaseRecord, method: str) -> tuple[float, float, float]:
    found = case.method(method)
    if found is None or not found.success.of:
        return math.nan, math.nan, math.nan
    return found.success.share, found.success.low, found.success.high


def _cell(case: CaseRecord, method: str) -> str:
    found = case.method(method)
    if found is None or not found.success.of:
        return NONE
    share = found.success
    return f"{100 * share.share:.1f} [{100 * share.low:.0f}, {100 * share.high:.0f}]"


def _positions(key: str, values: Sequence[object]) -> list[float] | None:
    """Where values stand on an axis: numbers as they are, lights by their hours; None for others, or where two meet."""
    if key.rpartition(".")[2] == "light" and all(isinstance(value, str) for value in values):
        found = [light_named(str(value)).hour for value in values]
    elif all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        found = [float(str(value)) for value in values]
    else:
        return None
    return found if len(set(found)) == len(found) else None


def _words(value: object) -> str:
    return " + ".join(map(_words, value)) if isinstance(value, list | tuple) else str(value)
