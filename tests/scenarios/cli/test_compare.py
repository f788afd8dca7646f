import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from refseq.logs.carmen import write_carmen
from scenarios.cli.compare import run_comparison
from scenarios.drives.benchmark import Benchmark
from scenarios.errors import ScenarioError
from tests.support import corridor_drive


def test_tables_are_printed_and_files_written(tmp_path: Path) -> None:
    for name in ("first.log", "later.log"):
        write_carmen(tmp_path / name, corridor_drive(np.random.default_rng(0), 12, size=24))
    contest = Benchmark([(tmp_path / "first.log", tmp_path / "later.log")], ("thesis/uniform", "thesis/chain"))
    console = Console(file=io.StringIO(), width=60)
    [(name, found)] = run_comparison(
        contest, console, lambda _: None, table=tmp_path / "figures.csv", report=tmp_path / "report.html"
    )
    text = console.file.getvalue()  # type: ignore[attr-defined]
    assert f"{name}: 1 drive, 12 views" in text
    assert [one.method for one in found] == ["thesis/uniform", "thesis/chain"]
    assert "thesis/chain" in text
    assert (tmp_path / "figures.csv").read_text().count("\n") == 3
    assert "thesis/chain" in (tmp_path / "report.html").read_text()


def test_a_table_of_another_kind_is_refused_at_once(tmp_path: Path) -> None:
    contest = Benchmark([(tmp_path / "none.log", tmp_path / "none.log")])
    with pytest.raises(ScenarioError, match=r"figures.json: is no table's name; valid is a name that ends in .csv"):
        run_comparison(contest, Console(), lambda _: None, table=tmp_path / "figures.json", report=None)
