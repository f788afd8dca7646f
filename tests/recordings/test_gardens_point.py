"""Gardens Point by day and by night as its folder comes: pictures alone, judged by picture."""

import pytest

from refseq_bench.scenarios.drives.benchmark import Benchmark, by_experiment, pairs_of, run_benchmark, tolerances_of
from refseq_bench.scenarios.scoring.score import Score
from tests.recordings.asking import recording


@pytest.fixture(scope="module")
def scores() -> dict[str, Score]:
    pairs = pairs_of([recording("gardens-point") / "night-day"])
    benchmark = Benchmark(pairs, ("best/uniform", "best/chain"))
    comparisons = run_benchmark(benchmark, lambda _: None, pytest.fail)
    [(name, found)] = by_experiment(comparisons, tolerances_of(benchmark, comparisons))
    assert name == "night-day/day_right → night-day/night_right"
    return {one.method: one.wide for one in found}


@pytest.mark.slow
def test_the_order_of_pictures_makes_up_for_the_night(scores: dict[str, Score]) -> None:
    single, chain = scores["best/uniform"], scores["best/chain"]
    assert {one.tolerance.label for one in scores.values()} == {"2 frames"}
    assert single.success.trials == chain.success.trials == 90
    # 12 % is what single pictures find by correlation, 15 % sequences of ten by SeqSLAM's
    assert 0.12 < single.success.value < 0.5
    assert chain.success.value > 0.8
