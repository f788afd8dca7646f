"""Sweep plot: success over the one key that a scenario varies, light for example."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from refseq_bench.scenarios.campaign.store.result_file import CaseRecord
from refseq_bench.scenarios.report.plot_selection import MOST
from refseq_bench.scenarios.report.plots.style import Plot
from refseq_bench.scenarios.report.plots.sweep import Sweep, success_over
from refseq_bench.scenarios.scoring.comparison import method_label
from refseq_bench.scenarios.tables import NONE
from refseq_bench.worlds.light import light_named


@dataclass(frozen=True)
class SweepPlot:
    """Effect of one key on the cases of a scenario: the plot, and of all methods the success at each value."""

    scenario: str
    key: str
    values: tuple[str, ...]
    plot: Plot
    rows: tuple[tuple[str, tuple[str, ...]], ...]
    left_out: int


def sweep_plot_of(cases: Sequence[CaseRecord]) -> SweepPlot | None:
    """Success over the one key that the cases of a scenario vary; None where there is not one key, or not two cases.

    Cases are in the order of the axis, where it has one. The same methods are drawn as on the cases' pages where these
    agree: those that most of them draw.
    """
    keys = {tuple(case.varied) for case in cases}
    if len(cases) < 2 or len(keys) != 1 or len(next(iter(keys))) != 1:
        return None
    ((key,),) = keys
    at = _positions(key, [case.varied[key] for case in cases])
    if at is not None:
        order = np.argsort(at)
        cases, at = [cases[i] for i in order], [at[i] for i in order]
    methods = list(dict.fromkeys(one.method for case in cases for one in case.methods))
    shares = {method: np.array([_shares(case, method) for case in cases]) for method in methods}
    if not methods:
        return None
    shown = _most_plotted(cases, methods)
    words = tuple(case.varied_words[key] for case in cases)
    drawing = Sweep(key, words, at, {m: shares[m] for m in shown})
    return SweepPlot(
        scenario=cases[0].scenario,
        key=key,
        values=words,
        plot=success_over(drawing),
        rows=tuple((method_label(m), tuple(_cell(case, m) for case in cases)) for m in methods),
        left_out=len(methods) - len(shown),
    )


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


def _positions(key: str, values: Sequence[object]) -> list[float] | None:
    """Where values stand on an axis: numbers as they are, lights by their hours; None for others, or where two meet."""
    if key.rpartition(".")[2] == "light" and all(isinstance(value, str) for value in values):
        found = [light_named(str(value)).hour for value in values]
    elif all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        found = [float(str(value)) for value in values]
    else:
        return None
    return found if len(set(found)) == len(found) else None
