"""Collect what benchmarks print and the bounds that they assert, by pytest's own account of each comparison."""

import ast
import re
from collections.abc import Generator
from dataclasses import dataclass, field
from textwrap import dedent

import pytest


@dataclass
class Row:
    """One benchmark: how it ended, how long it took [s], its figures beside their bounds, and what it printed."""

    name: str
    ended: str = "passed"
    seconds: float = 0.0
    bounds: dict[str, str] = field(default_factory=dict)
    """Each comparison as the benchmark has it, and the same with its figures; of one in a loop, the last."""
    printed: str = ""


class Collector:
    """A plug-in of pytest that makes a row of each benchmark, and prints its figures as it ends."""

    def __init__(self) -> None:
        self.rows: dict[str, Row] = {}

    def pytest_assertion_pass(self, item: pytest.Item, orig: str, expl: str) -> None:
        """Keep a comparison that held."""
        self._row(item).bounds.update(bound(orig, expl))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Keep how a benchmark ended, and the comparison that did not hold."""
        report = yield
        row = self._row(item)
        row.seconds += call.duration
        if call.excinfo is not None:
            row.ended = f"skipped: {call.excinfo.value}" if report.skipped else "failed"
        if report.failed:
            row.bounds.update(missed(call))
        if report.when == "teardown":
            row.printed = report.capstdout.strip("\n")
            print(f"\n== {row.name}: {row.ended}, {row.seconds:.0f} s\n{row.printed}", flush=True)
        return report

    def _row(self, item: pytest.Item) -> Row:
        file = item.path.stem.removeprefix("test_")
        return self.rows.setdefault(item.nodeid, Row(f"{file}: {item.name.removeprefix('test_').replace('_', ' ')}"))


def bound(compared: str, found: str) -> dict[str, str]:
    """A comparison of more and less with the figures that it found; nothing of another assertion."""
    test = ast.parse(f"({compared}\n)", mode="eval")
    orders = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
    if any(isinstance(node, ast.Compare) and isinstance(node.ops[0], orders) for node in ast.walk(test)):
        return {ast.unparse(test): short(found)}
    return {}


def missed(call: pytest.CallInfo[None]) -> dict[str, str]:
    """The assertion that did not hold, or the error in its place, in one line."""
    assert call.excinfo is not None
    error, statement = call.excinfo.value, dedent(str(call.excinfo.traceback[-1].statement)).strip()
    told = re.search(r"^assert (.*)", str(error), re.MULTILINE)
    if isinstance(error, AssertionError) and told and statement.startswith("assert"):
        (asserted,) = ast.parse(statement).body
        assert isinstance(asserted, ast.Assert)
        return {ast.unparse(asserted.test): short(told[1])}
    return {type(error).__name__: " ".join(str(error).split())[:200]}


def short(found: str) -> str:
    """The first line of pytest's account, its numbers without their types and to four digits."""
    bare = re.sub(r"np\.\w+\(([^()]*)\)", r"\1", found.partition("\n")[0])
    return re.sub(r"-?\d+\.\d+(?:e[-+]?\d+)?", lambda number: f"{float(number[0]):.4g}", bare)
