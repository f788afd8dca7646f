"""Behaviours of drives that somebody led: replayed by dead reckoning they lead along the same way."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.map.led import led_behaviours
from refseq.missions.path import MissionPath
from refseq.missions.plan import as_learnt
from refseq.planar import Pose, motion_between
from refseq.view import View
from refseq_bench.robots.behaviours.written import parse_behaviour
from tests.refseq.rooms import Wall, cast

SPACING = 0.85
angles = st.floats(25.0, 140.0).map(math.radians) | st.floats(-140.0, -25.0).map(math.radians)
routes = st.lists(st.tuples(st.floats(3.0, 9.0), angles), min_size=1, max_size=5)


def led(parts: Sequence[tuple[float, float]], *, radius: float = 0.0, walls: Sequence[Wall] = ()) -> list[View]:
    """Views of a drive over parts of a length [m], each with a turn [rad] at its end, on an arc of ``radius`` [m]."""
    poses, step = [Pose(0.0, 0.0, 0.0)], 0.01

    def go(length: float, curvature: float) -> None:
        for _ in range(round(length / step)):
            at = poses[-1]
            middle = at.heading + curvature * step / 2
            poses.append(Pose(at.x + step * math.cos(middle), at.y + step * math.sin(middle), middle * 2 - at.heading))

    for length, turn in parts:
        go(length, 0.0)
        if radius:
            go(abs(turn) * radius, math.copysign(1 / radius, turn))
        else:
            poses[-1] = Pose(poses[-1].x, poses[-1].y, poses[-1].heading + turn)
    if parts[-1][1]:
        go(3.0, 0.0)
    taken = poses[:: round(SPACING / step)]
    moves = [(0.0, 0.0), *(motion_between(*pair) for pair in pairwise(taken))]
    rng = np.random.default_rng(1)
    scans = [cast(walls, pose, rng=rng) if walls else None for pose in taken]
    return [
        View(float(k), scan=scan, distance=distance, turn=turn, truth=pose)
        for k, (pose, scan, (distance, turn)) in enumerate(zip(taken, scans, moves, strict=True))
    ]


def replayed(views: Sequence[View]) -> list[Pose]:
    """Poses where the orders of the way end, by dead reckoning."""
    along = np.cumsum([0.0] + [view.distance for view in views[1:]])
    plan = as_learnt(MissionPath(np.arange(len(views)), along, led_behaviours(views), ()))
    x = y = heading = 0.0
    reached = []
    for number, order in enumerate(plan.orders):
        if order.travels:
            length = plan.end_of(number) - order.at
            x, y = x + length * math.cos(heading), y + length * math.sin(heading)
        else:
            heading += parse_behaviour(order.behaviour).values[0]
        reached.append(Pose(x, y, heading))
    return reached


@settings(max_examples=40, deadline=None)
@given(routes)
def test_turns_about_itself_are_found_again(parts: list[tuple[float, float]]) -> None:
    """Whatever the angles: the corners are between two views, and the goal is that of the drive.

    A view knows how far it is from the one before and how it has turned, not where between them: their spacing is
    what a corner may be off.
    """
    views = led(parts)
    reached = replayed(views)
    goal = views[-1].truth
    assert goal is not None
    assert math.dist((reached[-1].x, reached[-1].y), (goal.x, goal.y)) < len(parts) * SPACING
    assert abs(math.remainder(reached[-1].heading - goal.heading, math.tau)) < math.radians(3)


@pytest.mark.parametrize("turn", [90, -90, 60])
@pytest.mark.parametrize("radius", [0.3, 0.6])
def test_a_corner_on_an_arc_is_one_turn(turn: float, radius: float) -> None:
    views = led([(6.0, math.radians(turn)), (5.0, 0.0)], radius=radius)
    (turned,) = [one for words in led_behaviours(views) for one in words.split() if one.startswith("MT")]
    assert parse_behaviour(turned).values[0] == pytest.approx(math.radians(turn), abs=math.radians(4))
    goal, reached = views[-1].truth, replayed(views)[-1]
    assert goal is not None
    assert math.dist((reached.x, reached.y), (goal.x, goal.y)) < 0.35


def test_who_turns_back_turns_by_half_a_turn() -> None:
    views = led([(6.2, math.pi), (6.0, 0.0)])
    turned = [one for words in led_behaviours(views) for one in words.split() if one.startswith("MT")]
    assert abs(sum(parse_behaviour(one).values[0] for one in turned)) == pytest.approx(math.pi, abs=math.radians(3))


@pytest.mark.parametrize(("left", "right", "kept"), [(0.9, 1.5, "0.90,1.50"), (0.9, 4.0, "0.90,0.00"), (4.0, 5.0, "")])
def test_walls_are_kept_to_where_they_are_near(left: float, right: float, kept: str) -> None:
    walls = [(-2.0, left, 30.0, left), (-2.0, -right, 30.0, -right)]
    (words,) = {words for words in led_behaviours(led([(15.0, 0.0)], walls=walls)) if words}
    values = parse_behaviour(words).values
    assert values[0] == pytest.approx(15.0, abs=SPACING)
    assert values[1:] == pytest.approx([float(one) for one in kept.split(",") if one], abs=0.03)


def test_what_never_moved_has_no_behaviours() -> None:
    assert led_behaviours([View(0.0)]) == ()
    assert led_behaviours([View(0.0), View(1.0)]) == ()
