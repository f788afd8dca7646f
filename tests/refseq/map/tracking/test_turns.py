"""The turns behind, asked by the chain: a corridor that looks like the path behind its corner, without the corner."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Belief, Stage
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise, smoothed
from refseq.map.map import Map, beside
from refseq.view import View
from tests.support import corridor_drive

CORNER = 15


def drive(seed: int, turn: float) -> list[View]:
    """A corridor by its pictures and scans, and a turn half-way by its odometer."""
    views = corridor_drive(np.random.default_rng(seed), count=30, size=96)
    return [replace(view, turn=turn if number == CORNER else 0.0) for number, view in enumerate(views)]


ROUND, STRAIGHT = drive(2, math.pi / 2), drive(2, 0.0)


def learnt(turns: float, name: str = "") -> Map:
    """Without a tail: these pictures are so like the map's that with it an odometer would not count."""
    return learn(drive(1, math.pi / 2), profile=f"best+log_ratio.turns={turns}+log_ratio.tail=0", name=name)


@pytest.fixture(scope="module", params=["one path", "two paths"])
def maps(request: pytest.FixtureRequest) -> tuple[Map, Map]:
    """A map that does not ask, and one that does; the same path twice is told apart by nothing."""
    if request.param == "one path":
        return learnt(0), learnt(20)
    without, asking = ([learnt(turns, name) for name in ("here", "there")] for turns in (0, 20))
    return beside(without), beside(asking)


def lost(beliefs: Sequence[Belief]) -> np.ndarray:
    return np.array([belief.lost for belief in beliefs])


def answers(map_: Map, views: Sequence[View]) -> list[Belief]:
    localiser = Localiser(map_)
    return [localiser.update(view) for view in views]


@pytest.fixture(scope="module")
def straight_on(maps: tuple[Map, Map]) -> tuple[np.ndarray, np.ndarray]:
    """P(lost), by either map, of the robot that leaves the path."""
    without, asking = (lost(answers(map_, STRAIGHT)) for map_ in maps)
    return without, asking


@pytest.mark.quick_cases("one path")
def test_who_goes_straight_on_is_said_to_have_left_the_path(straight_on: tuple[np.ndarray, np.ndarray]) -> None:
    without, asking = straight_on
    np.testing.assert_allclose(without[:CORNER], asking[:CORNER], atol=1e-6)
    assert (asking > without)[CORNER + 2 : -1].all()


@pytest.mark.quick_cases("one path")
def test_who_takes_the_corner_is_believed_as_before(maps: tuple[Map, Map]) -> None:
    without, asking = (answers(map_, ROUND) for map_ in maps)
    assert lost(asking).max() <= lost(without).max() + 0.05
    assert [one.best for one in asking] == [one.best for one in without]


@pytest.mark.quick_cases("one path")
def test_a_drive_begins_with_nothing_behind_it(
    maps: tuple[Map, Map], straight_on: tuple[np.ndarray, np.ndarray]
) -> None:
    localiser = Localiser(maps[1])
    for view in STRAIGHT[: CORNER + 1]:  # the turn, or none, is behind it
        localiser.update(view)
    localiser.reset()
    again = [localiser.update(view) for view in STRAIGHT]
    np.testing.assert_array_equal(straight_on[1], lost(again))


@pytest.mark.quick_cases("one path")
def test_an_odometer_that_nobody_read_tells_of_no_turn(maps: tuple[Map, Map]) -> None:
    blind = [replace(view, has_odometry=False, distance=0.0, turn=0.0) for view in STRAIGHT]
    without, asking = (lost(answers(map_, blind)) for map_ in maps)
    np.testing.assert_array_equal(without, asking)


@pytest.mark.slow
def test_single_views_and_the_prior_ask_nothing() -> None:
    stages = (Stage.UNIFORM, Stage.PRIOR)
    without, asking = (localise(learnt(turns), STRAIGHT, stages=stages) for turns in (0, 20))
    for stage in stages:
        for one, other in zip(without[stage], asking[stage], strict=True):
            np.testing.assert_array_equal(one.places, other.places)


def test_in_hindsight_it_is_asked_as_well() -> None:
    without, asking = (lost(smoothed(learnt(turns), STRAIGHT)) for turns in (0, 20))
    assert (asking > without)[CORNER + 2 : -1].all()
