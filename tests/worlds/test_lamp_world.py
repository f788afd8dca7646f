"""The world ``lamp``: the way of the eleven-line program, and room on it."""

import itertools
import math

import numpy as np

from refseq_bench.worlds.plans.load import load_plan

PLAN = load_plan("lamp")


def test_all_four_turns_of_the_way_go_left_and_the_way_back_is_the_same() -> None:
    forward = np.array(PLAN.routes["forward"])
    legs = np.diff(forward, axis=0)
    turns = [math.atan2(a[0] * b[1] - a[1] * b[0], a @ b) for a, b in itertools.pairwise(legs)]
    assert [round(math.degrees(turn)) for turn in turns] == [90, 90, 90, 90]
    assert PLAN.routes["reverse"] == PLAN.routes["forward"][::-1]


def test_the_opening_is_narrow_and_on_the_way() -> None:
    south, north = (PLAN.wall_named(f"jamb-{side}").start for side in ("south", "north"))
    assert 0.71 + 0.4 < north[1] - south[1] < 1.3
    assert PLAN.routes["forward"][2][1] == (north[1] + south[1]) / 2


def test_walls_that_lie_back_to_back_touch() -> None:
    """The room's and the corridor's, the room's and the hall's: each pair is as far apart as both are thick."""
    for one, other in (("room-south", "corridor-north"), ("room-west", "hall-east"), ("room-nook", "hall-south")):
        a, b = PLAN.wall_named(one), PLAN.wall_named(other)
        apart = np.abs(np.subtract(a.start, b.start))
        assert np.isclose(apart, a.thickness + b.thickness).any(), (one, other)
