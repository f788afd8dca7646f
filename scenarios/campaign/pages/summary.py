"""One figure of all methods over all cases of a campaign, side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, MethodRecord
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import NONE


@dataclass(frozen=True)
class Summary:
    """``figure`` in words by method, one cell a case."""

    figure: str
    cases: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]


SHARES: Mapping[str, Callable[[MethodRecord], str]] = MappingProxyType(
    {
        "success": lambda one: one.success.text,
        "success_narrow": lambda one: one.success_narrow.text,
        "failures": lambda one: one.success.failed,
        "failures_narrow": lambda one: one.success_narrow.failed,
    }
)
"""Columns for the share of right answers; all other figures go by their names in the result file."""


def summary(record: CampaignRecord, figure: str, wanted: Sequence[str] = ()) -> Summary:
    """A figure of all methods over the cases that were judged; ``wanted`` names cases or scenarios, none: all.

    Raises ``ScenarioError`` for a figure or a case that the campaign does not have.
    """
    cases = [case for case in _chosen(record, wanted) if case.methods]
    methods = list(dict.fromkeys(one.method for case in cases for one in case.methods))
    known = [*SHARES, *dict.fromkeys(name for case in cases for one in case.methods for name in one.figures)]
    if figure not in known:
        raise ScenarioError(f"--across {figure!r} is no figure of this campaign; valid are {', '.join(known)}")
    return Summary(
        figure=figure,
        cases=tuple(case.name for case in cases),
        rows=tuple((method, tuple(_cell(case.method(method), figure) for case in cases)) for method in methods),
    )


def _chosen(record: CampaignRecord, wanted: Sequence[str]) -> list[CaseRecord]:
    valid = dict.fromkeys(name for case in record.cases for name in (case.scenario, case.name))
    for name in wanted:
        if name not in valid:
            raise ScenarioError(f"--case {name!r} is not in this campaign; valid are {', '.join(valid)}")
    return [case for case in record.cases if not wanted or {case.scenario, case.name} & set(wanted)]


def _cell(found: MethodRecord | None, figure: str) -> str:
    if found is None:
        return NONE
    return SHARES[figure](found) if figure in SHARES else plain(found.figures.get(figure))


def plain(value: float | int | str | None) -> str:
    """A figure as it stands in a table."""
    return NONE if value is None else f"{value:.3f}" if isinstance(value, float) else str(value)
