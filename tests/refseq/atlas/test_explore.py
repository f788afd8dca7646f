"""Exploring: a drive that leaves a map, goes round another corridor and comes back is one path, joined at both ends."""

from dataclasses import replace

import numpy as np
import pytest

from refseq import Map, MapError, add_drive, learn
from refseq.atlas.explore import explore
from refseq.atlas.merge import merge_maps
from refseq.map.profile import BEST
from refseq.view import View
from tests.support import corridor_drive

SENSORS = ("forward", "lateral")
BEFORE, SIDE, BEHIND = 17, 7, 17
"""Views along the map before the detour, on each side of the square that it is, and along the map behind it."""
LOOP = range(BEFORE, BEFORE + 4 * SIDE)


def pictured(count: int, first: int = 0, seed: int = 1) -> list[View]:
    """Views along the long corridor, from one of its views on."""
    views = corridor_drive(np.random.default_rng(seed), count=first + count, size=96)[first:]
    return [replace(view, scan=None) for view in views]


def detour() -> list[View]:
    """A drive that turns off the path at its middle, goes round a square, and comes back to where it left."""
    way, elsewhere = pictured(BEFORE + BEHIND, seed=2), pictured(len(LOOP), first=70)
    loop = [
        replace(view, turn=np.pi / 2 if n % SIDE == SIDE - 1 else 0.0) for n, view in enumerate(elsewhere)
    ]  # the step to each side's last view turns
    driven = [*way[:BEFORE], *loop, *way[BEFORE:]]
    return [replace(view, time=2.0 * n, distance=0.85 if n else 0.0, truth=None) for n, view in enumerate(driven)]


@pytest.fixture(scope="module")
def map_() -> Map:
    return learn(pictured(BEFORE + BEHIND), profile=BEST, sensors=SENSORS, name="way", features=["sift"])


def test_a_detour_becomes_a_path_that_is_joined_where_it_leaves_and_where_it_comes_back(map_: Map) -> None:
    (one,) = explore(map_, detour(), name="detour")
    assert one.map.names == ("detour-1",)
    assert set(one.astray.views) <= set(LOOP), "along the map it is known where it is"
    # Before its return hindsight may think it back already: the path has the whole way all the same.
    assert one.astray.metres > 0.85 * len(LOOP) / 2
    assert one.astray.path.start <= LOOP.start - 5
    assert one.astray.path.stop >= LOOP.stop + 5
    assert one.map.sequence.matrix.N > 0
    assert [e.key for e in one.map.sequence.extractors] == [e.key for e in map_.sequence.extractors]
    merged = merge_maps([map_, one.map])
    joined = [decision for decision in merged.decisions if decision.joined]
    start = one.astray.path.start
    for decision in joined:
        for way, path in zip(decision.first, decision.second, strict=True):
            view = path + start
            there = view if view < LOOP.start else view - len(LOOP)
            assert abs(way - there) <= 1, "a join leads to the view's own place"
    assert len(joined) == 2
    assert len(merged.map) < len(map_) + len(one.map)


def test_a_stretch_in_which_a_camera_was_away_is_learnt_from_the_others(map_: Map) -> None:
    first, *others = detour()
    drive = [first, *(replace(view, images={"forward": view.images["forward"]}) for view in others)]
    (one,) = explore(map_, drive, name="detour")
    assert one.astray.path.start > 0, "the camera was there before the stretch alone"
    blocks = one.map.sequence.matrix.blocks
    assert len(blocks["sift/forward"]) > len(blocks["sift/lateral"]) == 0
    assert merge_maps([map_, one.map]).map.names == ("way", "detour-1"), "its sensors are those of the map"


def test_a_drive_along_the_map_makes_no_path(map_: Map) -> None:
    assert explore(map_, pictured(BEFORE + BEHIND, seed=3)) == []
    assert add_drive(map_, pictured(BEFORE + BEHIND, seed=3)).astray == ()


def test_growing_tells_where_a_drive_leaves_the_map(map_: Map) -> None:
    (one,) = add_drive(map_, detour()).astray
    assert abs(one.views.start - LOOP.start) <= 1


def test_a_drive_that_the_map_cannot_know_is_refused(map_: Map) -> None:
    blind = [replace(view, images={"forward": view.images["forward"]}) for view in detour()]
    with pytest.raises(MapError, match="has no lateral"):
        explore(map_, blind)
