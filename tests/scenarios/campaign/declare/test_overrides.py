from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import find, load
from refseq_bench.scenarios.campaign.declare.overrides import judged_instead, with_methods, with_renderer, with_seeds
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.rendering.renderer import RendererKind

FILE = """
title = "T"
seeds = [1]
expect = ["success >= 80 %", "success_hmm >= 70 %", "failures <= failures of vlad"]
[reference]
world = "annex"
renderer = "none"
[query]
light = "18:00"
[localise]
methods = ["thesis", "vlad"]
"""


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Case]:
    path = tmp_path_factory.mktemp("scenario") / "mine.toml"
    path.write_text(FILE)
    return load(path)


THESIS = ("thesis/uniform", "thesis/prior", "thesis/chain")


def texts(case: Case) -> list[str]:
    return [one.text for one in case.expectations]


def test_without_a_wish_nothing_changes(cases: list[Case]) -> None:
    assert with_methods(cases, (), None) == cases


def test_a_localiser_is_judged_beside_all_that_ran_before(cases: list[Case]) -> None:
    (case,) = with_methods(cases, ["topometric"], None)
    assert case.scenario.methods == (*THESIS, "vlad", "topometric")
    assert case.scenario.judged == "topometric"
    assert texts(case) == texts(cases[0])
    assert [one.methods for one in case.expectations] == [(), ("thesis/chain",), ("vlad",)]


def test_a_localiser_may_be_compared_with_who_is_judged_by_the_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(FILE.replace('"vlad"]\n', '"vlad"]\njudged = "vlad"\n'))
    with pytest.raises(ScenarioError, match="compares failures with itself, as vlad is judged"):
        find([str(file)])
    (case,) = with_methods(find([str(file)], rejudged=True), ["topometric"], None)
    assert case.scenario.judged == "topometric"
    assert texts(case)[-1] == "failures <= failures of vlad"


def test_several_are_judged_each(cases: list[Case]) -> None:
    (case,) = with_methods(cases, ["topometric", "topological", "topometric"], None)
    assert case.scenario.judged == "topometric"
    assert texts(case) == [
        "success of topometric >= 80 %",
        "success_hmm >= 70 %",
        "failures of topometric <= failures of vlad",
        "success of topological >= 80 %",
        "failures of topological <= failures of vlad",
    ]


def test_of_all_others_only_those_run_that_were_named(cases: list[Case]) -> None:
    (case,) = with_methods(cases, ["topometric"], ["none"])
    assert case.scenario.methods == ("topometric",)
    (case,) = with_methods(cases, ["topometric"], ["best", "vlad"])
    assert case.scenario.methods == ("best/uniform", "best/prior", "best/chain", "vlad", "topometric")


def test_who_was_judged_is_named_where_others_run(cases: list[Case]) -> None:
    (case,) = with_methods(cases, (), ["vlad"])
    assert case.scenario.methods == ("vlad",)
    assert [one.methods for one in case.expectations] == [
        ("thesis/chain",),
        ("thesis/chain",),
        ("thesis/chain", "vlad"),
    ]
    assert case.scenario.judged == "vlad"
    told = "thesis/chain, which is judged in 1 case, does not run; vlad is judged there"
    assert list(judged_instead(cases, [case])) == [told]


def test_who_was_judged_stays_so_where_it_runs(tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(FILE + 'judged = "best/chain"\n')
    (declared,) = load(path)
    (case,) = with_methods([declared], (), ["vlad", "best/chain"])
    assert (case.scenario.judged, case.scenario.methods) == ("best/chain", ("vlad", "best/chain"))
    assert case.expectations == declared.expectations
    assert not list(judged_instead([declared], [case]))


@pytest.mark.parametrize(
    ("localisers", "methods", "told"),
    [
        (["no.where:Mine"], None, "localiser 'no.where:Mine': there is no module 'no.where'"),
        (["magic"], None, "method 'magic' is unknown"),
        ([], ["vlad", "magic"], "method 'magic' is unknown"),
        ([], ["none"], "methods 'none': nobody is left to be asked"),
    ],
)
def test_a_wrong_name_is_told(cases: list[Case], localisers: list[str], methods: list[str] | None, told: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        with_methods(cases, localisers, methods)
    assert str(caught.value).startswith(told)


def test_other_seeds_are_taken_in_the_order_they_are_named(cases: list[Case]) -> None:
    (case,) = with_seeds(cases, "7, 0,012")
    assert case.scenario.seeds == (7, 0, 12)
    assert (case.name, case.expectations) == (cases[0].name, cases[0].expectations)
    assert with_seeds(cases, None) == cases


@pytest.mark.parametrize("seeds", ["", "1,", "1,01", "-1", "1.5", "٣", "²", "1;2"])
def test_what_are_no_seeds_is_told(cases: list[Case], seeds: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        with_seeds(cases, seeds)
    assert str(caught.value).startswith(f"--seeds {seeds!r} is not valid; it should be whole numbers that differ")


def test_another_renderer_draws_wherever_cameras_take_pictures(tmp_path: Path) -> None:
    path = tmp_path / "mixed.toml"
    path.write_text(
        """
title = "T"
[reference]
world = "annex"
[[further]]
world = "annex"
renderer = "none"
[query]
light = "18:00"
[localise]
sensors = ["laser"]
methods = ["thesis"]
"""
    )
    cases = load(path)
    (case,) = with_renderer(cases, RendererKind.BAKED)
    assert [source.renderer for source in case.sources(1)] == [
        RendererKind.BAKED,
        RendererKind.NONE,
        RendererKind.BAKED,
    ]
    assert with_renderer(cases, None) == cases


def test_recordings_of_others_are_drawn_by_nobody(tmp_path: Path) -> None:
    path = tmp_path / "real.toml"
    path.write_text(
        'title = "T"\n[reference]\nlog = "a.log"\n[query]\nlog = "b.log"\n[localise]\nmethods = ["thesis"]\n'
    )
    assert with_renderer(load(path), RendererKind.BAKED) == load(path)
    assert [one.scenario.seeds for one in with_seeds(load(path), "7")] == [(7,)]
    with pytest.raises(ScenarioError, match=r"^real: seeds: \[1, 2\]: nothing is drawn .*; valid is one seed, such as"):
        with_seeds(load(path), "1,2")


APART = """
title = "Seeds apart"
seeds = [101, 102]
training_seeds = [1, 2]
[reference]
world = "corridor:SEED,width=2"
renderer = "none"
"""


def test_training_seeds_never_judge_and_are_run_by_their_name_alone(tmp_path: Path) -> None:
    file = tmp_path / "apart.toml"
    file.write_text(APART)
    cases = load(file)
    assert [one.scenario.seeds for one in with_seeds(cases, "training")] == [(1, 2)]
    assert [one.scenario.seeds for one in with_seeds(cases, "103")] == [(103,)]
    with pytest.raises(ScenarioError, match=r"--seeds 2,103: apart has \[2\] for training, .* or 'training'"):
        with_seeds(cases, "2,103")
    file.write_text(APART.replace("102]", "2]"))
    with pytest.raises(ScenarioError, match=r"seeds: \[2\] are among training_seeds \[1, 2\]; valid are others"):
        load(file)
    file.write_text(APART.replace("training_seeds = [1, 2]", ""))
    with pytest.raises(ScenarioError, match="apart has no training_seeds"):
        with_seeds(load(file), "training")


def test_each_seed_has_a_world_of_its_own_and_both_drives_are_in_it(tmp_path: Path) -> None:
    file = tmp_path / "apart.toml"
    file.write_text(APART)
    (one,) = load(file)
    assert [source.world for source in one.sources(102)] == ["corridor:102,width=2"] * 2  # type: ignore[union-attr]
