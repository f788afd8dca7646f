"""LAMP programs: the thesis' eleven lines, what is printed is read, and what is wrong is told with line and column."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.missions.lamp import LampWord, Verb, parse_lamp, print_lamp
from refseq.missions.language import MissionError

ELEVEN = """\
1. MOVP MV 20 PS 2 USL 500 SEN 1
2. MOVE LV 0 AV 10 ANL 90
3. MOVP MV 20 USL 1000 SEN 1
4. MOVE LV 0 AV 10 ANL 90
5. MOVE LV 20 DIL 1500
6. CROSS
7. MOVE LV 10 USL 300 SEN 1
8. MOVE AV 20 ANL 90
9. MOVP MV 20 PS 2 USL 500 SEN 1
10. MOVE AV 20 ANL 90
11. MOVP MV 20 PS 1 USL 300 SEN 1
"""
"""Fig. 1.6, without the scanner's blanks in numbers."""


def test_the_program_of_the_thesis_is_read_and_printed() -> None:
    stages = parse_lamp(ELEVEN)
    assert [stage.verb for stage in stages].count(Verb.BESIDE) == 4
    assert stages[4].numbers == {LampWord.SPEED: 20, LampWord.DISTANCE: 1500}
    assert stages[5].numbers == {}
    assert print_lamp(stages) == ELEVEN


def test_numbers_of_lines_and_empty_ones_do_not_count() -> None:
    assert parse_lamp("\n  CROSS\n\n7.MOVE AV 20 ANL 90\n") == parse_lamp("CROSS\nMOVE AV 20 ANL 90")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "holds no line; valid is one stage a line: MOVE, MOVP or CROSS"),
        ("3.", "line 1, column 3: no verb; valid are MOVP, MOVE, CROSS"),
        ("CROSS\nRUN", "line 2, column 1: 'RUN' is no verb; valid are MOVP, MOVE, CROSS"),
        ("CROSS LV 3", "line 1, column 7: 'LV' behind CROSS; valid is nothing"),
        ("MOVE MV 3", "line 1, column 6: 'MV' behind MOVE; valid is LV, AV, ANL, DIL, USL, SEN"),
        ("MOVE LV 3 LV 4 DIL 3", "line 1, column 11: LV is there twice; valid is once"),
        ("MOVE LV 2 0 DIL 3", "line 1, column 11: '0' behind MOVE; valid is LV, AV, ANL, DIL, USL, SEN"),
        ("MOVE LV fast", "line 1, column 9: LV has 'fast'; valid is -1000 to 1000 (mm/s)"),
        ("MOVE DIL", "line 1, column 9: DIL has nothing; valid is 1 to 100000 (mm)"),
        ("MOVP MV 20 PS 3", "line 1, column 15: PS has '3'; valid is 1 to 2 (1 left, 2 right)"),
        ("MOVE LV 20", "line 1, column 11: MOVE without one end; valid is one of ANL, DIL and USL"),
        ("MOVE LV 20 DIL 3 ANL 4", "line 1, column 23: MOVE without one end; valid is one of ANL, DIL and USL"),
        ("MOVE LV 20 USL 3", "line 1, column 17: MOVE without its other half; valid are USL and SEN together"),
        ("MOVE ANL 90", "line 1, column 12: MOVE without AV; valid is how fast it turns to ANL"),
        ("MOVE LV 0 DIL 90", "line 1, column 17: MOVE without LV; valid is how fast it goes, not 0"),
        ("MOVP MV 20 SEN 1", "line 1, column 17: MOVP without USL; valid is MV, USL and SEN"),
    ],
)
def test_what_is_wrong_is_told(text: str, told: str) -> None:
    with pytest.raises(MissionError) as caught:
        parse_lamp(text)
    assert str(caught.value).removeprefix("LAMP program").lstrip(",: ") == told


lines = st.lists(
    st.sampled_from([*Verb, *LampWord, "1", "2", "20", "90", "-5", "x", "3.", "1e9", "٣"]), max_size=8
).map(" ".join)


@given(st.lists(lines, max_size=4).map("\n".join) | st.text(max_size=20))
def test_any_text_is_a_program_or_told_where_it_goes_wrong(text: str) -> None:
    try:
        stages = parse_lamp(text)
    except MissionError as error:
        told = str(error)
    else:
        assert parse_lamp(print_lamp(stages)) == stages
        return
    assert "\n" not in told
    assert re.search(r"valid (is|are) ", told)
    if where := re.search(r"line (\d+), column (\d+)", told):
        line = text.split("\n")[int(where[1]) - 1]
        assert 1 <= int(where[2]) <= len(line) + 1
