from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.search.dials import NAMES, at_point, dials_of, selected_dials
from refseq_bench.scenarios.errors import ScenarioError

FILE = """
title = "Dials"
seeds = [1]
[reference]
world = "{world}"
renderer = "{renderer}"
end = 20.0
{more}
[query]
light = "18:00,cloud=0.5"
change = "people=0.2"
"""


def case_in(folder: Path, world: str = "building:3,texture=0.1", renderer: str = "baked", more: str = "") -> Case:
    path = folder / "dials.toml"
    path.write_text(FILE.format(world=world, renderer=renderer, more=more))
    return load(path)[0]


def test_all_dials_of_a_generated_world_that_cameras_see(tmp_path: Path) -> None:
    dials = dials_of(case_in(tmp_path))
    assert tuple(dials) == NAMES
    easy = {name: dial.easy for name, dial in dials.items()}
    assert easy["hour"] == 18.0
    assert (easy["cloud"], easy["people"], easy["texture"], easy["width"]) == (0.5, 0.2, 0.1, None)


@pytest.mark.parametrize(
    ("world", "renderer", "without"),
    [
        ("building:3", "none", {"hour", "cloud"}),
        ("annex", "baked", {"texture", "repetition", "glass", "width"}),
    ],
)
def test_no_dial_is_offered_that_turns_nothing(
    world: str, renderer: str, without: set[str], tmp_path: Path
) -> None:  # fmt: skip
    assert set(NAMES) - set(dials_of(case_in(tmp_path, world, renderer))) == without


def test_turned_dials_are_what_is_driven(tmp_path: Path) -> None:
    case = case_in(tmp_path)
    point = {"hour": 21.25, "width": 2.5, "people": 0.7, "style": "weaving", "spread": "as-built", "start": 4.0}
    turned = at_point(case, dials_of(case), point)
    reference, query = turned.sources(1)
    assert reference.world == query.world == "building:3,texture=0.1,width=2.5"  # type: ignore[union-attr]
    assert (reference.light, query.light) == ("16:00", "21:15,cloud=0.5")  # type: ignore[union-attr]
    assert (reference.change, query.change) == ("none", "people=0.7")  # type: ignore[union-attr]
    assert (reference.robot_spread, query.robot_spread) == ("as-built", "as-built")  # type: ignore[union-attr]
    assert (reference.start, query.start) == (0.0, 4.0)  # type: ignore[union-attr]
    assert query.style.wander > reference.style.wander  # type: ignore[union-attr]


def test_every_value_of_every_dial_is_a_scenario(tmp_path: Path) -> None:
    """The ends of all ranges at least, as the rooms check them."""
    case = case_in(tmp_path)
    dials = dials_of(case)
    for name, dial in dials.items():
        for value in (dial.values[0], dial.values[-1]):
            table = at_point(case, dials, {name: value}).scenario.model_dump(mode="json")
            assert type(case.scenario).model_validate(table)


@pytest.mark.parametrize(
    ("wanted", "line"),
    [
        ("weather", "--dial 'weather': 'weather' is no dial; valid are hour, cloud"),
        ("width=1:2", "--dial width=1:2 is not valid; it should be FROM:TO, rising, from 1.8 to 4"),
        ("width=3:2", "--dial width=3:2 is not valid"),
        ("hour=late", "--dial hour=late is not valid"),
        ("style=1:2", "--dial 'style=1:2': style has no range; valid is style, for careful, weaving"),
    ],
)
def test_bad_dial_is_one_line(wanted: str, line: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        selected_dials(case_in(tmp_path), [wanted])
    assert str(error.value).startswith(line)


def test_dial_that_is_named_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"^--dial 'width=2:3': width is named twice; valid is once$"):
        selected_dials(case_in(tmp_path), ["width", "width=2:3"])


def test_dial_that_the_world_has_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="'texture': dials has no such dial; valid are hour"):
        selected_dials(case_in(tmp_path, "annex"), ["texture"])


def test_range_is_narrowed(tmp_path: Path) -> None:
    (dial,) = selected_dials(case_in(tmp_path), ["width=2:2.3"]).values()
    assert list(dial.values) == [2.0, 2.1, 2.2, 2.3]
