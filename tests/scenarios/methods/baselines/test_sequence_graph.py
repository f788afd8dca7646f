"""The hidden-node graph, against all ways there are through small ones."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.belief import LOST, Belief
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.sequence_graph import (
    SequenceGraph,
    SequenceGraphSettings,
    cheapest_before,
)
from tests.scenarios.methods.baselines.looks import Looks

NEVER = SequenceGraphSettings(fan_out=1, hidden=5.0, window=9, lost_share=1.0)
"""Settings with which no way is begun anew."""


def answers(table: np.ndarray, chosen: SequenceGraphSettings, times: list[int] | None = None) -> list[Belief]:
    graph = SequenceGraph(Looks(table), chosen)  # type: ignore[arg-type]
    return [graph.update(View(float(time))) for time in (range(len(table)) if times is None else times)]


def all_ways(views: int, places: int, fan_out: int) -> list[tuple[int, ...]]:
    return [
        way
        for way in itertools.product(range(places), repeat=views)
        if all(abs(b - a) <= fan_out for a, b in itertools.pairwise(way))
    ]


def cost(table: np.ndarray, way: tuple[int, ...], hidden: float) -> float:
    return sum(min(1 / table[t, k], hidden) for t, k in enumerate(way))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(1, 5), st.integers(0, 3), st.floats(1.2, 12))
def test_each_place_has_the_cheapest_of_all_ways_that_end_there(
    seed: int, views: int, places: int, fan_out: int, hidden: float
) -> None:
    table = np.random.default_rng(seed).uniform(0.05, 0.9, (views, places))
    chosen = SequenceGraphSettings(fan_out=fan_out, hidden=hidden, window=9, lost_share=1.0, worth=2.0)
    found = answers(table, chosen)[-1]
    ways = all_ways(views, places, fan_out)
    cheapest = np.array([min(cost(table, way, hidden) for way in ways if way[-1] == k) for k in range(places)])
    expected = np.exp(-(cheapest - cheapest.min()) / 2.0)
    assert found.places == pytest.approx(expected / expected.sum(), rel=1e-4)
    assert cheapest[found.best] == pytest.approx(cheapest.min(), abs=1e-4)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(2, 5))
def test_the_path_is_the_cheapest_way_with_hidden_nodes_told_as_lost(seed: int, views: int, places: int) -> None:
    table = np.random.default_rng(seed).uniform(0.05, 0.9, (views, places))
    hidden = 3.0
    found = answers(table, SequenceGraphSettings(fan_out=1, hidden=hidden, window=9, lost_share=1.0))[-1]
    ways = all_ways(views, places, 1)
    least = min(cost(table, way, hidden) for way in ways)
    cheapest = [way for way in ways if cost(table, way, hidden) < least + 1e-4]
    told = [tuple(LOST if 1 / table[t, k] > hidden else k for t, k in enumerate(way)) for way in cheapest]
    assert found.path in told
    own = [[1 / table[t, k] for t, k in enumerate(way)] for way in cheapest]
    lost = [np.mean([c / (c + hidden) for c in costs]) for costs in own]
    assert min(abs(found.lost - value) for value in lost) < 1e-9


@given(st.lists(st.integers(0, 5), min_size=1, max_size=8), st.integers(0, 4))
def test_the_cheapest_before_is_within_the_fan_out(ways: list[int], fan_out: int) -> None:
    costs, before = cheapest_before(np.array(ways, float), fan_out)
    for k in range(len(ways)):
        near = range(max(0, k - fan_out), min(len(ways), k + fan_out + 1))
        # Of equal ones that from which the step is nearest to one place ahead.
        least, off = min((ways[j], abs(k - j - 1)) for j in near)
        assert (ways[before[k]], abs(k - before[k] - 1)) == (least, off)
        assert costs[k] == pytest.approx(least, abs=1e-4)


def along(first: int, count: int, places: int = 30) -> np.ndarray:
    """Cosines of views along a path: 0.6 at the very place, 0.05 elsewhere."""
    return np.where(np.arange(places) == first + np.arange(count)[:, None], 0.6, 0.05)


@pytest.mark.parametrize("first", [0, 13, 22])
def test_a_drive_is_followed_from_anywhere(first: int) -> None:
    found = answers(along(first, 8), SequenceGraphSettings())
    assert [belief.best for belief in found] == list(range(first, first + 8))
    assert found[-1].path == tuple(range(first + 3, first + 8))
    assert found[-1].lost < 0.3


def test_one_view_that_looks_like_elsewhere_does_not_mislead() -> None:
    table = along(4, 9)
    table[6] = np.where(np.arange(30) == 25, 0.6, 0.05)
    found = answers(table, SequenceGraphSettings())
    assert found[6].path == (6, 7, 8, 9, LOST)
    assert found[6].best == 10
    assert [belief.best for belief in found[7:]] == [11, 12]


def test_views_of_nowhere_are_lost_and_then_any_place_may_follow() -> None:
    window = SequenceGraphSettings().window
    nowhere = np.full((window, 30), 0.05)
    found = answers(np.concatenate([along(2, 8), nowhere, along(24, 4)]), SequenceGraphSettings())
    assert found[7].lost < 0.5 < found[7 + window].lost
    assert found[7 + window].path == (LOST,) * window
    assert [belief.best for belief in found[-4:]] == [24, 25, 26, 27]
    # Without beginning anew the way is bound to the fan-out.
    bound = answers(np.concatenate([along(2, 8), nowhere, along(24, 4)]), NEVER)
    assert bound[-4].best < 20


def test_a_way_begun_anew_goes_on_from_where_the_best_one_was_lost() -> None:
    chosen = SequenceGraphSettings(window=3, lost_share=0.5)
    nowhere = np.where(np.arange(30) < 15, 0.1, 0.05) * np.ones((2, 1))
    found = answers(np.concatenate([along(2, 8), nowhere, along(24, 1)]), chosen)[-1]
    assert found.path == (LOST, LOST, 24)
    # It was lost around place 10, at a cost of 10, not at place 24, where it would have been 20.
    assert found.lost == pytest.approx(np.mean([c / (c + chosen.hidden) for c in (10, 10, 1 / 0.6)]))


def test_a_view_without_images_is_a_hidden_node() -> None:
    found = answers(along(3, 4), SequenceGraphSettings(), [0, 1, 2, -1])
    assert found[3].path == (3, 4, 5, LOST)
    assert found[3].lost > found[2].lost
    assert found[3].best == 6
    alone = answers(along(3, 4), SequenceGraphSettings(), [-1])[0]
    assert alone.places == pytest.approx(np.full(30, 1 / 30))
    assert alone.lost > 0.5
