"""The mission string: what is read is what is printed, and what is wrong is told with its column."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.missions import ADMITTED, Action, BehaviourCode, Label, Landmark, Mission, MissionError, Step, parse_mission
from refseq.missions.language import NUMBERED, TURNS


@st.composite
def steps(draw: st.DrawFn) -> Step:
    label = draw(st.sampled_from(Label))
    landmark = Landmark(label, draw(st.integers(0, 999_999)) if label in NUMBERED else None)
    behaviour = draw(st.none() | st.sampled_from(ADMITTED[label]))
    if behaviour is None:
        return Step(landmark)
    return Step(landmark, Action(behaviour, draw(st.sampled_from(TURNS)) if behaviour is BehaviourCode.TURN else None))


missions = st.lists(steps(), min_size=1, max_size=8).map(lambda found: Mission(tuple(found)))


def test_the_missions_of_the_thesis() -> None:
    door = Step(Landmark(Label.DOOR))
    assert parse_mission("[LD_LA3]") == Mission((door, Step(Landmark(Label.PLACE, 3))))
    through = Step(Landmark(Label.DOOR), Action(BehaviourCode.CROSS_DOOR))
    assert parse_mission("[LD_LDMC]") == Mission((door, through))


@given(missions)
def test_what_is_printed_is_read_again(mission: Mission) -> None:
    assert parse_mission(str(mission)) == mission
    assert parse_mission(f"  {str(mission).replace('_', ' _ ')} ") == mission


@given(st.text(alphabet="[]_LDIOAMNTCW0189 x", max_size=14) | st.text(max_size=10))
def test_any_text_is_a_mission_or_told_with_its_column(text: str) -> None:
    told = _told(text)
    if told is None:
        assert parse_mission(str(parse_mission(text))) == parse_mission(text)
        return
    column = re.search(r"column (\d+): .*valid", told)
    assert column is not None
    assert 1 <= int(column[1]) <= len(text) + 1
    assert "\n" not in told


def _told(text: str) -> str | None:
    """What is wrong with a mission, None for a right one."""
    try:
        parse_mission(text)
    except MissionError as error:
        return str(error)
    return None


@given(missions, st.data())
def test_a_character_too_many_is_told_where_it_stands(mission: Mission, data: st.DataObject) -> None:
    """Or a character earlier, where it is in the middle of a word."""
    text = str(mission)
    at = data.draw(st.integers(0, len(text)))
    with pytest.raises(MissionError) as caught:
        parse_mission(f"{text[:at]}?{text[at:]}")
    column = re.search(r"column (\d+)", str(caught.value))
    assert column is not None
    digits = len(re.search(r"[0-9]*$", text[:at])[0])  # an angle that is cut off is told at its beginning
    assert at - max(1, digits) + 1 <= int(column[1]) <= at + 1


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "column 1: the mission ends; valid is '[', with which a mission begins"),
        ("LD", "column 1: 'LD'; valid is '[', with which a mission begins"),
        ("[]", "column 2: ']'; valid is a landmark: LD, LI, LO, LA"),
        ("[LD", "column 4: the mission ends; valid is a behaviour, '_' and another step, or ']'"),
        ("[LDMC", "column 6: the mission ends; valid is '_' and another step, or ']'"),
        ("[LD4]", "column 4: LD has number 4; valid is none: it is the next one"),
        ("[LA]", "column 4: LA has no number; valid is to say which: LA0"),
        ("[LDMT]", "column 6: MT has no angle; valid are 90, 180, 270"),
        ("[LDMT45]", "column 6: MT by 45 degrees; valid are 90, 180, 270"),
        ("[LDMC2]", "column 6: MC has number 2; valid is none"),
        ("[LDMX]", "column 4: 'MX]'; valid is a behaviour: MA, MT, MO, MW, MC, MN"),
        ("[LDMW]", "column 4: MW is not done at LD; valid are MN, MA, MT, MO, MC"),
        ("[LI1MC]", "column 5: MC is not done at LI; valid are MN, MA, MT, MO"),
        ("[LD]]", "column 5: ']' behind the mission; valid is nothing"),
        ("[LD_]", "column 5: ']'; valid is a landmark: LD, LI, LO, LA"),
    ],
)
def test_what_is_wrong_is_told(text: str, told: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse_mission(text)
    assert str(caught.value) == f"mission {text!r}, {told}"
