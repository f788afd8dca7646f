"""What workers and the cache gain: a campaign of cheap drives by one worker, by two, and when all is kept.

Times are of the clock, and workers fight for the cores with whatever else runs: measure on a machine that is idle. The
processes are begun before the clock is.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from refseq.features import SiftWords
from refseq.features.memory import described_once
from refseq.features.sift import SiftSettings
from refseq.view import View
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.workers import LocalWorkers, WorkerPool
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.descriptions import KeptDescriptions
from tests.scenarios.campaign.chores import Chore

pytestmark = pytest.mark.benchmark
SCENARIO = """
title = "A stretch of the hallway, laser only"
seeds = [1, 2, 3]
expect = ["success >= 0 %"]
[reference]
world = "hallway"
renderer = "none"
end = 30.0
[query]
light = "18:00"
[localise]
methods = ["thesis"]
"""


class Counting(Watcher):
    """Adds up what the tasks themselves took [s]."""

    seconds = 0.0

    def ended(self, task: object, outcome: TaskOutcome) -> None:
        self.seconds += outcome.seconds


def clocked(cases: Sequence[Case], executor: WorkerPool, store: Store) -> tuple[float, list[Judged], float]:
    """Seconds of a campaign, what came of it, and the seconds of its tasks."""
    watcher, begin = Counting(), time.perf_counter()
    results = list(run_campaign(cases, executor, store, watcher))
    return time.perf_counter() - begin, results, watcher.seconds


def warm(workers: LocalWorkers, folder: Path) -> None:
    """Have every process begun, and what is imported imported."""
    wait = [workers.submit(Chore(f"warm-{number}", "sleep")) for number in range(workers.workers)]
    assert all(future.result(300).good for future in wait)
    for path in folder.glob("warm-*"):
        path.unlink()


def test_two_workers_gain_and_what_is_kept_costs_next_to_nothing(tmp_path: Path) -> None:
    file = tmp_path / "stretch.toml"
    file.write_text(SCENARIO)
    cases = load(file)
    took: dict[int, float] = {}
    for count in (1, 2):
        folder = tmp_path / str(count)
        workers = LocalWorkers(count, folder)
        Store(folder)
        warm(workers, folder)
        took[count], results, busy = clocked(cases, workers, Store(folder))
        print(
            f"{count} workers: {took[count]:.1f} s for {busy:.1f} s of tasks, {busy / took[count]:.2f} at a time; "
            f"{Store(folder).size / 1e6:.2f} MB kept"
        )
        again, kept, _ = clocked(cases, workers, Store(folder))
        print(f"  all kept: {again:.2f} s, {took[count] / again:.0f} times faster")
        workers.close(at_once=False)
        assert again < took[count] / 5
        assert kept[0].digests == results[0].digests
    print(f"two workers: {took[1] / took[2]:.2f} times faster")
    assert took[2] < took[1] / 1.3


def test_descriptions_that_are_kept_cost_a_tenth_of_finding_them(tmp_path: Path) -> None:
    """By workers one after the other, of pictures as busy as those of a wall of posters."""
    rng = np.random.default_rng(0)
    blocks = rng.integers(0, 256, (20, 48, 64), np.uint8)
    views = [View(0.0, {"a": np.kron(one, np.ones((10, 10), np.uint8))}) for one in blocks]
    took = []
    for _ in ("found", "kept"):
        memory, words = KeptDescriptions(), SiftWords("a", SiftSettings())
        begin = time.perf_counter()
        memory.keep_in(tmp_path)
        with described_once(memory):
            for view in views:
                words.describe(view)
        took.append(time.perf_counter() - begin)
    print(f"found: {1e3 * took[0] / len(views):.1f} ms a picture, kept: {1e3 * took[1] / len(views):.1f} ms")
    assert took[1] < took[0] / 10
