import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.inference.chain.chain import ChainSettings
from refseq.inference.chain.motion import MotionSettings
from refseq.inference.chain.network import Network
from refseq.map.tracking.turns_behind import ALIKE, LEAST, LearntWays, TurnsBehind, log_ratio_of

quick = settings(derandomize=True, max_examples=50)
STRAIGHT, LEFT = np.zeros(40), np.where(np.arange(40) < 20, 0.0, np.pi / 2)
"""Headings of two paths of 40 places, a metre apart: one straight on, one with a corner half-way."""


def network(*lengths: int, places: np.ndarray | None = None) -> Network:
    """Paths with a place a metre."""
    each = np.arange(sum(lengths)) if places is None else places
    return Network(tuple(np.arange(float(n)) for n in lengths), each, MotionSettings(), ChainSettings())


def track(headings: np.ndarray) -> np.ndarray:
    """Poses whose headings alone matter."""
    return np.column_stack([np.zeros((len(headings), 2)), headings])


def after(turns: TurnsBehind, *steps: tuple[float, float]) -> np.ndarray:
    """The log ratios after several steps; the first view's step counts for nothing."""
    told = turns.log_ratios(0.0, 0.0, again=False)
    for distance, turn in steps:
        told = turns.log_ratios(distance, turn, again=False)
    return told


def one_path(headings: np.ndarray, reach: float = 20.0) -> TurnsBehind:
    return TurnsBehind(LearntWays.of(network(len(headings)), [track(headings)]), reach)


@quick
@given(st.floats(-20, 20))
def test_it_speaks_against_places_alone_and_never_rules_one_out(difference: float) -> None:
    told = log_ratio_of(np.array([difference, difference + 2 * math.pi, -difference]))
    assert math.log(LEAST) <= told[0] <= 0
    np.testing.assert_allclose(told, told[0], atol=1e-9)
    if abs(math.remainder(difference, 2 * math.pi)) <= ALIKE:
        assert told[0] == 0


def test_who_went_straight_on_is_not_behind_the_corner() -> None:
    told = after(one_path(LEFT), *[(1.0, 0.0)] * 30)
    assert (told[:20] == 0).all()
    np.testing.assert_allclose(told[20:39], math.log(LEAST))
    assert told[39] == pytest.approx(math.log(LEAST))  # the corner is 20 m behind it: the last that counts


def test_who_turned_is_behind_the_corner_alone() -> None:
    told = after(one_path(LEFT), *[(1.0, 0.0)] * 19, (1.0, math.pi / 2), *[(1.0, 0.0)] * 5)
    assert (told[25:39] == 0).all()
    np.testing.assert_allclose(told[10:20], math.log(LEAST))


def test_who_turned_back_is_nowhere_until_it_has_gone_far_enough() -> None:
    turned = [(1.0, 0.0)] * 25, (0.5, math.pi)
    told = after(one_path(STRAIGHT), *turned[0], turned[1])
    np.testing.assert_allclose(told[1:], math.log(LEAST))
    told = after(one_path(STRAIGHT), *turned[0], turned[1], *[(1.0, 0.0)] * 21)
    assert (told == 0).all()


def test_no_more_is_compared_than_either_way_is_long() -> None:
    turns = one_path(LEFT)
    assert (after(turns) == 0).all()  # at a start nothing is known of the way
    told = turns.log_ratios(5.0, 0.0, again=False)
    assert (told[:20] == 0).all()
    assert (told[25:] == 0).all()  # five metres behind them lies no corner
    assert (told[20:24] < 0).all()


def test_a_weaving_operator_says_nothing() -> None:
    rng = np.random.default_rng(0)
    weaving = np.radians(8) * rng.standard_normal(40)
    own = np.diff(np.radians(8) * rng.standard_normal(40), prepend=0.0)
    told = after(one_path(weaving), *[(1.0, turn) for turn in own])
    assert told.mean() > -0.02


def test_a_motion_that_nobody_measured_leaves_nothing_known() -> None:
    turns = one_path(LEFT)
    after(turns, *[(1.0, 0.0)] * 30)
    assert (turns.log_ratios(math.nan, math.nan, again=False) == 0).all()
    assert (turns.log_ratios(1.0, 0.0, again=False)[25:] == 0).all()


def test_a_robot_that_stands_has_gone_nowhere() -> None:
    turns = one_path(LEFT)
    told = after(turns, *[(1.0, 0.0)] * 30)
    np.testing.assert_array_equal(turns.log_ratios(7.0, 2.0, again=True), told)


def test_a_robot_that_stands_for_hours_keeps_a_short_way_behind() -> None:
    turns, other = one_path(LEFT), one_path(LEFT)
    after(turns, *[(1.0, 0.0)] * 20, *[(0.0, 0.0)] * 5000)
    after(other, *[(1.0, 0.0)] * 20)
    assert len(turns._way) <= 25
    np.testing.assert_array_equal(turns.log_ratios(1.0, 0.1, again=False), other.log_ratios(1.0, 0.1, again=False))


def test_a_path_that_begins_with_a_turn_on_its_spot_has_nothing_behind_its_first_view() -> None:
    net = Network((np.array([0.0, 0, 0, 0, 1, 2, 3]),), np.arange(7), MotionSettings(), ChainSettings())
    ways = LearntWays.of(net, [track(np.radians([0.0, 40, 80, 90, 90, 90, 90]))])
    assert (TurnsBehind(ways, 5.0).log_ratios(0.0, 0.0, again=False) == 0).all()


@quick
@given(st.integers(0, 10**6))
def test_what_is_forgotten_of_the_way_is_never_asked(seed: int) -> None:
    """Long drives, against all that was ever driven kept."""
    rng = np.random.default_rng(seed)
    headings = np.cumsum(rng.normal(0, 0.5, 40))
    steps = list(zip(rng.uniform(0, 2, 60).tolist(), rng.normal(0, 0.5, 60).tolist(), strict=True))
    told = after(one_path(headings, 7.0), *steps)
    way = np.cumsum([0.0, *(distance for distance, _ in steps)])
    turned = np.cumsum([0.0, *(turn for _, turn in steps)])
    metres = np.minimum(np.minimum(np.arange(40.0), 7.0), way[-1])
    ours = turned[-1] - np.interp(way[-1] - metres, way, turned)
    theirs = headings - np.interp(np.arange(40.0) - metres, np.arange(40.0), headings)
    np.testing.assert_allclose(told, log_ratio_of(ours - theirs), atol=1e-9)


def test_where_paths_meet_no_way_is_known_from_behind() -> None:
    """The second path comes from the left into the first one's 10 to 19, and goes on by itself, to the right."""
    second = np.arange(40, 70)
    second[10:20] = np.arange(10, 20)
    net = network(40, 30, places=np.concatenate([np.arange(40), second]))
    own = np.where(np.arange(30) < 10, -np.pi / 2, np.where(np.arange(30) < 20, 0.0, -np.pi / 2))
    ways = LearntWays.of(net, [track(STRAIGHT), track(own)])
    np.testing.assert_array_equal(ways.known[:40], [*range(10), *[0] * 10, *range(1, 21)])
    np.testing.assert_array_equal(ways.known[40:], [*range(10), *[0] * 10, *range(1, 11)])
    told = after(TurnsBehind(ways, 20.0), *[(1.0, 0.0)] * 30)
    assert (told[:40] == 0).all()
    np.testing.assert_allclose(told[60:], math.log(LEAST))  # it went straight on where the second path turns


def test_a_path_whose_odometry_is_not_known_says_nothing() -> None:
    ways = LearntWays.of(network(40, 40), [np.zeros((0, 3)), track(LEFT)])
    assert (ways.known[:40] == 0).all()
    told = after(TurnsBehind(ways, 20.0), *[(1.0, 0.0)] * 30)
    assert (told[:40] == 0).all()
    assert (told[60:] < 0).all()
