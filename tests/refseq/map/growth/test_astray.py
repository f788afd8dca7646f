"""Stretches of a drive that lead off a map, against a walk along it view by view."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq import MapError
from refseq.map.growth.astray import AstraySettings, astray
from refseq.view import View

RULES = AstraySettings(overlap=2.0, least=3.0)


def drive(count: int) -> list[View]:
    """A view a metre; a robot that reversed goes on all the same."""
    return [View(float(n), {}, None, float((-1) ** n) if n else 0.0) for n in range(count)]


def found(lost: str, rules: AstraySettings = RULES) -> list[tuple[range, float, range]]:
    """Stretches of a drive that is lost where there is an L."""
    probabilities = np.array([0.9 if sign == "L" else 0.1 for sign in lost])
    return [(one.views, one.metres, one.path) for one in astray(drive(len(lost)), probabilities, rules)]


def test_a_path_takes_in_what_is_before_and_behind_as_far_as_the_drive_goes() -> None:
    assert found("....LLLLL....") == [(range(4, 9), 4.0, range(2, 11))]
    assert found("LLLLL") == [(range(0, 5), 4.0, range(0, 5))]


def test_stretches_whose_overlaps_would_meet_are_one_path_and_count_what_is_off_the_map_alone() -> None:
    assert found("..LLLL...LLLL..") == [(range(2, 13), 6.0, range(0, 15))]
    assert len(found("..LLLL....LLLL..")) == 2


def test_what_is_short_is_no_path_however_often_it_comes() -> None:
    assert found("..LLL...") == []
    assert found("..L..L..L..L..L..") == []
    assert found(".....") == []


@given(st.text("L.", min_size=1, max_size=40))
def test_each_view_off_the_map_is_in_one_path_unless_its_stretch_is_short(lost: str) -> None:
    paths = found(lost, replace(RULES, least=0.0))
    inside = [n for _, _, path in paths for n in path]
    assert len(set(inside)) == len(inside), "paths share no view"
    assert {n for n, sign in enumerate(lost) if sign == "L"} <= set(inside)
    steps = sum(pair == ("L", "L") for pair in pairwise(lost))
    assert sum(metres for _, metres, _ in paths) == steps


@pytest.mark.parametrize(("name", "value"), [("lost", 1.1), ("overlap", -1.0), ("least", np.nan), ("overlap", np.inf)])
def test_rules_that_are_none_are_told(name: str, value: float) -> None:
    with pytest.raises(MapError, match=f"{name} is {value}"):
        replace(RULES, **{name: value})
