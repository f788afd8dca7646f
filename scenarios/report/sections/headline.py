"""Headline of a section: what came of the judged method, in two sentences."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from refseq.fault import DeclaredFault, declared_in
from refseq_bench.scenarios.report.words import metres
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.scoring.consistency.consistency import Consistency
from refseq_bench.scenarios.scoring.figures import Figures
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import LengthUnit


@dataclass(frozen=True)
class Headline:
    """The verdict in words: of which ``method``, what to know of it, and what more there is."""

    method: str
    verdict: str
    more: str


def headline(one: Figures, unscored: str, estimates: Sequence[str] = ()) -> Headline:
    """Put a method's figures into words: right answers, or, where none can be judged, what is known without truth.

    ``estimates`` are the files that the truth was taken from, where it is not the log's own.
    """
    label = method_label(one.method)
    if unscored:
        return Headline(label, _answered(one.consistency), f"No score: {unscored}. {_consistent(one.consistency)}")
    told = f" The truth is an estimate: {', '.join(estimates)}." if estimates else ""
    return Headline(label, _right(one), _around(one) + told)


def told_faults(declared: Sequence[Sequence[DeclaredFault]]) -> str:
    """A sentence on the faults that stood at each view, in the order in which they were declared; none: nothing."""
    told = []
    for fault in declared_in(declared):
        stood = [view for view, faults in enumerate(declared) if fault in faults]
        until = f" until view {stood[-1]}" if stood[-1] < len(declared) - 1 else ""
        told.append(f"{fault} (told at view {stood[0]}){until}")
    if not told:
        return ""
    return f"Declared by the localiser: {'; '.join(told)}."


def _right(one: Figures) -> str:
    wide = one.wide
    on_map = wide.success.trials
    if not on_map:
        return f"None of {_views(wide.scored)} is on the map"
    share = f" ({100 * wide.success.value:.1f} %)"
    lost = wide.count(Outcome.MISSED)
    parts = [f"Right at {wide.success.successes} of {_views(on_map)}{share}"]
    parts += [f"wrong at {count}" for count in (wide.count(Outcome.WRONG),) if count]
    parts += [f"lost at {lost}"] if lost else []
    return ", ".join(parts)


def _around(one: Figures) -> str:
    """Tolerance, error, and what became of views off the map or without truth."""
    wide = one.wide
    near = wide.tolerance
    turned = f" and {math.degrees(near.heading):g}°" if near.unit is LengthUnit.METRES else ""
    parts = [f"Right is within {near.label}{turned} of the truth."]
    if not math.isnan(median := wide.error_quantile(0.5)):
        half = "Half of the answers" + (" whose error is known" if wide.unknown_errors else "")
        parts.append(f"{half} are at most {median:.2f} {near.unit} off along the path.")
    if unknown := wide.unknown_errors + wide.unknown_false_fixes:
        parts.append(f"Of {_answers(unknown)} the error is not known, for want of the place's true pose.")
    if off := int(wide.off_map.sum()):
        rejected, fixes = wide.count(Outcome.REJECTED), wide.count(Outcome.FALSE_FIX)
        parts.append(f"Of {_views(off)} off the map it says lost at {rejected} and answers {fixes}.")
    if without := wide.count(Outcome.UNSCORED):
        parts.append(f"{_views(without)} without a true pose {'are' if without > 1 else 'is'} not scored.")
    return " ".join(parts)


def _answered(found: Consistency) -> str:
    answers = found.lost.trials - found.lost.successes
    lost = f", lost at {found.lost.successes}" if found.lost.successes else ""
    return f"Answered {answers} of {_views(found.lost.trials)}{lost}"


def _consistent(found: Consistency) -> str:
    parts = []
    if found.jumps.trials:
        count = found.jumps.successes
        verb = "are" if count > 1 else "is"
        told = f"{count or 'none'} {verb} farther than odometry allows"
        parts.append(f"Of {found.jumps.trials} steps from answer to answer {told}.")
    if not math.isnan(found.fit.slope):
        parts.append(
            f"Answers move {found.fit.slope:.2f} m along the map for each metre of the odometer, "
            f"with {metres(found.fit.residual)} left over."
        )
    if found.agreement.trials:
        parts.append(f"Other methods mean the same place at {100 * found.agreement.value:.0f} % of the views.")
    return " ".join(parts) or "There is no odometry to compare with."


def _answers(count: int) -> str:
    return f"{count} answer{'s' if count != 1 else ''}"


def _views(count: int) -> str:
    return f"{count} view{'s' if count != 1 else ''}"
