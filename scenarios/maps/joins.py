"""Decisions about joins as a file that a person reads, changes and gives back, as a table, and as questions (M8)."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, NonNegativeInt, ValidationError
from rich.text import Text

from refseq.atlas.decision import Decision
from refseq.files import replace_text
from refseq_bench.scenarios.drives.inputs import writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.text_file import TextFileError, read_toml, toml_lines

HEAD = """\
# Joins that refseq map merge made or refused. Turn `joined` round, or add a join of your own, and give this file to
# refseq map merge --decisions. `first` and `second` are the first and last view of the stretch in either sequence.
# `machine` is what the machine decided: it may decide otherwise when more maps are merged. A join holds for good where
# `joined` is something else, or where there is no `machine`: take the line out to make a decision your own, or that
# of `lengths_m` where you change its views.
"""
BY_A_PERSON = "a person says so"


class JoinTable(BaseModel):
    """One ``[[join]]``."""

    model_config = ConfigDict(extra="forbid", strict=True)
    one: str
    other: str
    first: tuple[NonNegativeInt, NonNegativeInt]
    second: tuple[NonNegativeInt, NonNegativeInt]
    joined: bool
    why: str = ""
    lengths_m: tuple[float, float] | None = None
    machine: bool | None = None

    @property
    def by_a_person(self) -> bool:
        """True for a join that a person added, turned round, or changed the views of, and so its lengths taken out."""
        return self.machine is not self.joined or self.lengths_m is None

    @property
    def decision(self) -> Decision:
        """The table as a decision, with a reason only if it is a person's."""
        lengths, why = self.lengths_m or (0.0, 0.0), BY_A_PERSON if self.by_a_person else ""
        return Decision(self.one, self.other, self.first, self.second, lengths, self.joined, why)


class GivenDecisions(NamedTuple):
    """Decisions of a file: those of a person, and those of a machine, which pin nothing."""

    persons: list[Decision]
    machines: list[Decision]


class JoinFile(BaseModel):
    """The whole file."""

    model_config = ConfigDict(extra="forbid", strict=True)
    join: list[JoinTable] = []


def write_decisions(path: Path, decisions: Sequence[Decision]) -> None:
    """Write decisions for a person to read and to change."""
    tables = [HEAD]
    for d in decisions:
        table = {
            "one": d.one,
            "other": d.other,
            "first": d.first,
            "second": d.second,
            "lengths_m": [round(length, 2) for length in d.lengths],
            "joined": d.joined,
            **({} if d.why == BY_A_PERSON else {"machine": d.joined}),
            "why": d.why,
        }
        tables.append("[[join]]\n" + toml_lines(table))
    with writing(path):
        replace_text(path, "\n".join(tables))


def read_decisions(path: Path) -> GivenDecisions:
    """Read what a person decided, and what the machine did and nobody turned round.

    Raises ``ScenarioError`` with the file, the key, and what is valid.
    """
    try:
        content = read_toml(path)
    except TextFileError as error:
        raise ScenarioError(f"{path}: {error}; valid are decisions in TOML") from None
    try:
        joins = JoinFile.model_validate(_with_tuples(content)).join
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ScenarioError(f"{path}: {where} = {first['input']!r:.60}: {first['msg'].lower()}") from error
    for number, join in enumerate(joins):
        for name, (start, end) in (("first", join.first), ("second", join.second)):
            if start > end:
                raise ScenarioError(f"{path}: join.{number}.{name} = [{start}, {end}]; valid is first view, last view")
    persons = [join.decision for join in joins if join.by_a_person]
    return GivenDecisions(persons, [join.decision for join in joins if not join.by_a_person])


def _with_tuples(content: dict[str, object]) -> dict[str, object]:
    """TOML's lists of numbers as tuples, which is what a strict reader wants."""
    joins = content.get("join")
    if not isinstance(joins, list):
        return content
    return content | {"join": [_tupled(join) if isinstance(join, dict) else join for join in joins]}


def _tupled(join: dict[str, object]) -> dict[str, object]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in join.items()}


def decision_table(decisions: Sequence[Decision]) -> TextTable:
    """Decisions, a row each."""
    table = TextTable("", "one", "views", "other", "views", "length [m]", "why", wraps=("why",))
    for d in decisions:
        table.add_row(
            Text("joined" if d.joined else "refused", "green" if d.joined else "yellow"),
            d.one,
            f"{d.first[0]}-{d.first[1]}",
            d.other,
            f"{d.second[0]}-{d.second[1]}",
            f"{d.lengths[0]:.1f} / {d.lengths[1]:.1f}",
            d.why,
        )
    return table
