"""The table of attacks: on the terminal, in Markdown and in JSON."""

import json
import os
import platform
import subprocess
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.console import Console

from refseq_bench.scenarios.tables import TextTable, print_whole
from tests.robustness.run import Fall, Row

ROOT = Path(__file__).resolve().parents[2]
HEADINGS = ("attack", ">tries", ">survived", "worst", ">s", "command")


def print_table(rows: Sequence[Row]) -> None:
    """Print attack × tries × survived × worst × seconds × the command that repeats it."""
    table = TextTable(*HEADINGS)
    for row in rows:
        table.add_row(*_cells(row))
    print_whole(Console(), table)


def markdown(rows: Sequence[Row]) -> str:
    """The table in Markdown, with the promises, and below it what fell."""
    lines = [f"Commit {commit()}, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {_machine()}.", ""]
    lines += ["| attack | promise | tries | survived | worst | s | command |", "|---|---|--:|--:|---|--:|---|"]
    for row in rows:
        name, *figures, command = (cell.replace("|", "\\|") for cell in _cells(row))
        lines.append(f"| {' | '.join((name, row.promise, *figures, f'`{command}`'))} |")
    falls = [f"- `{row.name}`, seed {fall.seed}: {fall.told}" for row in rows for fall in row.falls]
    return "\n".join([*lines, *(["", "What fell:", "", *falls] if falls else []), ""])


def _cells(row: Row) -> tuple[str, ...]:
    worst = ", ".join(f"{figure:.3g} {unit}" for unit, figure in row.figures.items())
    if row.skipped:
        return row.name, "0", "skipped", row.skipped, "", command(row)
    return row.name, str(row.tries), str(row.survived), worst, f"{row.seconds:.0f}", command(row)


def command(row: Row) -> str:
    """The command that makes the same tries again; how many and from which seed is told where it is not the usual."""
    tries = f" --tries {row.tries}" if not row.skipped and row.tries != row.in_full else ""
    return f"./run attacks {row.name}{tries}{f' --seed {row.seed}' if row.seed else ''}"


def commit() -> str:
    """The commit's short name, with a plus if files differ from it."""
    told = subprocess.run(
        ["git", "describe", "--always", "--exclude=*", "--dirty=+"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return told.stdout.strip() or "unknown"


def _machine() -> str:
    return f"{os.cpu_count()} cores, Linux {platform.release().partition('-')[0]}, Python {platform.python_version()}"


def as_json(rows: Sequence[Row]) -> dict[str, Any]:
    """The rows with what tells where they are from."""
    return {**origin(), "rows": [asdict(row) for row in rows]}


def origin() -> dict[str, str]:
    """Tell where and when a table was made."""
    return {"commit": commit(), "time": datetime.now(UTC).isoformat(timespec="seconds"), "machine": _machine()}


def read_rows(file: Path) -> list[Row]:
    """The rows of a file of :func:`as_json`."""
    return [_row(row) for row in json.loads(file.read_text())["rows"]]


def _row(told: dict[str, Any]) -> Row:
    return Row(**{**told, "falls": [Fall(**fall) for fall in told["falls"]]})
