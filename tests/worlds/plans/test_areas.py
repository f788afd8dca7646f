import numpy as np
import pytest

from refseq_bench.worlds.plans.areas import enclosing, rectangles
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan
from tests.worlds.conftest import SMALL, corner


def area(plan: FloorPlan) -> float:
    return float(sum(np.prod(r.size) for r in rectangles(plan)))


def test_the_floor_is_what_lies_between_the_walls() -> None:
    assert area(load_plan("hallway")) == 100 * 2.4
    for x in (0.0, 100.0):
        assert area(parse_plan(corner(x, length=6, depth=5))) == pytest.approx(6 * 2 + 2 * 4)
    open_at_both_ends = parse_plan(SMALL.format(top="", end=""))
    assert area(open_at_both_ends) == pytest.approx(8 * 2.4)


def wall(name: str, start: tuple[float, float], end: tuple[float, float]) -> str:
    ends = f"start = {list(start)}\nend = {list(end)}"
    return f'[[wall]]\nname = "{name}"\n{ends}\ninside = "left"\nmaterial = "plaster"\n'


ROUND_THE_CORNER = corner()
"""An outline of six walls around 6 x 2 and 2 x 4 m."""


@pytest.mark.parametrize(
    ("drawn", "written", "partitions"),
    [
        ("end = [6.0, 5.0]", "end = [6.001, 5.0]", ""),
        ("start = [4.0, 1]", "start = [3.994, 1.004]", ""),
        ("", "", wall("from-a-wall", (2, -1), (2, 0))),
        ("", "", wall("across", (4, 1), (6, 1))),
        ("", "", wall("post", (1, 0), (1.5, 0.5)) + wall("arm", (1.5, 0.5), (2, 0.5))),
        ("start = [4.0, 1]", "start = [4.0, 1.009]", wall("a-little-off", (2, -1.009), (2, 0))),
    ],
)
def test_walls_that_meet_to_the_centimetre_enclose_the_floor_around_partitions(
    drawn: str, written: str, partitions: str
) -> None:
    plan = parse_plan(ROUND_THE_CORNER.replace(drawn, written, 1) + partitions)
    assert area(plan) == pytest.approx(6 * 2 + 2 * 4, abs=0.1)
    assert [one.name for one in enclosing(plan)] == [one.name for one in parse_plan(ROUND_THE_CORNER).wall]


@pytest.mark.parametrize(
    ("drawn", "written", "more"),
    [
        ("start = [4.0, 1]", "start = [4.0, 1.02]", ""),
        ("start = [4.0, 1]", "start = [4.0, 1.2]", ""),
        ("", "", wall("room", (1, 1), (1, 4)) + wall("beside", (1, 4), (4, 4))),
    ],
)
def test_walls_with_a_gap_or_a_room_outside_enclose_nothing(drawn: str, written: str, more: str) -> None:
    plan = parse_plan(ROUND_THE_CORNER.replace(drawn, written, 1) + more)
    assert enclosing(plan) == ()
    assert area(plan) == 6 * 6
