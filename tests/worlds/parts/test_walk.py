import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.worlds.parts.walk import HALF_TURN, STEP, Stance, Walk
from refseq_bench.worlds.plans.schema import Person

coordinate = st.integers(-50, 50).map(lambda k: k / 2)
points = st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=5).filter(
    lambda line: all(a != b for a, b in itertools.pairwise(line))
)


def somebody(path: list[tuple[float, float]], speed: float = 1.2) -> Person:
    return Person(name="p", at=path[0], walk=tuple(path[1:]), speed=speed)


def test_there_and_back_along_a_line() -> None:
    walk = Walk.of(somebody([(1.0, 2.0), (7.0, 2.0)]))
    assert walk.period == pytest.approx(2 * (6.0 / 1.2 + HALF_TURN))
    assert walk.pose(2.5)[:3] == pytest.approx((4.0, 2.0, 0.0))
    assert walk.pose(5.0 + HALF_TURN / 2)[:3] == pytest.approx((7.0, 2.0, math.pi / 2))
    assert walk.pose(5.0 + HALF_TURN + 2.5)[:3] == pytest.approx((4.0, 2.0, math.pi))


@given(points, st.floats(0.3, 2.0))
def test_everybody_keeps_to_the_way_at_one_speed_and_looks_ahead(path: list[tuple[float, float]], speed: float) -> None:
    walk = Walk.of(somebody(path, speed))
    dt = 1e-6
    moments = [t for t in np.linspace(0.0, walk.period, 41) if all(abs(t + dt / 2 - knot) > dt for knot in walk.times)]
    assert len(moments) > 20
    for time in moments:
        here, there = walk.pose(time), walk.pose(time + dt)
        ends = itertools.pairwise(path)
        assert min(away(here[:2], *ends_of) for ends_of in ends) < 1e-9
        moved, turned = np.subtract(there[:2], here[:2]) / dt, (there.heading - here.heading) / dt
        if turned == 0.0:
            ahead = np.array([math.cos(here.heading), math.sin(here.heading)])
            np.testing.assert_allclose(moved, speed * ahead, atol=1e-3)
        else:
            np.testing.assert_allclose(moved, 0.0, atol=1e-3)
            assert abs(turned) == pytest.approx(math.pi / HALF_TURN, rel=1e-3)


@given(points, st.floats(0.3, 2.0), st.floats(0.0, 500.0))
def test_a_walk_has_no_jumps_and_begins_again(path: list[tuple[float, float]], speed: float, time: float) -> None:
    walk = Walk.of(somebody(path, speed))
    a, b = walk.pose(time), walk.pose(time + 0.001)
    assert math.dist(a[:2], b[:2]) <= speed * 0.001 + 1e-9
    assert 1.0 - math.cos(b.heading - a.heading) < 1.0 - math.cos(0.001 * math.pi / HALF_TURN + 1e-6)
    assert posture(walk.pose(time + 3 * walk.period)) == pytest.approx(posture(a), abs=1e-6)


@given(points)
def test_between_lines_both_feet_are_side_by_side(path: list[tuple[float, float]]) -> None:
    walk = Walk.of(somebody(path))
    steps = [stance.steps for stance in walk.stances]
    assert steps == [round(s) for s in steps]
    there_and_back = 2 * sum(math.dist(a, b) for a, b in itertools.pairwise(path))
    assert there_and_back / steps[-1] == pytest.approx(STEP, rel=0.35)


def posture(stance: Stance) -> tuple[float, ...]:
    """Place, direction and how far the legs are apart: what of a stance can be seen."""
    direction = math.cos(stance.heading), math.sin(stance.heading)
    return (*stance[:2], *direction, math.sin(math.pi * stance.steps))


def away(point: tuple[float, float], start: tuple[float, float], end: tuple[float, float]) -> float:
    """Distance of a point from a line with two ends."""
    p, a, b = np.array(point), np.array(start), np.array(end)
    share = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return float(np.linalg.norm(p - a - share * (b - a)))
