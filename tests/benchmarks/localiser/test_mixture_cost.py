"""What the mixture costs as the map grows: one view of 200 visible features, from a hundred to 100 000 places."""

import time

import numpy as np
import pytest

from refseq.inference.matching.columns import Rows, distinct_columns
from refseq.inference.matching.mixture import MixtureForm, MixtureSettings, match_view
from tests.benchmarks.peak import peak_bytes

pytestmark = pytest.mark.benchmark
SIZES = (100, 1_000, 10_000, 100_000)
VISIBLE = 200
SPREAD = 8  # neighbouring places at which a feature was seen
ROUNDS = 7


def visible_rows(rng: np.random.Generator, K: int, common: int) -> Rows:
    """A third of the features from where the robot is, the rest mistaken; ``common`` ones are seen in half the places.

    Common features are what a laser gives: they hold over stretches of twenty places.
    """
    here = int(rng.integers(K - SPREAD))
    first = np.where(np.arange(VISIBLE) % 3, rng.integers(0, K - SPREAD, VISIBLE), here + rng.integers(-4, 5, VISIBLE))
    words = np.clip(first, 0, K - SPREAD)[:, None] + np.arange(SPREAD)
    stretches = [np.flatnonzero(np.repeat(rng.random(K // 20 + 1) < 0.5, 20)[:K]) for _ in range(common)]
    places = [*words, *stretches]
    pointers = np.cumsum([0, *(len(row) for row in places)])
    return Rows(pointers.astype(np.int64), np.concatenate(places).astype(np.int32), K)


def milliseconds(rows: Rows, form: MixtureForm) -> float:
    """Median time of a match."""
    spent = []
    for seed in range(ROUNDS):
        start = time.perf_counter()
        match = match_view(rows, MixtureSettings(form=form), np.random.default_rng(seed))
        spent.append(time.perf_counter() - start)
        assert not match.failed
    return 1e3 * float(np.median(spent))


@pytest.mark.parametrize("common", [0, 10], ids=["pictures", "pictures and laser"])
def test_the_cost_of_a_match_as_the_map_grows(common: int) -> None:
    rng = np.random.default_rng(0)
    print(
        "\n places  distinct columns  " + "  ".join(f"{form:>10}" for form in MixtureForm) + "  [ms, median]  peak [MB]"
    )
    found = []
    for K in SIZES:
        rows = visible_rows(rng, K, common)
        distinct = len(distinct_columns(rows).multiplicity)
        costs = [milliseconds(rows, form) for form in MixtureForm]
        numbers = "  ".join(f"{cost:10.2f}" for cost in costs)
        peak = peak_bytes() // 10**6
        print(f"{K:7d}  {distinct:16d}  {numbers}  {'':12}  {peak:9d}")
        found.append(costs[0])
    # A thousand times the places, and far from a thousand times the work: what grows is the distinct columns.
    assert found[-1] < 200 * found[0]
