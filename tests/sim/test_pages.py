"""The examples of ``docs/sim.md`` that need no camera run as they stand."""

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "sim.md"


def example(word: str) -> str:
    """The one block of Python in which a word stands."""
    (block,) = (found for found in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL) if word in found)
    return str(block)


def test_a_fault_that_is_put_in_stops_the_robot(capsys: pytest.CaptureFixture[str]) -> None:
    exec(example("bench.tamper"), {})
    assert "sonar 0 reads no number" in capsys.readouterr().out


def test_the_serial_port_is_served(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    exec(example("bench.tamper"), names)
    capsys.readouterr()
    began = names["bench"].time
    exec(example("open_port").replace("60.0", "2.0").replace("Pacer(1.0)", "Pacer(1e6)"), names)
    assert re.fullmatch(r"127\.0\.0\.1:\d+\n", capsys.readouterr().out)
    assert names["bench"].time == pytest.approx(began + 2.0)
