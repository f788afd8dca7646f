"""Judge expectations by the figures of each method."""

import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from refseq_bench.scenarios.campaign.declare.expectations import Expectation, Term, Vocabulary, about
from refseq_bench.scenarios.campaign.declare.figures import FIGURES, Unit
from refseq_bench.scenarios.campaign.store.result_file import JudgementRecord

OPERATORS: Mapping[str, Callable[[float, float], bool]] = MappingProxyType(
    {">=": operator.ge, "<=": operator.le, ">": operator.gt, "<": operator.lt}
)


def _too_few(seeds: int, asked: int) -> str:
    if not seeds:
        return "no seed was run to its end"
    return f"{seeds} seed{'s' * (seeds > 1)} of the {asked} that it asks for {'were' if seeds > 1 else 'was'} run"


def judge(
    expectation: Expectation,
    found: Mapping[str, Any],
    judged: str,
    seeds: int,
    known: Vocabulary = FIGURES,
    unscored: str = "",
) -> JudgementRecord:
    """Decide by the figures of each method, of which ``known`` takes one; they are pooled over so many seeds.

    ``unscored`` says what has no true pose, where nothing could be scored for want of one.
    """
    text = expectation.text
    if seeds < expectation.seeds:
        return JudgementRecord(text=text, met=None, reason=_too_few(seeds, expectation.seeds))
    whole = about(expectation, judged)
    away = [name for name in whole.methods if name not in found]
    if away:
        missing = "has no answers" if seeds <= 1 else "does not answer for every seed"
        return JudgementRecord(text=text, met=None, reason=f"{away[0]} {missing}")
    if whole.of_itself:  # by who is judged now: a file that says so is refused
        return JudgementRecord(text=text, met=None, reason=f"compares {whole.left.figure} of {judged} with itself")
    right = whole.right
    terms = (whole.left, right) if isinstance(right, Term) else (whole.left,)
    if unscored and (scores := [term.figure for term in terms if known[term.figure].truth]):
        others = ", ".join(name for name, figure in known.items() if not figure.truth)
        reason = f"{scores[0]} needs true poses, and {unscored}; valid without are {others}"
        return JudgementRecord(text=text, met=None, reason=reason, broken=True)
    value = _value(whole.left, found, known)
    bound = _value(right, found, known) if isinstance(right, Term) else right
    if math.isnan(value) or math.isnan(bound):
        if faultless := [term for term in terms if known[term.figure].faultless(found[str(term.method)])]:
            reason = f"{faultless[0].method} has no {faultless[0].figure}, as none of its answers is wrong"
            return JudgementRecord(text=text, met=None, reason=reason)
        # What else cannot be told was not reached: no view off the map, say, and so no P(lost) to judge.
        nothing = "there is no such figure: nothing to take it from"
        return JudgementRecord(text=text, met=False, value=value, bound=bound, reason=nothing)
    met = OPERATORS[expectation.relation](value, bound)
    unit = known[whole.left.figure].unit
    return JudgementRecord(text=text, met=met, value=value, bound=bound, unit="" if unit is Unit.NONE else unit.value)


def _value(term: Term, found: Mapping[str, Any], known: Vocabulary) -> float:
    return term.factor * known[term.figure].take(found[str(term.method)])
