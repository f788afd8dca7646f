"""Cost of a view to a guest beside the same call in this process: two VGA cameras and a scan go through a pipe."""

import time
from pathlib import Path

import numpy as np
import pytest

from refseq.belief import LocaliserProtocol
from refseq.view import View
from refseq_bench.scenarios.methods.plugins import PluginLocaliser
from refseq_bench.scenarios.methods.templates import MY_LOCALISER
from refseq_bench.scenarios.methods.templates.my_localiser import MyLocaliser
from tests.support import corridor_drive

pytestmark = pytest.mark.benchmark
IDLE = """
from refseq.belief import belief_from
class Idle:
    def __init__(self, views): self.answer = belief_from([1.0] * len(views))
    def reset(self): pass
    def update(self, view): return self.answer
"""


def milliseconds(localisers: list[LocaliserProtocol], views: list[View]) -> list[float]:
    """Cost of a view to each, asked in turn: of the fastest tenth, for others who use the cores make a pipe wait."""
    costs = np.zeros((len(views), len(localisers)))
    for number, view in enumerate(views):
        for column, localiser in enumerate(localisers):
            begin = time.perf_counter()
            localiser.update(view)
            costs[number, column] = 1e3 * (time.perf_counter() - begin)
    return list(np.quantile(costs, 0.1, axis=0))


def test_a_pipe_costs_less_than_the_smallest_localiser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("idle.py").write_text(IDLE)
    Path("my_localiser.py").write_text(MY_LOCALISER[".py"].read_text())
    views = corridor_drive(np.random.default_rng(0), 118)
    begin = time.perf_counter()
    idle = PluginLocaliser("idle:Idle", views)
    start = time.perf_counter() - begin
    outside = PluginLocaliser("my_localiser:MyLocaliser", views)
    localisers: list[LocaliserProtocol] = [idle, MyLocaliser(views), outside]
    for one in localisers:
        one.reset()
    way, inside, there = milliseconds(localisers, views)
    megabytes = sum(image.nbytes for image in views[0].images.values()) / 1e6
    print(
        f"\n{megabytes:.2f} MB there and a belief back {way:.2f} ms; the template {inside:.2f} ms in this process and"
    )
    print(f"{there:.2f} ms in a guest, {there / inside:.2f} times; start and 118 views to learn {start:.2f} s")
    assert way < inside
