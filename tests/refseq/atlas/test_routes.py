"""Routes over an atlas, against a search that tries every way, and on walks whose corridors are known."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.merge import merge_maps
from refseq.atlas.routes import CHANGE, Leg, NoRouteError, Route, place_name, place_of, shortest_route
from refseq.errors import MapError
from refseq.map.map import Map, beside
from refseq.map.paths.path import MapPath
from refseq.map.profile import BEST
from refseq.map.reduction import reduced
from tests.refseq.rooms import named_maps
from tests.refseq.walks import Leg as Walk
from tests.refseq.walks import Town

TOWN = Town()
WALK = TOWN.learnt([("A", 0, 12)], profile=BEST)
PLACES = 6


def atlas_of(*paths: tuple[list[int], list[float]]) -> Map:
    """An atlas of one sequence, and paths through its places as lists of places and of steps between them [m]."""
    held = reduced(WALK, np.arange(PLACES))
    ways = [
        MapPath(f"path-{name}", np.cumsum([0.0, *steps]), np.zeros(len(places), np.intp), np.array(places, np.intp))
        for name, (places, steps) in zip("abcdefgh", paths, strict=False)
    ]
    return Map(("path-a",), (held,), tuple(ways))


def legs_of(found: Route) -> list[tuple[str, int, int]]:
    return [(leg.path, leg.first, leg.last) for leg in found.legs]


def least_cost(atlas: Map, start: int, goal: int, change: float) -> float:
    """Cheapest sequence of rides [m], by trying all rides again and again until nothing gets cheaper (Bellman, Ford).

    A ride goes from any view of a path to any later one, and costs its length and a change.
    """
    rides = [
        (int(at[i]), int(at[j]), float(path.along[j] - path.along[i]) + change)
        for path in atlas.paths
        for at in [atlas.numbered(path)]
        for i in range(len(at))
        for j in range(i, len(at))
    ]
    cost = {start: 0.0}
    for _ in range(len(atlas)):
        for here, there, price in rides:
            cost[there] = min(cost.get(there, math.inf), cost.get(here, math.inf) + price)
    return cost.get(goal, math.inf)


def assert_can_be_driven(atlas: Map, found: Route, start: int, goal: int) -> None:
    """Each leg goes on along its path from where the last one ended, through the places that the route names."""
    paths = {path.name: path for path in atlas.paths}
    driven = [start]
    for leg in found.legs:
        path = paths[leg.path]
        assert leg.first < leg.last
        assert leg.length == pytest.approx(path.along[leg.last] - path.along[leg.first])
        places = atlas.numbered(path)[leg.first : leg.last + 1].tolist()
        assert places[0] == driven[-1]
        driven.extend(places)
    assert driven[-1] == goal
    assert found.places.tolist() == [driven[0], *(there for here, there in pairwise(driven) if here != there)]
    assert found.length == pytest.approx(sum(leg.length for leg in found.legs))


@st.composite
def atlases(draw: st.DrawFn) -> Map:
    paths = []
    for _ in range(draw(st.integers(1, 4))):
        places = draw(st.lists(st.integers(0, PLACES - 1), min_size=1, max_size=6))
        steps = draw(st.lists(st.integers(0, 8), min_size=len(places) - 1, max_size=len(places) - 1))
        paths.append((places, [float(step) for step in steps]))
    return atlas_of(*paths)


@given(atlases(), st.integers(0, PLACES - 1), st.integers(0, PLACES - 1), st.sampled_from([0.0, 0.5, 3.0, CHANGE]))
def test_no_way_is_cheaper(atlas: Map, start: int, goal: int, change: float) -> None:
    least = least_cost(atlas, start, goal, change)
    if math.isinf(least):
        with pytest.raises(NoRouteError):
            shortest_route(atlas, start, goal, change=change)
        return
    found = shortest_route(atlas, start, goal, change=change)
    assert found.length + change * len(found.legs) == pytest.approx(least)
    assert_can_be_driven(atlas, found, start, goal)


def test_along_one_path_the_route_is_the_path() -> None:
    atlas = beside(named_maps(["only"], [WALK]))
    found = shortest_route(atlas, 2, 9)
    assert found.places.tolist() == list(range(2, 10))
    assert found.legs == (Leg("only", 2, 9, float(WALK.along[9] - WALK.along[2])),)


def test_nobody_drives_a_path_backwards() -> None:
    atlas = beside(named_maps(["only"], [WALK]))
    with pytest.raises(NoRouteError, match="no path leads from only:9 to only:2: paths are driven one way only"):
        shortest_route(atlas, 9, 2)


def test_where_one_is_already_there_is_no_leg() -> None:
    found = shortest_route(beside(named_maps(["only"], [WALK])), 4, 4)
    assert (found.places.tolist(), found.legs, found.length) == ([4], (), 0.0)


def test_between_paths_that_do_not_meet_there_is_none() -> None:
    atlas = beside(named_maps(["a", "c"], [WALK, TOWN.learnt([("C", 0, 12)], 1, BEST)]))
    with pytest.raises(NoRouteError, match="no path leads from a:0 to c:11"):
        shortest_route(atlas, place_of(atlas, "a:0"), place_of(atlas, "c:11"))


def test_a_change_must_save_something() -> None:
    """Path b leaves path a where it goes 1-2-3 and takes 4 m less."""
    atlas = atlas_of(([0, 1, 2, 3, 4], [3.0] * 4), ([1, 3, 5], [2.0, 1.0]))
    assert legs_of(shortest_route(atlas, 0, 4)) == [("path-a", 0, 4)]
    # To leave the path and to come back to it are two changes.
    assert legs_of(shortest_route(atlas, 0, 4, change=2.1)) == [("path-a", 0, 4)]
    hopping = shortest_route(atlas, 0, 4, change=1.9)
    assert legs_of(hopping) == [("path-a", 0, 1), ("path-b", 0, 1), ("path-a", 3, 4)]
    assert (hopping.places.tolist(), hopping.length) == ([0, 1, 3, 4], 8.0)


def test_the_length_of_a_path_that_dawdles_is_its_odometry() -> None:
    """Two views at one place, and a place left out: as nearest places come about when views are unevenly spaced."""
    atlas = atlas_of(([0, 1, 2, 3, 4, 5], [1.0] * 5), ([0, 1, 1, 3, 4, 4, 5], [1.0] * 6))
    found = shortest_route(atlas_of(([0, 1, 1, 3, 4, 4, 5], [1.0] * 6)), 0, 5)
    assert (legs_of(found), found.length, found.places.tolist()) == ([("path-a", 0, 6)], 6.0, [0, 1, 3, 4, 5])
    assert legs_of(shortest_route(atlas, 0, 5)) == [("path-a", 0, 5)]


def test_a_path_that_comes_by_twice_is_cut_short() -> None:
    atlas = atlas_of(([0, 1, 2, 3, 1, 4], [10.0] * 5))
    found = shortest_route(atlas, 0, 4)
    assert (legs_of(found), found.length) == ([("path-a", 0, 1), ("path-a", 4, 5)], 20.0)


def merged(**legs: list[Walk]) -> Map:
    walks = {name: TOWN.learnt(way, number, BEST) for number, (name, way) in enumerate(legs.items())}
    return merge_maps(named_maps(list(walks), list(walks.values()))).map


def routed(atlas: Map, start: str, goal: str) -> Route:
    """A route that can be driven, between places by their names."""
    ends = place_of(atlas, start), place_of(atlas, goal)
    found = shortest_route(atlas, *ends)
    assert_can_be_driven(atlas, found, *ends)
    return found


def corridors(atlas: Map, route: Route) -> str:
    """The corridors that a route runs through, by the true poses of its places."""
    poses = [atlas.poses[place] for place in route.places]
    letters = [TOWN.corridors[round(pose.y / 100)] for pose in poses if pose]
    return "".join(letter for letter, after in zip(letters, [*letters[1:], ""], strict=True) if letter != after)


def test_a_route_crosses_over_where_paths_are_joined() -> None:
    """Corridors A and B on one walk, C, B and D on the other: from A to D, and from C to no end of A."""
    town = merged(one=[("A", 0, 30), ("B", 0, 30)], other=[("C", 0, 25), ("B", 0, 30), ("D", 0, 20)])
    found = routed(town, "one:0", "other:74")
    assert [leg.path for leg in found.legs] == ["one", "other"]
    assert corridors(town, found) == "ABD"
    assert found.length == pytest.approx(79, abs=1.5)
    assert legs_of(routed(town, "other:0", "other:74")) == [("other", 0, 74)]
    # Within the stretch that both share, either path's views name the same place.
    assert [leg.path for leg in routed(town, "other:0", "one:50").legs] == ["other"]
    with pytest.raises(NoRouteError):
        routed(town, "other:0", "one:10")


@pytest.mark.slow
def test_a_ring_of_three_is_driven_one_way_round() -> None:
    ring = merged(
        x=[("A", 0, 25), ("B", 0, 25)],
        y=[("B", 0, 25), ("C", 0, 25)],
        z=[("C", 0, 25), ("A", 0, 25)],
    )
    on = routed(ring, "x:10", "x:40")
    assert legs_of(on) == [("x", 10, 40)]
    assert on.length == pytest.approx(30)
    # The way back from B to A goes on round the ring, through C: by y, and by z once both of them see C.
    back = routed(ring, "x:40", "x:10")
    assert [leg.path for leg in back.legs] == ["y", "z"]
    assert corridors(ring, back) == "BCA"
    assert back.length == pytest.approx(75 - 30, abs=2.5)


def test_places_go_by_paths_and_views() -> None:
    atlas = atlas_of(([0, 1, 2, 3, 4, 5], [1.0] * 5), ([3, 3, 0], [1.0] * 2))
    assert [place_of(atlas, f"path-b:{view}") for view in range(3)] == [3, 3, 0]
    assert [place_of(atlas, f"path-b:{end}") for end in ("start", "end")] == [3, 0]
    assert [place_name(atlas, place) for place in range(PLACES)] == [f"path-a:{view}" for view in range(6)]
    turned = replace(atlas, paths=atlas.paths[::-1])
    assert [place_name(turned, place) for place in (0, 3, 5)] == ["path-b:2", "path-b:0", "path-a:5"]


def test_a_name_may_hold_a_colon() -> None:
    assert place_of(beside(named_maps(["9:30"], [WALK])), "9:30:7") == 7


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("path-a", "place 'path-a' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end"),
        ("path-a:", "place 'path-a:' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end"),
        (":3", "place ':3' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end"),
        (
            "path-a:middle",
            "place 'path-a:middle' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end",
        ),
        ("moon:end", "place 'moon:end': path 'moon' is unknown; valid are path-a, path-b"),
        ("path-a:3.5", "place 'path-a:3.5' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end"),
        (
            "path-a:\u0663",
            "place 'path-a:\u0663' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end",
        ),
        ("path\n:x", "place 'path\\n:x' is no PATH:VIEW; valid is a path and a view of it: path-a:0, path-a:end"),
        ("path-a:" + "1" * 5000, "is no PATH:VIEW"),
        ("moon:3", "place 'moon:3': path 'moon' is unknown; valid are path-a, path-b"),
        ("path-b:2", "place 'path-b:2': path 'path-b' has 2 views; valid is 0 to 1"),
        ("path-b:-1", "place 'path-b:-1': path 'path-b' has 2 views; valid is 0 to 1"),
    ],
)
def test_names_of_no_place_are_told(name: str, told: str) -> None:
    with pytest.raises(MapError) as caught:
        place_of(atlas_of(([0, 1, 2], [1.0] * 2), ([3, 4], [1.0])), name)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not isinstance(caught.value, NoRouteError)


@pytest.mark.parametrize(("start", "goal", "place"), [(-1, 0, -1), (0, 6, 6)])
def test_places_that_are_not_there_are_told(start: int, goal: int, place: int) -> None:
    with pytest.raises(MapError, match=f"place {place} is unknown; valid is 0 to 5"):
        shortest_route(atlas_of(([0, 1], [1.0])), start, goal)


@pytest.mark.parametrize("change", [-1.0, math.nan, math.inf])
def test_a_change_cannot_pay(change: float) -> None:
    with pytest.raises(MapError, match=f"change is {change} m; valid is 0 or more"):
        shortest_route(atlas_of(([0, 1], [1.0])), 0, 1, change=change)
