"""Expectations: what a scenario demands of its figures, written as people say it.

``success_hmm >= 80 % over 5 seeds``, ``lost_auroc of topometric >= 0.9``, ``to_lost <= 5 m``, ``failures of best/chain
<= 0.5 * failures of thesis/chain``. A figure's name is one of ``FIGURES``; after it may stand whose it is meant, else
it is that of the judged method. ``_uniform``, ``_prior`` and ``_hmm`` behind a name mean the stage of the scenario's
profile. A share may be written in per cent, and behind a number may stand the figure's unit. ``over N seeds`` says of
how many it has to be, at least.
"""

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from refseq.belief import Stage
from scenarios.episodes import Way
from scenarios.errors import ScenarioError
from scenarios.figures import Figures
from scenarios.outcome import Outcome
from scenarios.score import Retrieval

OPERATORS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
)
SUFFIXES: Mapping[str, Stage] = MappingProxyType(
    {"_uniform": Stage.UNIFORM, "_prior": Stage.PRIOR, "_hmm": Stage.CHAIN}
)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _median(ways: Sequence[Way]) -> float:
    """Median way [m]; one that never got there is longer than all others, nan without any."""
    return float(np.median([math.inf if way is None else way for way in ways])) if ways else math.nan


class Unit(StrEnum):
    """What a figure is told in, as it may be written behind a number."""

    SHARE = "%"
    METRES = "m"
    VIEWS = "views"
    MILLISECONDS = "ms"
    NONE = "no unit"


@dataclass(frozen=True, slots=True)
class Figure:
    """What can be expected: how it is taken from a method's figures (nan where there is none), its unit, its meaning.

    A share is a number from 0 to 1.
    """

    take: Callable[[Figures], float]
    unit: Unit
    meaning: str


def _retrieved(found: Figures, take: Callable[[Retrieval], float]) -> float:
    return take(found.wide.retrieval) if found.wide.retrieval else math.nan


def _harm(found: Figures) -> float:
    return math.nan if found.harm is None else float(found.harm.successes)


def _share(take: Callable[[Figures], float], meaning: str) -> Figure:
    return Figure(take, Unit.SHARE, meaning)


def _views(take: Callable[[Figures], int], meaning: str) -> Figure:
    return Figure(lambda found: float(take(found)), Unit.VIEWS, meaning)


def _metres(take: Callable[[Figures], float], meaning: str) -> Figure:
    return Figure(take, Unit.METRES, meaning)


def _plain(take: Callable[[Figures], float | None], meaning: str) -> Figure:
    return Figure(lambda found: _or_nan(take(found)), Unit.NONE, meaning)


FIGURES: Mapping[str, Figure] = MappingProxyType(
    {
        "success": _share(lambda f: f.wide.success.value, "right within score.within, of the views on the map"),
        "success_narrow": _share(lambda f: f.narrow.success.value, "right within score.narrow, of those on the map"),
        "within_1_place": _share(lambda f: f.wide.within_places(1).value, "at most one place from the right one"),
        "within_2_places": _share(lambda f: f.wide.within_places(2).value, "at most two places from the right one"),
        "within_5_places": _share(lambda f: f.wide.within_places(5).value, "at most five places from the right one"),
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
        "ece": _plain(lambda f: f.wide.top_reliability.error, "calibration error of the top place's probability"),
        "entropy_auroc": _plain(lambda f: f.wide.entropy_auroc, "chance that a wrong belief has more entropy"),
        "error_median": _metres(lambda f: f.wide.error_quantile(0.5), "error along the path, median"),
        "error_p95": _metres(lambda f: f.wide.error_quantile(0.95), "error along the path, 95th percentile"),
        "worst_false_fix": _metres(lambda f: f.wide.worst_false_fix, "farthest that an answer off the map lay"),
        "to_lost": _metres(lambda f: _median(f.wide.episodes.to_lost), "way to say lost, median"),
        "to_recover": _metres(lambda f: _median(f.wide.episodes.to_recover), "way to be right again, median"),
        "to_first_fix": _metres(lambda f: _median(f.wide.first_fixes), "way to the first right answer, median"),
        "milliseconds": Figure(lambda f: f.cost, Unit.MILLISECONDS, "time a view without features, median"),
    }
)
"""What can be expected."""


@dataclass(frozen=True, slots=True)
class Term:
    """A figure of a method, None: of the judged one, times ``factor``."""

    figure: str
    method: str | None
    factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Expectation:
    """What is written, and what it means: ``left`` stands in a relation to a number or to another figure.

    ``seeds`` is the least number of seeds that it is to be judged over.
    """

    text: str
    left: Term
    relation: str
    right: Term | float
    seeds: int = 1

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods that it names."""
        terms = [self.left, *([self.right] if isinstance(self.right, Term) else [])]
        return tuple(term.method for term in terms if term.method is not None)


@dataclass(frozen=True, slots=True)
class Judgement:
    """An expectation, the figures that decided, and whether it was met; None: it could not be judged, for a reason."""

    text: str
    met: bool | None
    value: float = math.nan
    bound: float = math.nan
    reason: str = ""


_NAME = r"[a-z_0-9]+"
_METHOD = r"[^\s*<>≤≥=]+"
_TERM = rf"({_NAME})(?:\s+of\s+({_METHOD}))?"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_FORM = re.compile(
    rf"\s*{_TERM}\s*(>=|<=|>|<|≥|≤)\s*"
    rf"(?:({_NUMBER})\s*(%|ms|m|views?)?(?:\s*(?:\*|(?<=%)\s*of\s)\s*{_TERM})?|{_TERM})"
    r"(?:\s+over\s+(\d+)\s+seeds?)?\s*",
    re.ASCII,
)
FORM = "FIGURE [of METHOD] >=|<=|>|< NUMBER [UNIT], [NUMBER *] FIGURE [of METHOD], and after it [over N seeds]"
_SIGNS = {"≥": ">=", "≤": "<="}


def parse(text: str, profile: str) -> Expectation:
    """Read an expectation; ``profile`` is the one whose stages ``_hmm`` and its like mean. Raises ``ScenarioError``."""
    found = _FORM.fullmatch(text)
    if not found:
        raise ScenarioError(f"{text!r} is no expectation; valid is {FORM}, as in 'success_hmm >= 80 % over 5 seeds'")
    figure, method, sign, number, unit, scaled, scaled_method, other, other_method, seeds = found.groups()
    left = _term(text, figure, method, profile)
    if scaled or other:
        factor = 1.0 if number is None else _factor(text, float(number), unit)
        right: Term | float = _term(text, scaled or other, scaled_method or other_method, profile, factor)
    else:
        right = _bound(text, left.figure, float(number), unit)
    if seeds is not None and int(seeds) < 1:
        raise ScenarioError(f"{text!r}: over {seeds} seeds is not valid; it should be 1 or more")
    return Expectation(text, left, _SIGNS.get(sign, sign), right, int(seeds or 1))


def _bound(text: str, figure: str, number: float, unit: str | None) -> float:
    """A number as its figure has it; its unit, where one is written, must be the figure's."""
    wanted = FIGURES[figure].unit
    if unit is not None and not (unit == wanted or (wanted is Unit.VIEWS and unit == "view")):
        raise ScenarioError(f"{text!r}: {figure} is not told in {unit}; valid is {wanted.value}")
    if wanted is not Unit.SHARE:
        return number
    share = number / 100 if unit else number
    if not 0 <= share <= 1:
        raise ScenarioError(f"{text!r}: {figure} is a share; valid is 0 to 1, or 0 % to 100 %")
    return share


def _factor(text: str, number: float, unit: str | None) -> float:
    if unit not in (None, Unit.SHARE.value):
        raise ScenarioError(f"{text!r}: {number:g} {unit} times a figure is not valid; it should be a number or in %")
    return number / 100 if unit else number


def _term(text: str, figure: str, method: str | None, profile: str, factor: float = 1.0) -> Term:
    """A figure by its name, with a suffix read as the stage that it means."""
    for suffix, stage in SUFFIXES.items():
        plain = figure.removesuffix(suffix)
        if figure not in FIGURES and plain != figure and plain in FIGURES:
            if method is not None:
                raise ScenarioError(
                    f"{text!r}: {figure} is that of {profile}/{stage} already; valid is {plain} of {method}"
                )
            figure, method = plain, f"{profile}/{stage}"
    if figure not in FIGURES:
        valid = ", ".join(FIGURES)
        raise ScenarioError(
            f"{text!r}: figure {figure!r} is unknown; valid are {valid}, each also with _uniform, _prior, _hmm"
        )
    return Term(figure, method, factor)


def told(expectation: Expectation) -> str:
    """An expectation written out: ``parse`` makes the same of it."""
    right = expectation.right
    bound = f"{right.factor!r} * {_told_term(right)}" if isinstance(right, Term) else repr(right)
    return f"{_told_term(expectation.left)} {expectation.relation} {bound} over {expectation.seeds} seeds"


def _told_term(term: Term) -> str:
    return term.figure if term.method is None else f"{term.figure} of {term.method}"


def about(expectation: Expectation, method: str) -> Expectation:
    """The same expectation of a method, where it names none; its text says so."""
    left = replace(expectation.left, method=expectation.left.method or method)
    right = expectation.right
    if isinstance(right, Term):
        right = replace(right, method=right.method or method)
    changed = replace(expectation, left=left, right=right)
    return changed if changed == expectation else replace(changed, text=told(changed))


def judge(expectation: Expectation, found: Mapping[str, Figures], judged: str, seeds: int) -> Judgement:
    """Decide by the figures of each method, which are pooled over so many seeds."""
    if seeds < expectation.seeds:
        return Judgement(expectation.text, None, reason=f"{seeds} of {expectation.seeds} seeds were run")
    whole = about(expectation, judged)
    away = [name for name in whole.methods if name not in found]
    if away:
        return Judgement(expectation.text, None, reason=f"{away[0]} has no answers")
    value = _value(whole.left, found)
    right = whole.right
    bound = _value(right, found) if isinstance(right, Term) else right
    if math.isnan(value) or math.isnan(bound):
        # What cannot be told was not reached: no view off the map, say, and so no P(lost) to judge.
        return Judgement(expectation.text, False, value, bound, "there is no such figure: nothing to take it from")
    return Judgement(expectation.text, OPERATORS[expectation.relation](value, bound), value, bound)


def _value(term: Term, found: Mapping[str, Figures]) -> float:
    return term.factor * FIGURES[term.figure].take(found[str(term.method)])
