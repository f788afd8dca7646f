"""Run the benchmarks: ``python -m tests.benchmarks [NAME…]``, or ``./run bench``."""

import argparse
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import pytest
from rich.console import Console

from refseq_bench.scenarios.tables import TextTable, print_whole
from tests.benchmarks.bounds import Collector, Row
from tests.robustness.table import origin

HERE = Path(__file__).parent


def main(words: Sequence[str] | None = None, folder: Path = HERE) -> int:
    """Run benchmarks and print their table; 1 if one did not pass, 2 for a wrong name or file."""
    files = {file.stem.removeprefix("test_"): file for file in folder.rglob("test_*.py")}
    files = dict(sorted(files.items()))
    options = _parser(", ".join(files)).parse_args(words)
    for name in options.names:
        if name not in files:
            return _refused(f"unknown benchmark '{name}'; valid: {', '.join(files)}")
    try:
        older = read_bounds(options.against) if options.against else None
    except OSError as error:
        return _refused(f"--against {options.against}: {error.strerror}")
    except (ValueError, LookupError, TypeError, AttributeError):
        return _refused(f"--against {options.against}: is no file that --json wrote")
    rows = run([files[name] for name in options.names or files])
    print_table(rows, older)
    if options.json:
        options.json.write_text(json.dumps({**origin(), "rows": [asdict(row) for row in rows]}, indent=1))
    return int(not rows or any(row.ended == "failed" for row in rows))


def _refused(line: str) -> int:
    print(line, file=sys.stderr)
    return 2


def _parser(names: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("./run bench", description="Measure time and memory, and hold them to bounds.")
    parser.add_argument("names", metavar="NAME", nargs="*", help=f"files of tests/benchmarks, default all: {names}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep the figures, with commit and machine")
    parser.add_argument("--against", type=Path, metavar="FILE", help="show the figures of such a file beside the new")
    return parser


def run(files: Sequence[Path]) -> list[Row]:
    """Run the benchmarks of some files, one after the other, and print the figures of each as it ends."""
    collector = Collector()
    # Pytest tells of comparisons that hold only where they were compiled for it: the hook needs bytecode of its own.
    with tempfile.TemporaryDirectory() as bytecode, pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "pycache_prefix", bytecode)
        hook = [
            "-o",
            "enable_assertion_pass_hook=true",
            "-p",
            "no:cacheprovider",
            "--no-header",
            "--show-capture=stderr",
        ]
        pytest.main([*hook, "-m", "benchmark", *map(str, files)], [collector])
    return list(collector.rows.values())


def read_bounds(file: Path) -> dict[tuple[str, str], str]:
    """The figures of a file of ``--json``, by benchmark and comparison."""
    rows = json.loads(file.read_text())["rows"]
    return {(row["name"], bound): found for row in rows for bound, found in row["bounds"].items()}


def print_table(rows: Sequence[Row], older: Mapping[tuple[str, str], str] | None) -> None:
    """Print benchmark × bound × figures × older figures × how it ended."""
    table = TextTable("benchmark", "bound", "figures", *(["older"] if older is not None else []), ">s", "ended")
    for row in rows:
        for number, (bound, found) in enumerate(row.bounds.items() or [("", "")]):
            then = [older.get((row.name, bound), "")] if older is not None else []
            once = ("", "", "") if number else (row.name, f"{row.seconds:.0f}", row.ended)
            table.add_row(once[0], bound, found, *then, *once[1:])
    print_whole(Console(), table)


if __name__ == "__main__":
    sys.exit(main())
