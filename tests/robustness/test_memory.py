"""The slope of a process's memory: found where memory leaks, and nought where it does not."""

import numpy as np
import pytest

from tests.robustness.memory import growth


@pytest.mark.quick_cases("0.02")
@pytest.mark.parametrize("leak", [0.0, 0.02])
def test_the_slope_is_that_of_what_is_kept(leak):
    kept = []

    def step():
        kept.append(np.ones(int(leak * 1e6 / 8)))

    found = growth((step() for _ in range(3000)), 3000)
    assert found == pytest.approx(1000 * leak, abs=0.5)
