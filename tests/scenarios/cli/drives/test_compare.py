"""``refseq compare``: tables on the terminal, files, and JSON."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter, write_carmen
from refseq.planar import Pose
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive


def test_tables_are_printed_and_files_written(refseq: Refseq, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "60")
    for name in ("first.log", "later.log"):
        write_carmen(tmp_path / name, corridor_drive(np.random.default_rng(0), 12, size=24))
    words = ("compare", "first.log", "later.log", "--methods", "thesis/uniform,thesis/chain")
    answer = refseq(*words, "-o", "figures.csv", "--report", "report.html")
    assert answer.code == 0, answer.err
    assert ": 1 drive, 12 views" in answer.out
    assert "thesis/chain" in answer.out
    assert (tmp_path / "figures.csv").read_text().count("\n") == 3
    assert "thesis/chain" in (tmp_path / "report.html").read_text()
    found = json.loads(refseq(*words, "--json").out)
    assert [one["method"] for one in found] == ["thesis/uniform", "thesis/chain"]


def test_a_table_of_another_kind_is_refused_at_once(refseq: Refseq) -> None:
    answer = refseq("compare", "none.log", "none.log", "-o", "figures.json")
    assert answer.code == 2
    assert answer.err == "error: figures.json: is no name of a table; valid is one that ends in .csv\n"


def test_without_truth_methods_are_compared_by_what_needs_none(refseq: Refseq, tmp_path: Path) -> None:
    for name in ("first.mcap", "later.mcap"):
        with RecordingWriter(tmp_path / name, {}) as writer:
            for number, view in enumerate(corridor_drive(np.random.default_rng(0), 12, size=24)):
                writer.write(replace(view, truth=None), Pose(0.85 * number, 0.0, 0.0))
    words = ("compare", tmp_path / "first.mcap", tmp_path / "later.mcap", "--methods", "thesis/uniform,thesis/chain")
    answer = refseq(*words, "--report", tmp_path / "report.html")
    assert answer.code == 0, answer.err
    assert "not scored: neither what was learnt nor the query has true poses\n" in answer.out
    assert "agrees with" in answer.out
    assert "No score: neither what was learnt nor the query has true poses." in (tmp_path / "report.html").read_text()
    for one in json.loads(refseq(*words, "--json").out):
        assert (one["failures_views"], one["within_1.5_m_right_views"], one["harm_views"]) == (None, None, None)
        assert one["odometry_jumps_of_steps"] == 11 - round(0.12 * one["says_lost_percent"])
