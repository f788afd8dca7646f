import io

import pytest

from refseq_bench.scenarios.cli.terminal.console import WideConsole
from refseq_bench.scenarios.tables import TextTable


def printed(console: WideConsole) -> list[str]:
    table = TextTable("world", "what", ">size", wraps=("what",))
    table.add_row("a-world-of-the-library", "a long text " * 12, "12345678901234567890")
    console.print(table)
    return console.file.getvalue().splitlines()  # type: ignore[attr-defined]


def test_a_piped_table_is_as_wide_as_what_it_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = printed(WideConsole(file=io.StringIO()))
    (row,) = [line for line in lines if "a-world" in line]
    assert "a long text " * 11 in row
    assert "12345678901234567890" in row
    assert max(map(len, lines)) < 220


def test_columns_sets_the_width_of_what_is_piped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    assert max(map(len, printed(WideConsole(file=io.StringIO())))) <= 60


def test_a_window_keeps_its_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr("os.get_terminal_size", lambda *_: __import__("os").terminal_size((70, 20)))
    assert max(map(len, printed(WideConsole(file=io.StringIO(), force_terminal=True, color_system=None)))) <= 70
