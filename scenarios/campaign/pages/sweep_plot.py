"""Sweep plot: success over the one key that a scenario varies, light for example."""

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, cases_by_scenario
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.plot_selection import MOST
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.report.plots.sweep import Sweep, success_over
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.tables import NONE
from refseq_bench.worlds.light import light_named

DIAL = re.compile(r"(\w+)=(\d+(?:\.\d+)?)")
"""A number that a text gives to one of its keys, as ``building:SEED,texture=0.3`` and ``people=1,walkers=1`` do."""


@dataclass(frozen=True)
class SweepPlot:
    """Effect of one key on the cases of a scenario: the plot, and of all methods the success at each value."""

    scenario: str
    key: str
    values: tuple[str, ...]
    plot: Plot
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    left_out: int


@dataclass(frozen=True)
class SweptCases:
    """Cases of a scenario that vary one key, in the order of its axis, where it has one; see ``Sweep``."""

    cases: tuple[CaseRecord, ...]
    key: str
    values: tuple[str, ...]
    at: tuple[float, ...] | None

    def of(self, methods: Sequence[str]) -> Sweep:
        """Success of some methods over the key."""
        shares = {method: np.array([_shares(case, method) for case in self.cases]) for method in methods}
        return Sweep(self.cases[0].title, self.key, self.values, self.at, shares)

    @property
    def methods(self) -> list[str]:
        """All methods that answered a case."""
        return list(dict.fromkeys(one.method for case in self.cases for one in case.methods))


def swept(cases: Sequence[CaseRecord]) -> SweptCases | None:
    """Some cases of a scenario by the one key that they vary; None where there is not one key, or not two cases."""
    keys = {tuple(case.varied) for case in cases}
    if len(cases) < 2 or len(keys) != 1 or len(next(iter(keys))) != 1:
        return None
    ((key,),) = keys
    found = SweptCases(tuple(cases), key, tuple(case.varied_words[key] for case in cases), None)
    found = _at_numbers(found) or found
    return found if found.at is None else _rising(found, found.at)


def _at_numbers(found: SweptCases) -> SweptCases | None:
    """Values where they stand on an axis; None where they stand on none, or where two meet.

    Numbers stand where they belong, lights at their hours, and texts at the one number in which they differ.
    """
    values, at = [case.varied[found.key] for case in found.cases], None
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        at = [float(str(value)) for value in values]
    elif all(isinstance(value, str) for value in values):
        if found.key.rpartition(".")[2] == "light":
            at = [light_named(str(value)).hour for value in values]
        elif dials := _dials([str(value) for value in values]):
            found = replace(found, key=dials[0], values=dials[1])
            at = [float(number) for number in found.values]
    return replace(found, at=tuple(at)) if at is not None and len(set(at)) == len(at) else None


def _dials(texts: Sequence[str]) -> tuple[str, tuple[str, ...]] | None:
    """Keys by whose numbers alone some texts differ, and the number of each text, the same for all of these keys."""
    if len({DIAL.sub(r"\1=", text) for text in texts}) > 1:
        return None
    dials = [
        (found[0][0], tuple(number for _, number in found)) for found in zip(*map(DIAL.findall, texts), strict=True)
    ]
    turned = {name: numbers for name, numbers in dials if len(set(numbers)) > 1}
    if len(set(turned.values())) != 1:
        return None
    return ", ".join(turned), next(iter(turned.values()))


def _rising(found: SweptCases, at: Sequence[float]) -> SweptCases:
    order = np.argsort(at)
    cases, values, numbers = (tuple(column[i] for i in order) for column in (found.cases, found.values, at))
    return SweptCases(cases, found.key, values, numbers)


def sweep_plot_of(cases: Sequence[CaseRecord]) -> SweepPlot | None:
    """Success over the one key that the cases of a scenario vary; None where there is not one, or not two cases.

    The same methods are drawn as on the cases' pages where these agree: those that most of them draw.
    """
    found = swept(cases)
    if found is None or not found.methods:
        return None
    shown = _most_plotted(found.cases, found.methods)
    return SweepPlot(
        scenario=cases[0].scenario,
        key=found.key,
        values=found.values,
        plot=success_over(found.of(shown)),
        rows=tuple((method_label(m), tuple(_cell(case, m) for case in found.cases)) for m in found.methods),
        left_out=len(found.methods) - len(shown),
    )


def sweeps_of(campaigns: Sequence[CampaignRecord], methods: Collection[str]) -> list[Sweep]:
    """The sweep of each scenario that varies one key; of a case judged twice the later counts.

    ``methods`` are those to show, all where there are none. Raises ``ScenarioError`` where nothing is left to show.
    """
    every = map(swept, cases_by_scenario(campaigns).values())
    found = [one for one in every if one is not None and one.methods]
    if not found:
        raise ScenarioError(
            "no scenario varies one key over two cases that were answered; valid is a campaign of one that does, as "
            "refseq scenario run dials makes it"
        )
    answered = list(dict.fromkeys(method for one in found for method in one.methods))
    if unknown := [method for method in methods if method not in answered]:
        raise ScenarioError(f"method {unknown[0]!r} has no answers there; valid are {', '.join(answered)}")
    return [one.of([method for method in one.methods if method in (methods or answered)]) for one in found]


def _most_plotted(cases: Sequence[CaseRecord], methods: Sequence[str]) -> list[str]:
    counts = {m: sum(one.plotted for case in cases for one in case.methods if one.method == m) for m in methods}
    chosen = sorted(methods, key=lambda method: (-counts[method], methods.index(method)))[:MOST]
    return [method for method in methods if method in chosen]


def _shares(case: CaseRecord, method: str) -> tuple[float, float, float]:
    found = case.method(method)
    if found is None or not found.success.of:
        return math.nan, math.nan, math.nan
    return found.success.share, found.success.low, found.success.high


def _cell(case: CaseRecord, method: str) -> str:
    found = case.method(method)
    return NONE if found is None else found.success.text
