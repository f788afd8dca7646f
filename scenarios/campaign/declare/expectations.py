"""Expectations: what a scenario demands of its figures, written as people say it.

``success_hmm >= 80 % over 5 seeds``, ``lost_auroc of topometric >= 0.9``, ``to_lost <= 5 m``, ``failures of best/chain
<= 0.5 * failures of thesis/chain``. A figure's name is one of ``FIGURES``; after it may stand whose it is meant, else
it is that of the judged method. ``_uniform``, ``_prior`` and ``_hmm`` behind a name mean the stage of the scenario's
profile. Missions have figures of their own (``mission_figures``), and no stages. A share may be written in per cent,
and behind a number may stand the figure's unit; two figures that are compared have one unit. ``over N seeds`` says of
how many it has to be, at least.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from refseq.belief import Stage
from refseq_bench.scenarios.campaign.declare.figures import FIGURES, Figure, Unit
from refseq_bench.scenarios.errors import ScenarioError

Vocabulary = Mapping[str, Figure[Any]]
"""Figures by name: all that can be expected of a kind of scenario."""
SUFFIXES: Mapping[str, Stage] = MappingProxyType(
    {"_uniform": Stage.UNIFORM, "_prior": Stage.PRIOR, "_hmm": Stage.CHAIN}
)


@dataclass(frozen=True, slots=True)
class Term:
    """A figure of a method, None: of the judged one, times ``factor``."""

    figure: str
    method: str | None
    factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Expectation:
    """A written expectation and its meaning: ``left`` stands in a relation to a number or to another figure.

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

    @property
    def of_itself(self) -> bool:
        """True where a figure of a method is compared with itself, which decides nothing."""
        left, right = self.left, self.right
        return isinstance(right, Term) and (left.figure, left.method) == (right.figure, right.method)


_NAME = r"[a-z_0-9]+"
_METHOD = r"[^\s*<>≤≥]+"
_TERM = rf"({_NAME})(?:\s+of\s+({_METHOD}))?"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_FORM = re.compile(
    rf"\s*{_TERM}\s*(>=|<=|>|<|≥|≤)\s*"
    rf"(?:({_NUMBER})\s*(%|ms|m|s|views?)?(?:\s*(?:\*|(?<=%)\s*of\s)\s*{_TERM})?|{_TERM})"
    r"(?:\s+over\s+(\d{1,9})\s+seeds?)?\s*",
    re.ASCII,
)
_LEFT, _RIGHT = 1, (6, 8)
"""Groups of the form that hold the name of a figure."""
FORM = "FIGURE [of METHOD] >=|<=|>|< NUMBER [UNIT], [NUMBER *] FIGURE [of METHOD], and after it [over N seeds]"
_SIGNS = {"≥": ">=", "≤": "<="}


def parse(text: str, profile: str | None, known: Vocabulary = FIGURES) -> Expectation:
    """Read an expectation of ``known`` figures.

    ``profile`` is the one whose stages ``_hmm`` and its like mean; None: they mean nothing. Raises ``ScenarioError``.
    """
    found = _FORM.fullmatch(text)
    if not found:
        raise ScenarioError(f"{text!r} is no expectation; valid is {FORM}, as in 'success_hmm >= 80 % over 5 seeds'")
    figure, method, sign, number, unit, scaled, scaled_method, other, other_method, seeds = found.groups()
    if number is not None and math.isinf(float(number)):
        raise ScenarioError(f"{text!r}: {number} is not valid; it should be finite")
    reader = _ExpectationParser(text, profile, known)
    left = reader.term(figure, method)
    if scaled or other:
        factor = 1.0 if number is None else _factor(text, float(number), unit)
        right: Term | float = reader.bound_by(left, reader.term(scaled or other, scaled_method or other_method, factor))
    else:
        right = reader.bound(left.figure, float(number), unit)
    if seeds is not None and int(seeds) < 1:
        raise ScenarioError(f"{text!r}: over {seeds} seeds is not valid; it should be 1 or more")
    expectation = Expectation(text, left, _SIGNS.get(sign, sign), right, int(seeds or 1))
    check_decides(expectation)
    return expectation


def check_decides(expectation: Expectation, judged: str = "") -> None:
    """Raise ``ScenarioError`` for a figure that is compared with itself, also where it is so by who is ``judged``."""
    if (about(expectation, judged) if judged else expectation).of_itself:
        why = "" if expectation.of_itself else f", as {judged} is judged"
        raise ScenarioError(
            f"{expectation.text!r}: compares {expectation.left.figure} with itself{why}; valid are a number, another "
            "figure, or that of another method"
        )


@dataclass(frozen=True, slots=True)
class _ExpectationParser:
    """Reads the parts of one text."""

    text: str
    profile: str | None
    known: Vocabulary

    def bound(self, figure: str, number: float, unit: str | None) -> float:
        """A number as its figure has it; its unit, where one is written, must be the figure's."""
        wanted = self.known[figure].unit
        if unit is not None and not (unit == wanted or (wanted is Unit.VIEWS and unit == "view")):
            raise ScenarioError(f"{self.text!r}: {figure} is not told in {unit}; valid is {wanted.value}")
        if wanted in (Unit.VIEWS, Unit.METRES, Unit.MILLISECONDS) and number < 0:
            raise ScenarioError(f"{self.text!r}: {figure} is never below 0; valid is 0 or more")
        if wanted is not Unit.SHARE:
            return number
        share = number / 100 if unit else number
        if not 0 <= share <= 1:
            raise ScenarioError(f"{self.text!r}: {figure} is a share; valid is 0 to 1, or 0 % to 100 %")
        return share

    def bound_by(self, left: Term, right: Term) -> Term:
        """A figure that bounds another one; both must have one unit, for numbers alone compare whatever they count."""
        units = [self.known[one.figure].unit for one in (left, right)]
        if units[0] is not units[1]:
            raise ScenarioError(
                f"{self.text!r}: units of {left.figure} ({units[0]}) and {right.figure} ({units[1]}) differ; valid are "
                "two figures of one unit"
            )
        return right

    def term(self, figure: str, method: str | None, factor: float = 1.0) -> Term:
        """A figure by its name, with a suffix read as the stage that it means."""
        for suffix, stage in SUFFIXES.items() if self.profile else ():
            plain = figure.removesuffix(suffix)
            if figure not in self.known and plain != figure and plain in self.known:
                if method is not None:
                    raise ScenarioError(
                        f"{self.text!r}: {figure} is that of {self.profile}/{stage} already; valid is {plain} of "
                        f"{method}"
                    )
                figure, method = plain, f"{self.profile}/{stage}"
        if figure not in self.known:
            also = ", each also with _uniform, _prior, _hmm" if self.profile else ""
            raise ScenarioError(f"{self.text!r}: figure {figure!r} is unknown; valid are {', '.join(self.known)}{also}")
        return Term(figure, method, factor)


def _factor(text: str, number: float, unit: str | None) -> float:
    if unit not in (None, Unit.SHARE.value):
        raise ScenarioError(f"{text!r}: {number:g} {unit} times a figure is not valid; it should be a number or in %")
    return number / 100 if unit else number


def about(expectation: Expectation, method: str) -> Expectation:
    """The same expectation of a method, where it names none; its text says so and keeps all other words."""
    left = replace(expectation.left, method=expectation.left.method or method)
    right = expectation.right
    if isinstance(right, Term):
        right = replace(right, method=right.method or method)
    changed = replace(expectation, left=left, right=right)
    return changed if changed == expectation else replace(changed, text=_text_about(expectation, method))


def _text_about(expectation: Expectation, method: str) -> str:
    """The text with the method put behind each figure that is of none."""
    text, found = expectation.text, _FORM.fullmatch(expectation.text)
    assert found, "a text that was read is of the form"
    terms = ((expectation.right, *_RIGHT), (expectation.left, _LEFT))
    for term, *groups in terms:  # from behind, so that what is put in moves nothing that is still to come
        at = max(found.end(group) for group in groups)
        if isinstance(term, Term) and term.method is None:
            text = f"{text[:at]} of {method}{text[at:]}"
    return text
