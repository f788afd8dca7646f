"""Runs of pairs against a search that tries them all, and what keeps chance out of them."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from refseq.atlas.runs import STEPS, RunSettings, best_runs

SETTINGS = RunSettings(score=0.5, spread=np.inf, askew=np.inf)


def straight(count: int) -> np.ndarray:
    """Places a metre apart on a straight line."""
    return np.column_stack([np.arange(float(count)), np.zeros((count, 2))])


def best_of_all(nats: np.ndarray) -> float:
    """Score of the best run that goes on by any of the steps, by trying all of them; a metre a place."""

    def longest(i: int, j: int) -> float:
        on = [
            longest(i + a, j + b) - ((a - b) / SETTINGS.slack) ** 2 / 2
            for a, b in STEPS
            if i + a < nats.shape[0] and j + b < nats.shape[1]
        ]
        return nats[i, j] - SETTINGS.bar + max([0.0, *on])

    return max(longest(i, j) for i in range(nats.shape[0]) for j in range(nats.shape[1]))


def score_of(nats: np.ndarray, run: np.ndarray) -> float:
    steps = np.diff(run, axis=0)
    return float(
        (nats[tuple(run.T)] - SETTINGS.bar).sum()
        - (np.diff(steps, axis=1) / SETTINGS.slack).ravel() ** 2 @ np.full(len(steps), 0.5)
    )


@pytest.mark.parametrize("seed", range(8))
def test_the_first_run_is_the_best_of_all(seed: int) -> None:
    nats = np.random.default_rng(seed).normal(-0.2, 1.5, (6, 7))
    runs = best_runs(nats, straight(6), straight(7), SETTINGS)
    assert score_of(nats, runs[0]) == pytest.approx(best_of_all(nats))


def test_a_run_that_turns_otherwise_is_none() -> None:
    nats = np.full((8, 8), -1.0)
    np.fill_diagonal(nats, 2.0)
    one, turned = straight(8), straight(8)
    turned[:, 2] = np.linspace(0.0, 3.0, 8)
    assert [run.tolist() for run in best_runs(nats, one, one)] == [[[n, n] for n in range(8)]]
    assert best_runs(nats, one, turned) == []
    bent = replace(RunSettings(), bend=np.inf)
    assert best_runs(nats, one, turned, bent) == []  # its pairs tell of many relative poses
    assert len(best_runs(nats, one, turned, replace(bent, spread=np.inf, askew=np.inf))) == 1


def test_forbidden_pairs_are_in_no_run() -> None:
    nats = np.full((8, 8), -1.0)
    np.fill_diagonal(nats, 3.0)
    nats[3:5] = -np.inf
    assert {(i, j) for run in best_runs(nats, straight(8), straight(8)) for i, j in run.tolist()}.isdisjoint(
        (i, j) for i in (3, 4) for j in range(8)
    )


def test_runs_take_memory_for_a_few_tables_of_all_pairs() -> None:
    nats, track = np.full((400, 500), -1.0), straight(500)
    tracemalloc.start()
    assert best_runs(nats, track[:400], track) == []
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 4 * nats.nbytes
