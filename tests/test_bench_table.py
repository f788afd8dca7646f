"""The table of benchmarks, on two small files in place of the real ones."""

import json

import pytest

from tests.benchmarks.__main__ import main
from tests.benchmarks.bounds import bound, short

COST = """
import numpy as np
import pytest
pytestmark = pytest.mark.benchmark
def test_it_is_cheap():
    print("three figures")
    ratio, most = np.float64(1.2345678), 1.3
    assert isinstance(ratio, float)
    assert ratio < most, "it is not"
    assert (
        2 * ratio
        >= most / 4
    )
def test_it_is_dear():
    assert 2.57 < 1.3, "it is"
def test_it_breaks():
    raise ValueError("no such file")
@pytest.mark.skip(reason="no graphics")
def test_nobody_can():
    pass
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    # At its end pytest looks five times for garbage among all that this process holds.
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p no:unraisableexception")
    (tmp_path / "test_a_cost.py").write_text(COST)
    (tmp_path / "of_one_kind").mkdir()
    (tmp_path / "of_one_kind" / "test_b_cost.py").write_text(COST[: COST.index("def test_it_is_dear")])
    return tmp_path


def test_each_bound_is_kept_with_the_figures_that_it_found(folder, capsys):
    file = folder / "kept.json"
    assert main(["a_cost", "--json", str(file)], folder) == 1
    kept = json.loads(file.read_text())
    assert {"commit", "time", "machine", "rows"} == set(kept)
    assert [(row["name"], row["ended"], row["bounds"]) for row in kept["rows"]] == [
        (
            "a_cost: it is cheap",
            "passed",
            {"ratio < most": "1.235 < 1.3", "2 * ratio >= most / 4": "(2 * 1.235) >= (1.3 / 4)"},
        ),
        ("a_cost: it is dear", "failed", {"2.57 < 1.3": "2.57 < 1.3"}),
        ("a_cost: it breaks", "failed", {"ValueError": "no such file"}),
        ("a_cost: nobody can", "skipped: no graphics", {}),
    ]
    assert kept["rows"][0]["printed"] == "three figures"
    assert "three figures" in capsys.readouterr().out


def test_older_figures_stand_beside_the_new_ones(folder, capsys):
    file = folder / "kept.json"
    assert main(["b_cost", "--json", str(file)], folder) == 0
    file.write_text(file.read_text().replace("1.235 < 1.3", "9.87 < 1.3"))
    capsys.readouterr()
    assert main(["b_cost", "--against", str(file)], folder) == 0
    table = capsys.readouterr().out
    (line,) = [line for line in table.splitlines() if "1.235 < 1.3" in line]
    assert "9.87 < 1.3" in line


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["c_cost"], "unknown benchmark 'c_cost'; valid: a_cost, b_cost\n"),
        (["--against", "none.json"], "--against none.json: No such file or directory\n"),
    ],
)
def test_what_is_not_there_is_told_in_one_line(folder, words, told, capsys):
    assert main(words, folder) == 2
    assert capsys.readouterr().err == told


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"rows": [1]}', '{"rows": [{"name": "a", "bounds": []}]}'])
def test_a_file_of_other_making_is_told_in_one_line(folder, text, capsys):
    (folder / "odd.json").write_text(text)
    assert main(["--against", str(folder / "odd.json")], folder) == 2
    assert capsys.readouterr().err == f"--against {folder / 'odd.json'}: is no file that --json wrote\n"


def test_only_comparisons_of_more_and_less_are_bounds():
    assert bound("len(a) == 3", "3 == 3") == {}
    assert bound("a <= b", "np.float32(0.5) <= np.int64(7)\n  +  where") == {"a <= b": "0.5 <= 7"}
    assert short("1.23456e-07 < 2") == "1.235e-07 < 2"
