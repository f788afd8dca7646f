"""What a mission knows of behaviours' words agrees with what the robots' own reader says."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.missions.behaviour_codes import SHORTEST, code_of, kind_of, lengthened, steered, travels
from refseq_bench.robots.behaviours.written import KINDS, parse_behaviour

GO = ["MN:8", "MW:left,0.6", "MW:right,1.25,5", "MA:3,0", "MA:0.5,0.0"]
END = [
    "MA:3,0,0",
    "MA:3,1",
    "MA:-3,0",
    "MA:0,0",
    "MA:3,0,90",
    "MT:-180",
    "MT:90",
    "MC",
    "MC:left",
    "MO",
    "MO:90",
    "stop",
]
FROM_STRINGS = ["MN", "MA", "MW:right,1"]
"""As a mission string's behaviours are written, without a length."""
lengths = st.floats(0.0, 999.0)


@given(st.floats(-1.2, 1.2), st.floats(-20, 20), lengths)
def test_a_steered_leg_is_read_with_its_way_and_told_any_length(aside: float, turn: float, length: float) -> None:
    """Told by centimetres and tenths of a degree, of which half may be lost, and a little by the binary numbers."""
    there = steered("MN:8,1.25,0.9", aside, turn)
    told, left, right, *way = parse_behaviour(lengthened(there, length)).values
    assert (left, right) == (1.25, 0.9)
    assert told == pytest.approx(max(length, SHORTEST), abs=0.005001)
    assert way == [pytest.approx(aside, abs=0.005001), pytest.approx(math.radians(turn), abs=math.radians(0.050001))]


@pytest.mark.parametrize("words", [*GO, *END, "MN", "MN:8,1.2"])
def test_only_led_legs_are_steered(words: str) -> None:
    assert steered(words, 0.3, 5.0) == words


@pytest.mark.parametrize("words", GO)
def test_what_lasts_until_a_place_is_reached_travels(words: str) -> None:
    parse_behaviour(words)
    assert travels(words)


@pytest.mark.parametrize("words", END)
def test_what_ends_by_itself_does_not_travel(words: str) -> None:
    parse_behaviour(words)
    assert not travels(words)


def test_every_behaviour_of_the_robots_is_looked_at_here() -> None:
    assert {kind.code for kind in KINDS} == {code_of(words) for words in GO + END}


@pytest.mark.parametrize("words", GO + FROM_STRINGS)
@given(length=lengths)
def test_a_behaviour_is_told_how_far(words: str, length: float) -> None:
    """Robots read it, and it is the same one, of that length."""
    choice = parse_behaviour(lengthened(words, length))
    values = choice.values
    wanted = pytest.approx(max(length, SHORTEST), abs=0.0051)
    assert choice.kind.code == code_of(words)
    match choice.kind.code:
        case "MN":
            assert values == (wanted,)
        case "MA":
            assert values == (wanted, 0.0)
        case _:
            assert values[2] == wanted
            assert values[:2] == parse_behaviour(words).values[:2], "on the same side, as far from the wall"


@given(st.floats(0.01, 1000.0), st.floats(0.1, 2.5), st.sampled_from(["left", "right"]), lengths)
def test_walls_of_any_distance(recorded: float, distance: float, side: str, length: float) -> None:
    words = f"MW:{side},{distance},{recorded}"
    assert parse_behaviour(lengthened(words, length)).values[:2] == parse_behaviour(words).values[:2]
    assert travels(words)


@given(st.floats(-1000, 1000), st.floats(-1000, 1000))
def test_a_set_point_travels_when_it_is_straight_ahead(x: float, y: float) -> None:
    assert travels(f"MA:{x},{y}") == (x > 0 and y == 0)
    assert travels(f"MA:{x},0") == (x > 0)


@given(lengths)
def test_it_still_travels_when_it_is_told_how_far(length: float) -> None:
    for words in GO + FROM_STRINGS:
        assert travels(lengthened(words, length))


ALIKE = [
    {"MN", "MN:8", "MN:1000"},
    {"MA", "MA:3,0", "MA:0.5,0.0"},
    {"MA:3,0,90"},
    {"MW:right,1", "MW:right,1,7.5"},
    {"MW:left,1"},
    {"MT:90", "MT:-270"},
    {"MT:-90", "MT:270"},
    {"MC", "MC:ahead"},
    {"MC:left"},
    {"stop"},
]


def test_behaviours_are_of_one_kind_where_they_lead_the_same_way() -> None:
    kinds = [{kind_of(words) for words in alike} for alike in ALIKE]
    assert all(len(kind) == 1 for kind in kinds)
    assert len(set.union(*kinds)) == len(ALIKE)
