"""Seeds of a case's drives: no two drives of a case draw the same random numbers."""

from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.drive_seeds import added_seeds, check_apart
from refseq_bench.scenarios.campaign.declare.overrides import with_seeds
from refseq_bench.scenarios.errors import ScenarioError

REFERENCE = '[reference]\nworld = "hallway"\nrenderer = "none"\n'
LOGS = '[reference]\nlog = "a.log"\n[query]\n'


@given(st.lists(st.integers(0, 9).map(lambda n: 500 * n), min_size=1, max_size=4, unique=True), st.integers(0, 3))
def test_seeds_are_refused_exactly_where_two_drives_would_draw_alike(seeds: list[int], further: int) -> None:
    added = added_seeds(further)
    drives = [seed + more for seed, more in product(seeds, added.values())]
    try:
        check_apart(seeds, added)
    except ScenarioError:
        assert len(set(drives)) < len(drives)
    else:
        assert len(set(drives)) == len(drives)


@pytest.mark.parametrize(
    ("seeds", "more", "told"),
    [
        (
            "seeds = [1, 1001]\n",
            "[query]\n",
            "seeds: 1 and 1001: query of 1 and reference of 1001 would draw the same random numbers; valid are seeds, "
            "with those for training, that differ by none of [1000]",
        ),
        (
            "seeds = [1]\ntraining_seeds = [2001]\n",
            "[query]\n[[further]]\n",
            "seeds: 1 and 2001: further.0 of 1 and reference of 2001 would draw the same random numbers; valid are "
            "seeds, with those for training, that differ by none of [1000, 2000]",
        ),
    ],
)
def test_seeds_that_meet_are_told_in_a_line(tmp_path: Path, seeds: str, more: str, told: str) -> None:
    file = tmp_path / "met.toml"
    file.write_text(f'title = "T"\n{seeds}{REFERENCE}{more}')
    with pytest.raises(ScenarioError) as caught:
        load(file)
    assert str(caught.value) == f"{file}: {told}"


def test_seeds_on_the_command_line_meet_neither_each_other_nor_those_for_training(tmp_path: Path) -> None:
    file = tmp_path / "met.toml"
    file.write_text(f'title = "T"\nseeds = [101]\ntraining_seeds = [1]\n{REFERENCE}[query]\n')
    for seeds, met in (("7,1007", "7 and 1007"), ("1001", "1001 and 1")):
        with pytest.raises(ScenarioError, match=f"^met: seeds: {met}: .* would draw the same random numbers; valid"):
            with_seeds(load(file), seeds)
    assert [case.scenario.seeds for case in with_seeds(load(file), "7,1008,2007")] == [(7, 1008, 2007)]


@pytest.mark.parametrize("noisy", ["", "odometry_noise = true\n"])
def test_logs_without_noise_draw_nothing_and_cannot_meet(tmp_path: Path, noisy: str) -> None:
    """Only the query has noise: its numbers are those of no other."""
    file = tmp_path / "real.toml"
    file.write_text(f'title = "T"\nseeds = [1]\ntraining_seeds = [1001]\n{LOGS}{noisy}')
    assert load(file)
