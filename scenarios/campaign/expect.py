"""Expectations: what a scenario demands of its figures, written as people say it.

``success_hmm >= 0.80 over 5 seeds``, ``lost_auroc of topometric >= 0.9``, ``failures of best/chain <= 0.5 *
failures of thesis/chain``. A figure's name is one of ``FIGURES``; after it may stand whose it is meant, else it is
that of the judged method. ``_uniform``, ``_prior`` and ``_hmm`` behind a name mean the stage of the scenario's profile.
A share may be written in per cent. ``over N seeds`` says of how many it has to be, at least.
"""

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from refseq.belief import Stage
from scenarios.episodes import Way
from scenarios.errors import ScenarioError
from scenarios.figures import Figures
from scenarios.outcome import Outcome

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


FIGURES: Mapping[str, Callable[[Figures], float]] = MappingProxyType(
    {
        "success": lambda found: found.wide.success.value,
        "success_narrow": lambda found: found.narrow.success.value,
        "failures": lambda found: float(found.wide.failures),
        "failures_narrow": lambda found: float(found.narrow.failures),
        "recall_1": lambda found: found.wide.recall(1).value,
        "recall_5": lambda found: found.wide.recall(5).value,
        "recall_10": lambda found: found.wide.recall(10).value,
        "auc": lambda found: found.wide.retrieval.auc if found.wide.retrieval else math.nan,
        "recall_at_100": lambda found: found.wide.retrieval.recall_at(1.0) if found.wide.retrieval else math.nan,
        "recall_at_99": lambda found: found.wide.retrieval.recall_at(0.99) if found.wide.retrieval else math.nan,
        "lost_auroc": lambda found: _or_nan(found.wide.auroc),
        "lost_fpr": lambda found: _or_nan(found.wide.false_alarms),
        "lost_ece": lambda found: found.wide.lost_reliability.error,
        "ece": lambda found: found.wide.top_reliability.error,
        "error_median": lambda found: found.wide.error_quantile(0.5),
        "error_p95": lambda found: found.wide.error_quantile(0.95),
        "missed": lambda found: float(found.wide.count(Outcome.MISSED)),
        "wrong": lambda found: float(found.wide.count(Outcome.WRONG)),
        "false_fixes": lambda found: float(found.wide.count(Outcome.FALSE_FIX)),
        "worst_false_fix": lambda found: found.wide.worst_false_fix,
        "to_lost": lambda found: _median(found.wide.episodes.to_lost),
        "to_recover": lambda found: _median(found.wide.episodes.to_recover),
        "to_first_fix": lambda found: _median(found.wide.first_fixes),
        "milliseconds": lambda found: found.cost,
    }
)
"""What can be expected of: shares from 0 to 1, numbers of views, ways and errors [m], the median time a view [ms]."""


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
_METHOD = r"[^\s*]+"
_TERM = rf"({_NAME})(?:\s+of\s+({_METHOD}))?"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_FORM = re.compile(
    rf"\s*{_TERM}\s*(>=|<=|>|<)\s*(?:({_NUMBER})\s*(%)?(?:\s*\*\s*{_TERM})?|{_TERM})(?:\s+over\s+(\d+)\s+seeds?)?\s*"
)
FORM = "FIGURE [of METHOD] >=|<=|>|< NUMBER[%], [NUMBER *] FIGURE [of METHOD], and after it [over N seeds]"


def parse(text: str, profile: str) -> Expectation:
    """Read an expectation; ``profile`` is the one whose stages ``_hmm`` and its like mean. Raises ``ScenarioError``."""
    found = _FORM.fullmatch(text)
    if not found:
        raise ScenarioError(f"{text!r} is no expectation; valid is {FORM}")
    figure, method, relation, number, percent, scaled, scaled_method, other, other_method, seeds = found.groups()
    left = _term(text, figure, method, profile)
    value = 1.0 if number is None else float(number) / (100 if percent else 1)
    if scaled or other:
        right: Term | float = _term(text, scaled or other, scaled_method or other_method, profile, value)
    else:
        right = value
    return Expectation(text, left, relation, right, int(seeds or 1))


def _term(text: str, figure: str, method: str | None, profile: str, factor: float = 1.0) -> Term:
    """A figure by its name, with a suffix read as the stage that it means."""
    for suffix, stage in SUFFIXES.items():
        if method is None and figure not in FIGURES and figure.endswith(suffix):
            figure, method = figure.removesuffix(suffix), f"{profile}/{stage}"
    if figure not in FIGURES:
        raise ScenarioError(f"{text!r}: figure {figure!r} is unknown; valid are {', '.join(FIGURES)}")
    return Term(figure, method, factor)


def judge(expectation: Expectation, found: Mapping[str, Figures], judged: str, seeds: int) -> Judgement:
    """Decide by the figures of each method, which are pooled over so many seeds."""
    if seeds < expectation.seeds:
        return Judgement(expectation.text, None, reason=f"{seeds} of {expectation.seeds} seeds were run")
    away = [name for name in (*expectation.methods, judged) if name not in found]
    if away:
        return Judgement(expectation.text, None, reason=f"{away[0]} has no answers")
    value = _value(expectation.left, found, judged)
    right = expectation.right
    bound = _value(right, found, judged) if isinstance(right, Term) else right
    if math.isnan(value) or math.isnan(bound):
        # What cannot be told was not reached: no view off the map, say, and so no P(lost) to judge.
        return Judgement(expectation.text, False, value, bound, "there is no such figure: nothing to take it from")
    return Judgement(expectation.text, OPERATORS[expectation.relation](value, bound), value, bound)


def _value(term: Term, found: Mapping[str, Figures], judged: str) -> float:
    return term.factor * FIGURES[term.figure](found[term.method or judged])
