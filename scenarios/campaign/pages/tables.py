"""Tables of a Markdown page that campaigns fill, so that no figure on the page is typed.

A table stands between two comments. The first says in TOML what is in it, the second ends it; what lies between is
replaced::

    <!-- table evening
    show = "{failures} ({failures_narrow})"
    [columns]
    "single views".method = "thesis/uniform"
    "chain".method = "thesis/chain"
    [rows]
    "by day".case = "fig-3.11-daylight"
    "late evening".case = "fig-3.12-evening/thesis"
    -->
    <!-- end table -->

Each cell needs a ``case``, a ``method`` and what to ``show`` of it; each of the three is named once: for the whole
table, by the row or by the column.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import fmean
from string import Formatter

from pydantic import BaseModel, ConfigDict, ValidationError

from refseq_bench.scenarios.campaign.pages.text_report import markdown_table
from refseq_bench.scenarios.campaign.pages.track_score import ALL, declared_seeds, scored_together
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, CaseRecord, MethodRecord, by_scenario
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.words import span_words
from refseq_bench.scenarios.tables import NONE
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.text_file import TextFileError, parse_toml

END = "<!-- end table -->"
OPENS = re.compile(r"^<!-- table\b.*$", re.MULTILINE)
BLOCK = re.compile(
    rf"(?P<head><!-- table (?P<name>\S+)\n(?P<toml>.*?)^-->\n)(?P<body>.*?)^{re.escape(END)}$", re.MULTILINE | re.DOTALL
)


class CellSpec(BaseModel):
    """Keys of a cell that a row, a column or the whole table gives."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    case: str | None = None
    method: str | None = None
    show: str | None = None


class TableSpec(CellSpec):
    """A table as it is declared: ``rows`` and ``columns`` by their headings, ``corner`` above the rows' headings."""

    corner: str = ""
    columns: Mapping[str, CellSpec]
    rows: Mapping[str, CellSpec]


@dataclass(frozen=True)
class Block:
    """A table on a page: its name, what stands between its comments, and where that is in the page's text."""

    name: str
    spec: TableSpec
    body: str
    span: tuple[int, int]
    place: str


@dataclass(frozen=True)
class CellSource:
    """Where a cell's figures are from: a method's in a case of a campaign."""

    campaign: CampaignRecord
    case: CaseRecord
    method: MethodRecord

    @property
    def seeds(self) -> int:
        """Number of seeds that the figures are over: a method may have broken at some of the case's."""
        return len(self.method.runs or self.case.seeds)


@dataclass(frozen=True)
class CampaignRuns:
    """Several campaigns; where two asked a method in the same case, the later one counts."""

    campaigns: Sequence[CampaignRecord]

    @cached_property
    def found(self) -> Mapping[tuple[str, str], CellSource]:
        """All there is, by the names of case and method; all cases of a scenario together are SCENARIO/*."""
        return {
            (case.name, method.method): CellSource(campaign, case, method)
            for campaign in self.campaigns
            for case in (*campaign.cases, *_together(campaign))
            for method in case.methods
        }

    @cached_property
    def cases(self) -> Sequence[str]:
        """All cases that some method answered, in their order."""
        return list(dict.fromkeys(case for case, _ in self.found))

    @cached_property
    def methods(self) -> Sequence[str]:
        """All methods that answered some case, in their order."""
        return list(dict.fromkeys(method for _, method in self.found))

    @cached_property
    def unfinished(self) -> frozenset[str]:
        """Cases that some campaign has still to judge, and SCENARIO/* of theirs: it runs, or was interrupted."""
        return frozenset(
            name
            for campaign in self.campaigns
            for case in campaign.cases
            if case.verdict is None
            for name in (case.name, f"{case.scenario}/{ALL}")
        )


def _together(campaign: CampaignRecord) -> Iterator[CaseRecord]:
    """The cases of each scenario of several as one."""
    for cases in by_scenario(campaign.cases).values():
        if len(cases) > 1 and all(case.methods for case in cases):
            yield scored_together(cases)


def blocks(text: str, page: str) -> list[Block]:
    """The tables that a page declares, in their order.

    Raises ``ScenarioError`` with the line for one that is not ended, has no name or one that is taken, or is declared
    wrongly.
    """
    by_start = {match.start(): match for match in BLOCK.finditer(text)}
    found: list[Block] = []
    for opening in OPENS.finditer(text):
        line = text.count("\n", 0, opening.start()) + 1
        match = by_start.get(opening.start())
        if match is None or OPENS.search(match["toml"] + match["body"]):
            raise ScenarioError(
                f"{page}: line {line}: {opening.group()!r} opens no whole table; valid is <!-- table NAME, lines of "
                f"TOML, -->, the table, {END}"
            )
        place = f"{page}: line {line}: table {match['name']}"
        if match["name"] in {block.name for block in found}:
            raise ScenarioError(f"{place}: the name is taken by an earlier table; valid is another one")
        found.append(
            Block(match["name"], _form("\n" * line + match["toml"], place), match["body"], match.span("body"), place)
        )
    return found


def _form(toml: str, place: str) -> TableSpec:
    """The table that TOML declares; errors count its lines as the page's."""
    try:
        return TableSpec.model_validate(parse_toml(toml))
    except TextFileError as error:
        raise ScenarioError(f"{place}: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise ScenarioError(
            f"{place}: {key}: {first['msg']}; valid are case, method, show, corner, and tables of rows and columns"
        ) from error


def selected_blocks(found: Sequence[Block], wanted: Sequence[str], page: str) -> list[Block]:
    """The tables that are asked for by name, none: all. Raises ``ScenarioError`` for one that is not on the page."""
    names = [block.name for block in found]
    for name in wanted:
        if name not in names:
            raise ScenarioError(f"--table {name!r} is not in {page}; valid are {', '.join(names) or 'none'}")
    if not found:
        raise ScenarioError(f"{page}: declares no table; valid is a page with <!-- table NAME ... --> and {END}")
    return [block for block in found if not wanted or block.name in wanted]


def replaced(text: str, bodies: Sequence[tuple[Block, str]]) -> str:
    """The page with other texts between the comments of some of its tables."""
    for block, body in sorted(bodies, key=lambda pair: -pair[0].span[0]):
        start, end = block.span
        text = text[:start] + body + text[end:]
    return text


def filled(block: Block, runs: CampaignRuns) -> str:
    """Text to stand between a table's comments: the table, and a line that says of which runs it is.

    Raises ``ScenarioError`` for a case, a method or a figure that the runs do not have, and for a cell that lacks one
    of them or is told one twice.
    """
    spec = block.spec
    sources: list[CellSource] = []
    rows = []
    for heading, row in spec.rows.items():
        cells = [heading]
        for title, column in spec.columns.items():
            place = f"{block.place}: row {heading!r}, column {title!r}"
            case, method, show = (_one(name, (spec, row, column), place) for name in ("case", "method", "show"))
            source = _source(case, method, runs, place)
            cells.append(_shown(show, source, place) if source else "")
            sources += [source] if source else []
        rows.append(cells)
    table = markdown_table((spec.corner, *spec.columns), rows)
    return f"{table}\n*{_origin(sources)}*\n" if sources else table


def _one(name: str, named_by: Sequence[CellSpec], place: str) -> str:
    told = [value for choice in named_by if (value := getattr(choice, name)) is not None]
    if len(told) != 1:
        how = f"is told {' and '.join(map(repr, told))}" if told else "is not told"
        raise ScenarioError(f"{place}: {name} {how}; valid is one of the table, the row and the column that tells it")
    return str(told[0])


def _source(case: str, method: str, runs: CampaignRuns, place: str) -> CellSource | None:
    """Where a cell's figures are; None where this case, unlike others, did not ask the method."""
    for what, name, valid in (("case", case, runs.cases), ("method", method, runs.methods)):
        if name not in valid:
            raise ScenarioError(
                f"{place}: {what} {name!r} was not judged in these campaigns; valid are {', '.join(valid) or 'none'}"
            )
    if case in runs.unfinished:
        raise ScenarioError(
            f"{place}: a campaign has still to judge case {case!r}; valid are campaigns that have ended"
        )
    source = runs.found.get((case, method))
    if source and case == f"{source.case.scenario}/{ALL}":
        _check_same_seeds(source, place)
    resolved = source.case.resolved if source else {}
    if both := sorted({*resolved.get("seeds", ())} & {*resolved.get("training_seeds", ())}):
        raise ScenarioError(f"{place}: {case!r} was run on its training seeds {both}; valid are the seeds of the test")
    return source


def _check_same_seeds(together: CellSource, place: str) -> None:
    """Raise ``ScenarioError`` where a mean over all cases would be one of drives that some never had."""
    scenario = together.case.scenario
    seeds = dict.fromkeys(declared_seeds(case) for case in together.campaign.cases if case.scenario == scenario)
    if len(seeds) > 1:
        first, other, *_ = map(list, seeds)
        raise ScenarioError(
            f"{place}: cases of {scenario} have other seeds, {first} and {other}; valid is {scenario}/{ALL} of cases "
            "with the same ones"
        )


def _shown(show: str, source: CellSource, place: str) -> str:
    """A cell's text."""
    values = _values(source.method, source.seeds)
    try:
        _check_known(show, values)
        return show.format_map({name: _Absent() if value is None else value for name, value in values.items()})
    except (KeyError, AttributeError) as error:
        raise ScenarioError(f"{place}: {show!r} shows {error}; valid are {', '.join(values)}") from error
    except (ValueError, IndexError, TypeError) as error:
        raise ScenarioError(
            f"{place}: {show!r} cannot be shown: {error}; valid is as in '{{success:.1f}} %'"
        ) from error


def _check_known(show: str, known: Collection[str]) -> None:
    """Raise ``KeyError`` for a name that is not known, as is an attribute or an entry of one that is."""
    for _, name, *_ in Formatter().parse(show):
        if name and name not in known:
            raise KeyError(name)


class _Absent:
    """A figure that there is none of, however it should be written."""

    def __format__(self, _form: str) -> str:
        return NONE


def _values(one: MethodRecord, seeds: int) -> Mapping[str, float | int | str | None]:
    """All that can be shown of a method: counts of views (of missions: of runs), of features, and the figures."""
    counts: dict[str, float | int | str | None] = {"seeds": seeds, "of": one.success.of}
    for share, name in ((one.success, ""), (one.success_narrow, "_narrow")):
        failures = share.of - share.right
        counts |= {
            f"right{name}": share.right,
            f"failures{name}": failures,
            f"failures{name}_a_seed": failures / seeds if seeds else None,
            f"success{name}": 100 * share.share if share.of else None,
        }
    features = [cost.features for cost in one.costs.values() if cost.features is not None]
    counts["features"] = fmean(features) if features else None
    return counts | {name: value for name, value in one.figures.items() if name.isidentifier()}


def _origin(sources: Sequence[CellSource]) -> str:
    """When and by what the figures came to be, and over how many seeds."""
    runs = [source.campaign for source in sources]
    days = sorted({run.started[:10] for run in runs})
    versions = dict.fromkeys(
        f"refseq-bench {run.versions.get('refseq-bench', '?')} with MuJoCo {run.versions.get('mujoco', '?')}"
        for run in runs
    )
    seeds = sorted({source.seeds for source in sources})
    told = f"{span_words(seeds)} seed{'s' if seeds != [1] else ''}"
    drawn = sorted({renderer for source in sources for renderer in _renderers(source.case)})
    pictures = "" if not drawn else f", pictures by {' and '.join(drawn)}"
    return f"Run on {span_words(days)} by {' and '.join(versions)}{pictures}; {told} a case."


def _renderers(case: CaseRecord) -> Iterator[str]:
    """By which renderers the pictures of a case's drives were drawn; none of drives without, and of logs."""
    resolved = case.resolved
    for table in (resolved.get("reference"), *resolved.get("further", ()), resolved.get("query")):
        renderer = (table or {}).get("renderer", RendererKind.NONE)
        if renderer != RendererKind.NONE:
            yield str(renderer)


def stale(wanted: Sequence[Block], runs: CampaignRuns) -> Iterator[tuple[Block, str]]:
    """The tables that do not stand as the runs have them, and what should stand there."""
    for block in wanted:
        body = filled(block, runs)
        if body != block.body:
            yield block, body
