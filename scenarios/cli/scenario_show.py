"""The commands ``refseq scenario list | show | template``: what there is and declares, how to begin."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import out, say
from scenarios.errors import ScenarioError
from scenarios.methods.templates import MY_LOCALISER

if TYPE_CHECKING:
    from scenarios.campaign.declare.cases import Case
    from scenarios.campaign.declare.schema import SourceTable
    from scenarios.campaign.store.cache import Store
    from scenarios.tables import TextTable

CLASS = "MyLocaliser"

Json = Annotated[bool, typer.Option("--json", help="As JSON, for other programs.")]


def list_scenarios(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(metavar="[SCENARIO]...", help="Only these: names, tags, or paths (.toml). [default: all]"),
    ] = None,
    as_json: Json = False,
) -> None:
    """List scenarios: what each is for, how many cases and seeds it has, the tags that it goes by.

    `refseq scenario list`

    `refseq scenario list thesis --json`
    """
    from scenarios.campaign.declare.cases import find, names

    cases = find(scenarios or names())
    of_file: dict[Path, list[Case]] = {}
    for case in cases:
        of_file.setdefault(case.file, []).append(case)
    if as_json:
        typer.echo(json.dumps([_listed(found) for found in of_file.values()], indent=2))
        return
    from scenarios.tables import print_whole

    print_whole(out, _list_table(list(of_file.values())))


def _listed(cases: "Sequence[Case]") -> dict[str, object]:
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


def _list_table(files: "Sequence[Sequence[Case]]") -> "TextTable":
    from scenarios.tables import TextTable

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


def _blocking(cases: "Sequence[Case]") -> str:
    blocking = {case.scenario.blocking for case in cases}
    return "some" if len(blocking) > 1 else "yes" if True in blocking else "no"


def show(
    name: Annotated[str, typer.Argument(metavar="SCENARIO", help="A name, a case, a tag, or a path (.toml).")],
    case: Annotated[
        str | None, typer.Option("--case", metavar="NAME", help="Only this case of it. [default: all]")
    ] = None,
    cache: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Where recordings and answers are kept. [default: the user's]")
    ] = None,
    as_json: Json = False,
) -> None:
    """Show what a scenario declares, all that it leaves open filled in, and what of it is in the cache already.

    `refseq scenario show kidnap`

    `refseq scenario show light-dial --case noon`
    """
    from scenarios.campaign.declare.cases import find
    from scenarios.campaign.run.estimate import rest_of
    from scenarios.campaign.store.cache import Store, default_store

    cases = _only(find([name]), case)
    store = Store(cache or default_store())
    if as_json:
        typer.echo(json.dumps([_resolved(one) for one in cases], indent=2))
        return
    for one in cases:
        for line in _lines(one, store):
            say(out, line)
    if len(cases) > 1:
        say(out, f"all {len(cases)} cases together, which share drives: {rest_of(cases, store).summary}")


def _only(cases: "list[Case]", name: str | None) -> "list[Case]":
    if name is None:
        return cases
    chosen = [case for case in cases if name in (case.name, case.name.partition("/")[2])]
    if not chosen:
        raise ScenarioError(f"case {name!r} is unknown; valid are {', '.join(case.name for case in cases)}")
    return chosen


def _resolved(case: "Case") -> dict[str, object]:
    return {
        "case": case.name,
        "varied": dict(case.varied),
        "judged": case.scenario.judged,
        "methods": list(case.scenario.methods),
        "scenario": case.scenario.model_dump(mode="json"),
    }


def _lines(case: "Case", store: "Store") -> list[str]:
    from scenarios.campaign.declare.schema_types import schema_type_for
    from scenarios.campaign.run.estimate import rest_of

    scenario, localise = case.scenario, case.scenario.localise
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
        *schema_type_for(scenario).summary_lines(scenario),
        *(f"  expected: {one.text}" for one in case.expectations),
        f"  {rest_of([case], store).summary}",
        "",
    ]


def _in_words(table: "SourceTable") -> str:
    """A source with all that is not as it is by default; the light is told always."""
    told = {"light", *table.model_dump(exclude_defaults=True)}
    return ", ".join(f"{key} {_value(value)}" for key, value in table.model_dump(mode="json").items() if key in told)


def _value(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} {_value(one)}" for key, one in value.items()) + "}"
    return "[" + ", ".join(map(_value, value)) + "]" if isinstance(value, list) else str(value)


def template(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Python file to write.")] = Path(
        "my_localiser.py"
    ),
) -> None:
    """Write a small localiser that works, to begin one of your own with.

    `refseq scenario template -o my_localiser.py`

    `refseq scenario run smoke --localiser my_localiser:MyLocaliser`
    """
    from refseq.files import replace_text
    from scenarios.drives.inputs import check_output, writing

    if not (output.suffix == ".py" and output.stem.isidentifier()):
        raise ScenarioError(f"{output}: is no module's name; valid is a name that can be imported, ending in .py")
    check_output(output)
    if output.exists():
        raise ScenarioError(f"{output}: is there already; valid is a new file")
    with writing(output):
        replace_text(output, MY_LOCALISER.read_text(encoding="utf-8"))
    say(
        out,
        f"{output} is written; run it from this folder: refseq scenario run smoke --localiser {output.stem}:{CLASS}",
    )
