from pathlib import Path

import pytest

from refseq.map.profile import PROFILES
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.overrides import with_methods, with_seeds
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods import chosen_on
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.chosen_on import records, refuse_chosen_on

TRACK = """
title = "Seeds apart"
seeds = [101]
training_seeds = [1]
[reference]
world = "building:SEED,texture=0.1"
renderer = "none"
[localise]
methods = ["thesis/chain"]
judged = "thesis/chain"
"""
TUNED = """
[[record]]
methods = ["best"]
worlds = ["annex", "building:102"]
source = "made up"
"""


def test_every_profile_and_baseline_tells_where_it_was_chosen() -> None:
    assert set(records()) == {*PROFILES, *BASELINES}


def test_what_was_chosen_on_a_test_world_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the loader, for a method that is asked for later, and for seeds that are."""
    tuned, file = tmp_path / "tuned.toml", tmp_path / "track.toml"
    tuned.write_text(TUNED)
    file.write_text(TRACK)
    monkeypatch.setattr(chosen_on, "RECORDS", tuned)
    both = with_methods(load(file), [], ["best/chain", "best+chain.window=20/prior"])
    with pytest.raises(
        ScenarioError, match=r"method 'best/chain': its parameters were chosen in 'building:102' \(made up\)"
    ):
        with_seeds(both, "102")
    file.write_text(TRACK.replace("[101]", "[101, 102]"))
    with pytest.raises(ScenarioError, match=r"'best\+chain.window=20/prior': its parameters were chosen"):
        with_methods(load(file), [], ["best+chain.window=20/prior"])
    file.write_text(TRACK.replace("[101]", "[102]").replace("thesis/chain", "best/chain"))
    with pytest.raises(ScenarioError, match="which is tested here; valid are methods that were chosen elsewhere"):
        load(file)


def test_training_seeds_are_for_choosing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tuned, file = tmp_path / "tuned.toml", tmp_path / "track.toml"
    tuned.write_text(TUNED.replace("building:102", "building:1"))
    file.write_text(TRACK.replace("thesis/chain", "best/chain"))
    monkeypatch.setattr(chosen_on, "RECORDS", tuned)
    assert with_seeds(load(file), "training")[0].scenario.seeds == (1,)


def test_dials_make_no_other_world() -> None:
    with pytest.raises(ScenarioError, match="annex"):
        refuse_chosen_on(["best/chain"], ["annex,width=2"])
    refuse_chosen_on(["best/chain", "mine:Localiser"], ["hallway"])
