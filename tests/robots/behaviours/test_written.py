"""Behaviours as text: what is read, and what is told of mistakes."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench import robots
from refseq_bench.robots import RobotsError
from refseq_bench.robots.behaviours import RobotDescription
from refseq_bench.robots.behaviours.carry_on import CarryOn
from refseq_bench.robots.behaviours.cross_door import CrossDoor
from refseq_bench.robots.behaviours.follow_wall import FollowWall, closest
from refseq_bench.robots.behaviours.halt import Halt
from refseq_bench.robots.behaviours.sensing.wall import WallSide
from refseq_bench.robots.behaviours.set_point import SetPoint
from refseq_bench.robots.behaviours.turn import Turn
from refseq_bench.robots.behaviours.written import KINDS, make_behaviour, parse_behaviour
from tests.robots.behaviours.mounted import ON_THE_ROBUTER

ROBOT = robots.load("robuter")
FRAME = RobotDescription(ROBOT.shape, ROBOT.limits, ON_THE_ROBUTER)


@pytest.mark.parametrize(
    ("text", "values", "kind"),
    [
        ("MA:3,0", (3.0, 0.0), SetPoint),
        ("MA: 3, -0.5, 90", (3.0, -0.5, math.pi / 2), SetPoint),
        ("MT:90", (math.pi / 2,), Turn),
        ("MT:-180", (-math.pi,), Turn),
        ("MT:270", (1.5 * math.pi,), Turn),
        ("MW:left,0.6", (WallSide.LEFT, 0.6), FollowWall),
        ("MW:right,0.5,12", (WallSide.RIGHT, 0.5, 12.0), FollowWall),
        ("MC", (), CrossDoor),
        ("MN:2.5", (2.5,), CarryOn),
        ("MN:2.5,0.9", (2.5, 0.9), CarryOn),
        ("MN:2.5,0,1.2", (2.5, 0.0, 1.2), CarryOn),
        ("stop", (), Halt),
    ],
)
def test_a_behaviour_is_read_as_it_is_written(text: str, values: tuple[object, ...], kind: type) -> None:
    choice = parse_behaviour(text)
    assert choice.values == pytest.approx(values) if all(isinstance(v, float) for v in values) else values
    assert isinstance(make_behaviour(choice, FRAME, lambda scan: ()), kind)


FORMS = (
    "MA:x,y[,heading], MT:angle[,radius], MO[:bearing], MW:side,distance[,length], MC[:side], "
    "MN:length[,left][,right][,aside][,turn], stop"
)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", f"unknown behaviour '': valid are {FORMS}"),
        ("ma:1,2", f"unknown behaviour 'ma': valid are {FORMS}"),
        ("MA", "behaviour 'MA': 0 values: valid is MA:x,y[,heading], such as MA:3,0,90"),
        ("MA:1", "behaviour 'MA:1': 1 values: valid is MA:x,y[,heading], such as MA:3,0,90"),
        ("MA:1,2,3,4", "behaviour 'MA:1,2,3,4': 4 values: valid is MA:x,y[,heading], such as MA:3,0,90"),
        ("MA:1,b", "behaviour 'MA:1,b': y 'b': valid is a number from -1000 to 1000 m"),
        ("MA:1_5,0", "behaviour 'MA:1_5,0': x '1_5': valid is a number from -1000 to 1000 m"),
        ("MA:nan,0", "behaviour 'MA:nan,0': x 'nan': valid is a number from -1000 to 1000 m"),
        ("MA:inf,0", "behaviour 'MA:inf,0': x 'inf': valid is a number from -1000 to 1000 m"),
        ("MT:0", "behaviour 'MT:0': angle '0': valid is a number from -360 to 360 degrees, but not 0"),
        ("MT:361", "behaviour 'MT:361': angle '361': valid is a number from -360 to 360 degrees, but not 0"),
        ("MW:up,1", "behaviour 'MW:up,1': side 'up': valid are left, right"),
        ("MW:left,9", "behaviour 'MW:left,9': distance '9': valid is a number from 0.1 to 2.5 m"),
        ("MW:left,1,-2", "behaviour 'MW:left,1,-2': length '-2': valid is a number from 0.01 to 1000 m"),
        ("MN:", "behaviour 'MN:': length '': valid is a number from 0.01 to 1000 m"),
        ("MN:1,0,0,3", "behaviour 'MN:1,0,0,3': aside '3': valid is a number from -2.5 to 2.5 m"),
        ("MN:1,0,0,0,91", "behaviour 'MN:1,0,0,0,91': turn '91': valid is a number from -90 to 90 degrees"),
        ("stop:1", "behaviour 'stop:1': 1 values: valid is stop, such as stop"),
    ],
)
def test_a_mistake_is_told_in_one_line_with_what_is_valid(text: str, told: str) -> None:
    with pytest.raises(RobotsError) as caught:
        parse_behaviour(text)
    assert str(caught.value) == told


def test_what_one_robot_cannot_do_is_told_when_it_is_made() -> None:
    choice = parse_behaviour("MW:left,0.4")
    with pytest.raises(RobotsError, match=r"^behaviour 'MW:left,0\.4': distance 0\.4 m to a wall: valid is 0\.455 m"):
        make_behaviour(choice, FRAME)
    assert closest(FRAME) == pytest.approx(0.455)
    with pytest.raises(RobotsError, match=r"^behaviour 'MC': .* finds doors"):
        make_behaviour(parse_behaviour("MC"), FRAME)


@given(st.text(max_size=20) | st.builds("{}:{}".format, st.sampled_from([k.code for k in KINDS]), st.text(max_size=12)))
def test_any_text_is_read_or_refused_by_the_rooms_own_error(text: str) -> None:
    choice = None
    with contextlib.suppress(RobotsError):
        choice = parse_behaviour(text)
    if choice is not None:
        needed = sum(not argument.optional for argument in choice.kind.arguments)
        assert needed <= len(choice.values) <= len(choice.kind.arguments)
        assert choice.text == text


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.code)
def test_every_kind_has_an_example_that_is_read_and_a_meaning_for_each_argument(kind: object) -> None:
    assert parse_behaviour(kind.example).kind is kind
    assert kind.title
    assert all(argument.meaning and argument.name in kind.form for argument in kind.arguments)
