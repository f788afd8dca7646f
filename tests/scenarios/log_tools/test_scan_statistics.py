"""Statistics of scans that were made of known walls and known noise."""

import math

import numpy as np
import pytest

from refseq.view import Scan
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.log_tools.scan_statistics import scan_statistics

STEP = math.radians(0.5)
ANGLES = -math.pi / 2 + STEP * np.arange(361)


def corridor(noise: float, seed: int, lost: float = 0.0) -> Scan:
    """A scan between two walls, 1 m to the right and 2 m to the left, that end 5 m ahead; beside them a wall across."""
    rng = np.random.default_rng(seed)
    with np.errstate(divide="ignore"):
        side = np.where(ANGLES < 0, 1.0, 2.0) / np.abs(np.sin(ANGLES))
        ranges = np.minimum(side, 5.0 / np.maximum(np.cos(ANGLES), 1e-9)) + noise * rng.normal(size=len(ANGLES))
    ranges[rng.random(len(ranges)) < lost] = 81.9
    return Scan(ranges.astype(np.float32), start=-math.pi / 2, step=STEP, max_range=81.83)


@pytest.mark.parametrize("noise", [0.005, 0.015])
def test_the_noise_that_was_put_on_a_wall_is_found(noise: float) -> None:
    found = scan_statistics([corridor(noise, seed) for seed in range(30)], "made")
    assert found.walls >= 60
    assert found.residual_median == pytest.approx(noise, rel=0.05)
    assert (found.scans, found.beams, found.none) == (30, 361, 0.0)


def test_beams_that_bring_nothing_back_and_edges_are_counted() -> None:
    found = scan_statistics([corridor(0.0, seed, lost=0.04) for seed in range(30)], "made")
    assert found.none == pytest.approx(0.04, rel=0.15)
    flat = np.full(10, 2.0, dtype=np.float32)
    flat[5:] = 3.0
    step = scan_statistics([Scan(flat, start=0.0, step=STEP, max_range=81.83)], "made")
    assert step.edges == pytest.approx(1 / 9)
    assert step.median_range == pytest.approx(2.5)
    assert math.isnan(step.residual_median)


def test_a_log_without_a_scan_that_sees_anything_is_told_in_one_line() -> None:
    blind = Scan(np.full(10, 81.9, dtype=np.float32), start=0.0, step=STEP, max_range=81.83)
    for scans in ([], [blind]):
        with pytest.raises(ScenarioError, match="made: has no scan that sees anything; valid is"):
            scan_statistics(scans, "made")
