import io
import json

import pytest

from refseq_bench.scenarios.cli.terminal.console import WideConsole, print_json
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


@pytest.mark.parametrize("width", [1, 20, 40, 59])
def test_a_window_that_is_too_narrow_cuts_no_figure_and_no_word(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("os.get_terminal_size", lambda *_: __import__("os").terminal_size((width, 20)))
    table = TextTable("stage", "what", ">failures", ">lost", title="x", wraps=("what",))
    table.add_row("chain", "an unbreakable word " * 4, "12345678", "36")
    for console in (
        WideConsole(file=io.StringIO(), force_terminal=True, color_system=None),
        WideConsole(file=io.StringIO()),
    ):
        console.print(table)
        told = console.file.getvalue()  # type: ignore[attr-defined]
        assert {"stage", "what", "failures", "lost", "chain", "12345678", "36"} < set(told.split())
        assert told.split().count("unbreakable") == 4


def test_a_heading_of_two_lines_is_as_wide_as_the_longer_one() -> None:
    table = TextTable("method", ">within 1.5 m\nof 6, %", ">failed")
    table.add_row("a", "50.0", "3")
    console = WideConsole(file=io.StringIO())
    console.print(table)
    told = console.file.getvalue()  # type: ignore[attr-defined]
    assert max(map(len, told.splitlines())) == len(" method  within 1.5 m  failed  ")


def test_json_holds_no_sign_that_a_terminal_obeys(capsys: pytest.CaptureFixture[str]) -> None:
    value = {"topic\x7f": "a\x9b31m\x1b[0m é"}
    print_json(value)
    text = capsys.readouterr().out
    assert json.loads(text) == value
    assert all(sign.isprintable() or sign == "\n" for sign in text)
    assert "é" in text


def test_an_object_is_no_key() -> None:
    """Its name in JSON would be Python's own way of writing it, which no other program reads."""
    with pytest.raises(TypeError, match="a key of JSON is text or a whole number"):
        print_json({(1.5, "m"): 3})
