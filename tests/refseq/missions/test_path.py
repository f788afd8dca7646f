"""Ways along a sequence and along routes: where things are on them, and what was done there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.routes import Leg, Route, shortest_route
from refseq.map.map import Map
from refseq.map.paths.annotations import Annotations, DoorSide, PathDoor
from refseq.map.reduction import reduced
from refseq.missions.path import MissionPath, joined, path_along, path_of
from tests.refseq.rooms import bits_drive, bits_sequence


def door(along: float, side: DoorSide = DoorSide.LEFT) -> PathDoor:
    return PathDoor(along, side, 0.9, True)


def learnt(name: str, behaviours: dict[int, str], doors: list[float], count: int = 10, seed: int = 1) -> Map:
    """Places a metre apart."""
    drawn = np.random.default_rng(seed).random((count, 40)) < 0.3
    told = tuple(behaviours.get(place, "") for place in range(count))
    annotations = Annotations(told if any(told) else (), tuple(map(door, doors)))
    return Map.of(bits_sequence(bits_drive({"camera": drawn})), name, annotations)


@pytest.fixture
def atlas() -> Map:
    """Paths a and b of ten places each; b's fourth view is at a's seventh place."""
    a = learnt("a", {0: "MN:6", 6: "MT:90", 7: "MN:3"}, [2.5, 8.0], seed=1)
    b = learnt("b", {0: "MW:left,0.6", 5: "MC:left"}, [1.0, 5.5], seed=2)
    kept = np.array([0, 1, 2, 4, 5, 6, 7, 8, 9])
    sequences = np.where(np.arange(10) == 3, 0, 1)
    places = np.array([0, 1, 2, 6, 3, 4, 5, 6, 7, 8])
    crossing = replace(b.paths[0], sequences=sequences, places=places)
    return Map(("a", "b"), (a.sequence, reduced(b.sequence, kept)), (*a.paths, crossing))


def test_a_path_is_a_way() -> None:
    way = path_along(learnt("a", {0: "MN:9", 4: "MT:180"}, [2.5]))
    assert way.places.tolist() == list(range(10))
    assert way.along.tolist() == list(range(10))
    assert way.length == 9.0
    assert way.behaviours == ("MN:9", "", "", "", "MT:180", "", "", "", "", "")
    assert way.doors == (door(2.5),)
    assert path_along(learnt("a", {}, [])).behaviours == ("",) * 10


def test_a_door_that_was_only_seen_ahead_of_the_last_place_is_none_along_the_way() -> None:
    assert path_along(learnt("a", {}, [2.5, 9.0, 11.3])).doors == (door(2.5), door(9.0))


def test_a_path_that_gave_places_away_is_a_way_through_both_sequences(atlas: Map) -> None:
    way = path_along(atlas, atlas.paths[1])
    assert way.places.tolist() == [10, 11, 12, 6, 13, 14, 15, 16, 17, 18]
    assert way.doors == (door(1.0), door(5.5))


def test_a_route_goes_over_as_the_other_path_was_driven(atlas: Map) -> None:
    route = Route(np.array([10, 11, 12, 6, 7, 8]), (Leg("b", 0, 3, 3.0), Leg("a", 6, 8, 2.0)))
    way = path_of(atlas, route)
    assert way.places.tolist() == route.places.tolist()
    assert way.along.tolist() == [0, 1, 2, 3, 4, 5]
    assert way.length == route.length
    assert way.behaviours == ("MW:left,0.6", "", "", "MT:90", "MN:3", "")
    assert way.doors == (door(1.0), door(5.0))


def test_a_leg_begins_with_what_was_in_force_there(atlas: Map) -> None:
    """Path a's view 6 is b's view 3, where b had gone along its wall since view 0."""
    route = Route(np.array([5, 6, 13, 14]), (Leg("a", 5, 6, 1.0), Leg("b", 3, 5, 2.0)))
    way = path_of(atlas, route)
    assert way.places.tolist() == route.places.tolist()
    assert way.behaviours == ("MN:6", "MW:left,0.6", "", "MC:left")
    assert way.doors == ()


def test_doors_of_a_leg_are_those_between_its_ends(atlas: Map) -> None:
    way = path_of(atlas, shortest_route(atlas, 3, 8))
    assert way.doors == (door(5.0),)
    assert way.behaviours == ("MN:6", "", "", "MT:90", "MN:3", "")


def test_where_one_is_already_there_is_no_way(atlas: Map) -> None:
    way = path_of(atlas, shortest_route(atlas, 4, 4))
    assert way.places.tolist() == [4]
    assert way.length == 0.0
    assert way.behaviours == ("",)


@given(st.lists(st.lists(st.floats(0.1, 5.0), min_size=1, max_size=5), min_size=1, max_size=4), st.data())
def test_joined_ways_add_up(steps: list[list[float]], data: st.DataObject) -> None:
    legs, place, far, doors = [], 0, 0.0, []
    for leg in steps:
        along = np.concatenate([[0.0], np.cumsum(leg)])
        at = data.draw(st.floats(0.0, float(along[-1])))
        legs.append(MissionPath(np.arange(place, place + len(along)), along, ("MN",) * len(along), (door(at),)))
        doors.append(far + at)
        place, far = place + len(leg), far + float(along[-1])
    whole = joined(legs)
    assert whole.length == pytest.approx(sum(map(sum, steps)))
    assert whole.places.tolist() == list(range(place + 1))
    assert len(whole.behaviours) == len(whole.along) == place + 1
    assert (np.diff(whole.along) > 0).all()
    assert [one.along for one in whole.doors] == pytest.approx(doors)
