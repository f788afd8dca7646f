"""Curves over the one key that a scenario varies: of texts that differ in a number, of several scenarios at once."""

from pathlib import Path

import numpy as np
import pytest

from refseq_bench.scenarios.campaign.pages.sweep_plot import sweeps_of, swept
from refseq_bench.scenarios.campaign.store.result_file import CaseRecord, write_result
from tests.scenarios.campaign.pages.test_text_report import campaign, dial_cases, method
from tests.scenarios.conftest import Refseq


def renamed(cases: list[CaseRecord], scenario: str) -> list[CaseRecord]:
    return [
        one.model_copy(update={"name": f"{scenario}/{i}", "scenario": scenario, "title": f"Dial: {scenario}"})
        for i, one in enumerate(cases)
    ]


def test_texts_that_differ_in_one_number_stand_at_it() -> None:
    found = swept(dial_cases([f"building:SEED,texture={v},glass=0.5" for v in ("1", "0", "0.25")], "reference.world"))
    assert found is not None
    assert (found.key, found.values, found.at) == ("texture", ("0", "0.25", "1"), (0.0, 0.25, 1.0))
    # The cases went with their values: the first had 9 of 10 right, the second 8, the third 7.
    assert found.of(["a"]).shares["a"][:, 0] == pytest.approx([0.8, 0.7, 0.9])


def test_keys_that_have_the_same_number_in_each_text_are_one_dial() -> None:
    found = swept(dial_cases(["people=0,walkers=0", "people=0.5,walkers=0.5"], "query.change"))
    assert found is not None
    assert (found.key, found.at) == ("people, walkers", (0.0, 0.5))


@pytest.mark.parametrize(
    "values",
    [
        ["none", "doors=1"],
        ["doors=0,bins=1", "doors=1,bins=0"],
        ["annex", "hallway"],
        ["building:1,width=2", "building:2,width=2"],
        ["width=2", "width=2.0"],
    ],
)
def test_other_texts_stand_side_by_side_as_they_are(values: list[object]) -> None:
    found = swept(dial_cases(values, "reference.world"))
    assert found is not None
    assert (found.key, found.values, found.at) == ("reference.world", tuple(map(str, values)), None)


def test_of_a_case_that_ran_twice_the_later_counts() -> None:
    first = renamed(dial_cases([1, 2]), "x")
    again = first[1].model_copy(update={"methods": (method("a", 2),)})
    (one,) = sweeps_of([campaign(*first), campaign(again)], ["a"])
    assert one.shares["a"][:, 0] == pytest.approx([0.9, 0.2])
    (one,) = sweeps_of([campaign(*first)], ())
    assert list(one.shares) == ["a", "b"]


def test_curves_are_one_picture_with_a_panel_for_each_scenario(tmp_path: Path, refseq: Refseq) -> None:
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        write_result(tmp_path / name, campaign(*renamed(dial_cases([0.0, 0.5]), name)))
    picture = tmp_path / "curves.svg"
    answer = refseq("scenario", "curves", tmp_path / "one", tmp_path / "other", "-o", picture, "--methods", "b")
    assert (answer.code, answer.out) == (0, f"{picture}: 2 curves\n")
    text = picture.read_text()
    assert all(text.count(f">Dial: {name}<") == 1 for name in ("one", "other"))
    assert text.count('fill="currentColor">b<') == 1, "the legend names a method once"
    assert 'fill="currentColor">a<' not in text


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (["--methods", "c"], "method 'c' has no answers there; valid are a, b"),
        (["--methods", "a,"], "--methods 'a,': a name is empty"),
        (["-o", "curves.png"], "curves.png: is no name of a picture; valid is one that ends in .svg"),
    ],
)
def test_what_no_curve_can_be_drawn_of_is_told_in_a_line(
    options: list[str], error: str, tmp_path: Path, refseq: Refseq
) -> None:
    write_result(tmp_path, campaign(*renamed(dial_cases([0.0, 0.5]), "one")))
    answer = refseq(
        "scenario", "curves", tmp_path, *(["-o", tmp_path / "c.svg"] if "-o" not in options else []), *options
    )
    assert answer.code == 2
    assert error in answer.err
    assert answer.err.count("\n") == 1
    assert not (tmp_path / "c.svg").exists()


def test_a_campaign_without_a_curve_says_which_have_one(tmp_path: Path, refseq: Refseq) -> None:
    write_result(tmp_path, campaign(*dial_cases([1])))
    answer = refseq("scenario", "curves", tmp_path, "-o", tmp_path / "c.svg")
    assert answer.code == 2
    assert "no scenario varies one key over two cases that were answered" in answer.err
    assert np.all([path.suffix != ".svg" for path in tmp_path.iterdir()])
