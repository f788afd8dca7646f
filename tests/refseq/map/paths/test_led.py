"""Behaviours of drives that somebody led: replayed by dead reckoning they lead along the same way."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.behaviours import begun
from refseq.map.paths.led import led_behaviours
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


def turns(views: Sequence[View]) -> list[tuple[float, ...]]:
    """Angle and radius of each turn that is derived."""
    told = [one for words in led_behaviours(views) for _, one in begun(words)]
    return [parse_behaviour(one).values for one in told if one.startswith("MT")]


def replayed(views: Sequence[View]) -> list[Pose]:
    """Poses where the orders of the way end, by dead reckoning."""
    along = np.cumsum([0.0] + [view.distance for view in views[1:]])
    plan = as_learnt(MissionPath(np.arange(len(views)), along, led_behaviours(views), ()))
    x = y = heading = 0.0
    reached = []
    for number, order in enumerate(plan.orders):
        if order.travels:
            length, turn = plan.end_of(number) - order.at, 0.0
        else:
            turn, *radius = parse_behaviour(order.behaviour).values
            length = sum(radius) * 2 * abs(math.sin(turn / 2))  # the arc's chord
        x, y = x + length * math.cos(heading + turn / 2), y + length * math.sin(heading + turn / 2)
        heading += turn
        reached.append(Pose(x, y, heading))
    return reached


@settings(max_examples=40, deadline=None)
@given(routes)
def test_turns_about_itself_are_found_again(parts: list[tuple[float, float]]) -> None:
    """Whatever the angles: the corners are between two views, and the goal is that of the drive.

    A view knows how far it is from the one before and how it has turned, not where between them. Its way is taken for a
    chord at half the turn φ; the corner was at one of its ends at worst, which is off by 2 · SPACING · sin(φ/4).
    """
    views = led(parts)
    reached = replayed(views)
    goal = views[-1].truth
    assert goal is not None
    off = sum(2 * SPACING * math.sin(abs(turn) / 4) for _, turn in parts)
    assert math.dist((reached[-1].x, reached[-1].y), (goal.x, goal.y)) < off + 0.05
    assert abs(math.remainder(reached[-1].heading - goal.heading, math.tau)) < math.radians(3)


@pytest.mark.parametrize("turn", [90, -90, 60])
@pytest.mark.parametrize("radius", [0.5, 0.8, 1.2])
def test_a_corner_on_an_arc_is_one_turn_on_that_arc(turn: float, radius: float) -> None:
    views = led([(6.0, math.radians(turn)), (5.0, 0.0)], radius=radius)
    ((angle, found),) = turns(views)
    assert angle == pytest.approx(math.radians(turn), abs=math.radians(4))
    assert found == pytest.approx(radius, abs=0.4)
    goal, reached = views[-1].truth, replayed(views)[-1]
    assert goal is not None
    assert math.dist((reached.x, reached.y), (goal.x, goal.y)) < 0.35


def test_who_turns_back_turns_about_itself_by_half_a_turn() -> None:
    found = turns(led([(6.2, math.pi), (6.0, 0.0)]))
    assert sum(angle for angle, *_ in found) % math.tau == pytest.approx(math.pi, abs=math.radians(3))
    assert not any(radius for _, *radius in found)


@pytest.mark.parametrize(("left", "right", "kept"), [(0.9, 1.5, (0.9, 1.5)), (0.9, 4.0, (0.9, 0)), (4.0, 5.0, (0, 0))])
def test_walls_are_kept_to_where_they_are_near(left: float, right: float, kept: tuple[float, float]) -> None:
    walls = [(-2.0, left, 30.0, left), (-2.0, -right, 30.0, -right)]
    ((_, words),) = [one for told in led_behaviours(led([(15.0, 0.0)], walls=walls)) for one in begun(told)]
    values = parse_behaviour(words).values
    assert values[0] == pytest.approx(15.0, abs=SPACING)
    assert values[1:] == pytest.approx(kept, abs=0.03)


def test_what_never_moved_has_no_behaviours() -> None:
    assert led_behaviours([View(0.0)]) == ()
    assert led_behaviours([View(0.0), View(1.0)]) == ()


@pytest.mark.parametrize("spacing", [2.0, 10.0])
def test_a_corner_is_told_however_far_apart_the_views_are(spacing: float) -> None:
    steps = int(40 / spacing)
    motions = [(0.0, 0.0), *[(spacing, 0.0)] * steps, (0.0, math.pi / 2), *[(spacing, 0.0)] * steps]
    views = [View(float(k), distance=distance, turn=turn) for k, (distance, turn) in enumerate(motions)]
    assert any(words.startswith("MT:90.0") for words in led_behaviours(views))
