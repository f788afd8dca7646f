"""Scenarios in lists, and all that one declares, as text and for other programs."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.schema import SourceTable
from refseq_bench.scenarios.campaign.declare.schema_types import schema_type_for
from refseq_bench.scenarios.tables import TextTable


def by_file(cases: Iterable[Case]) -> list[list[Case]]:
    """The cases of each file together."""
    files: dict[Path, list[Case]] = {}
    for case in cases:
        files.setdefault(case.file, []).append(case)
    return list(files.values())


def listed(cases: Sequence[Case]) -> dict[str, object]:
    """A file's cases, for other programs."""
    scenario = cases[0].scenario
    return {
        "name": cases[0].file.stem,
        "title": scenario.title,
        "source": scenario.source,
        "note": scenario.note,
        "tags": list(scenario.tags),
        "seeds": list(scenario.seeds),
        "cases": [{"name": case.name, "blocking": case.scenario.blocking} for case in cases],
        "file": str(cases[0].file),
    }


def list_table(files: Sequence[Sequence[Case]]) -> TextTable:
    """Files, a row each."""
    table = TextTable("scenario", "what", ">cases x seeds", "tags", "blocking", "source")
    for cases in files:
        scenario = cases[0].scenario
        each = sorted({len(case.scenario.seeds) for case in cases})
        seeds = "-".join(str(count) for count in dict.fromkeys((each[0], each[-1])))
        table.add_row(
            cases[0].file.stem,
            scenario.title,
            f"{len(cases)} x {seeds}",
            ", ".join(scenario.tags),
            _blocking(cases),
            scenario.source,
        )
    return table


def _blocking(cases: Sequence[Case]) -> str:
    blocking = {case.scenario.blocking for case in cases}
    return "some" if len(blocking) > 1 else "yes" if True in blocking else "no"


def resolved(case: Case) -> dict[str, object]:
    """A case with all that its file leaves open, for other programs."""
    return {
        "case": case.name,
        "varied": dict(case.varied),
        "judged": case.scenario.judged,
        "methods": list(case.scenario.methods),
        "scenario": case.scenario.model_dump(mode="json"),
    }


def lines(case: Case, kept: str) -> list[str]:
    """A case in words; ``kept`` says what of it is stored already."""
    scenario, localise = case.scenario, case.scenario.localise
    learn = localise.learn.model_dump(mode="json", exclude_defaults=True)
    varied = ", ".join(f"{key} = {value}" for key, value in case.varied.items())
    return [
        f"{case.name}: {scenario.title}" + ("" if scenario.blocking else " (not blocking)"),
        *(f"  {key}: {value}" for key, value in (("source", scenario.source), ("note", scenario.note)) if value),
        *([f"  varied: {varied}"] if varied else []),
        *(f"  reference: {_in_words(reference)}" for reference in scenario.references),
        f"  query: {_in_words(scenario.query)}",
        f"  seeds: {', '.join(map(str, scenario.seeds))}",
        f"  methods: {', '.join(scenario.methods)}; judged: {scenario.judged}",
        f"  looked at: {', '.join(localise.sensors or ('all sensors',))}; places learnt: {scenario.places or 'all'}",
        *([f"  maps: {_stated(learn)}"] if learn else []),
        *schema_type_for(scenario).summary_lines(scenario),
        f"  limits: {scenario.limits.steps} steps of a drive, {scenario.limits.seconds:g} s of any task",
        *(f"  expected: {one.text}" for one in case.expectations),
        f"  {kept}",
        "",
    ]


def _in_words(table: SourceTable) -> str:
    """A source with all that is not as it is by default, and what a reader asks for first."""
    told = {"light", "route", "robot", *table.model_dump(exclude_defaults=True)}
    return _stated({key: value for key, value in table.model_dump(mode="json").items() if key in told})


def _stated(values: Mapping[str, object]) -> str:
    return ", ".join(f"{key} {_value(value)}" for key, value in values.items())


def _value(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} {_value(one)}" for key, one in value.items()) + "}"
    return "[" + ", ".join(map(_value, value)) + "]" if isinstance(value, list) else str(value)
