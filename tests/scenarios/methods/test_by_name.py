from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Belief, Stage
from refseq.errors import MapError
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.view import LASER, View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.by_name import answers, run
from refseq_bench.scenarios.methods.checks import methods_named
from refseq_bench.scenarios.methods.names import METHODS, family, written_out
from refseq_bench.scenarios.methods.reference import Reference
from tests.support import certain, corridor_drive


@pytest.fixture(scope="module")
def drives() -> tuple[list[View], list[View]]:
    rng = np.random.default_rng(0)
    return corridor_drive(rng, 8, size=48), corridor_drive(rng, 8, brightness=0.7, size=48)


def probabilities(beliefs: list[Belief]) -> list[list[float]]:
    """P(lost) and the probability of each place, without the paths: hindsight's are others."""
    return [[belief.lost, *belief.places.tolist()] for belief in beliefs]


def test_methods_go_by_their_names_each_once() -> None:
    assert methods_named(None) == METHODS
    assert methods_named(["vlad", "thesis/chain", "vlad"]) == ("vlad", "thesis/chain")
    with pytest.raises(
        ScenarioError,
        match=r"^method 'chain' is unknown; valid are thesis/uniform, .*, package.module:Class, ./program$",
    ):
        methods_named(["vlad", "chain"])


def test_where_the_laser_is_alone_the_baselines_are_those_that_answer_to_it(
    drives: tuple[list[View], list[View]],
) -> None:
    blind = [[replace(view, images={}) for view in drive] for drive in drives]
    for name in BASELINES:
        if name in written_out(["baselines"], [LASER]):
            assert len(answers([name], *blind)[name]) == len(blind[1])
        else:
            with pytest.raises(ScenarioError, match=rf"^{name}: .*valid is a drive with images$"):
                answers([name], *blind)
    assert written_out(["baselines"], [LASER, "camera-1"]) == written_out(["baselines"]) == tuple(BASELINES)
    assert written_out(["vlad"], [LASER]) == ("vlad",)  # who names one is told by it


@pytest.mark.slow
def test_answers_are_those_of_each_method_alone(drives: tuple[list[View], list[View]]) -> None:
    reference, query = drives
    wanted = ("topometric", "thesis/chain", "vlad", "thesis/uniform")
    found = answers(wanted, reference, query, seed=3)
    assert tuple(found) == wanted
    sequence = learn(reference, profile="thesis")
    for stage in (Stage.UNIFORM, Stage.CHAIN):
        assert found[f"thesis/{stage}"] == localise(sequence, query, stages=(stage,), seed=3)[stage]
    for name in ("vlad", "topometric"):
        localiser = BASELINES[name](Reference(reference))
        assert found[name] == [localiser.update(view) for view in query]


def test_a_profile_with_other_settings_is_a_method_of_its_own(drives: tuple[list[View], list[View]]) -> None:
    reference, query = drives
    changed = "thesis+chain.window=2"
    assert methods_named([changed]) == tuple(f"{changed}/{stage}" for stage in Stage)
    assert family(f"{changed}/chain") == family(f"{changed}/prior") == changed
    found = answers(("thesis/chain", f"{changed}/chain"), reference, query, seed=3)
    map_ = learn(reference, profile=changed)
    assert map_.profile.chain.window == 2
    assert found[f"{changed}/chain"] == localise(map_, query, stages=(Stage.CHAIN,), seed=3)[Stage.CHAIN]
    assert probabilities(found[f"{changed}/chain"]) != probabilities(found["thesis/chain"])
    with pytest.raises(MapError, match=r"^profile\.chain\.window is 0; valid is "):
        methods_named(["thesis+chain.window=0/chain"])


def test_hindsight_is_asked_for_by_its_name_only_and_knows_what_came_after(
    drives: tuple[list[View], list[View]],
) -> None:
    reference, query = drives
    # Hindsight asks neither for last fixes nor whether it was carried.
    after, before = (f"best+log_ratio.fixes=0+chain.carried=0/{stage}" for stage in ("hindsight", "chain"))
    assert not any("hindsight" in name for name in methods_named(["thesis", "best", "baselines"]))
    found = answers((after, before), reference, query)
    assert tuple(found) == (after, before)
    known, online = (probabilities(found[name]) for name in (after, before))
    assert known[-1] == online[-1], "after the last view there is nothing to know"
    assert known[:-1] != online[:-1]
    cut = answers((after, before), reference, query[:4])
    assert cut[before] == found[before][:4]
    assert probabilities(cut[after]) != known[:4]


class Counting:
    """Anybody's localiser: it answers how many views it has seen."""

    def __init__(self) -> None:
        self.seen = 7

    def reset(self) -> None:
        self.seen = 0

    def update(self, view: View) -> Belief:
        self.seen += 1
        return certain(9, self.seen)


def test_a_localiser_of_ones_own_is_reset_and_asked_in_order(drives: tuple[list[View], list[View]]) -> None:
    found = run({"mine": Counting(), "yours": Counting()}, drives[1])
    assert {name: [belief.best for belief in beliefs] for name, beliefs in found.items()} == {
        "mine": list(range(1, 9)),
        "yours": list(range(1, 9)),
    }
