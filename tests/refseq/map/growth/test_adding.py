"""Adding drives to a map: what is kept, what it brings, what is forgotten, and what is refused."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq import Map, MapError, Stage, add_drive, learn, localise
from refseq.atlas.merge import merge_maps
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.growth.adding import (
    Grown,
    GrowthSettings,
    _check_walls,
    _placed,
    _PlacedView,
    _remembered,
    _stretch,
    check_drive,
)
from refseq.map.growth.experiences import Experiences
from refseq.map.growth.seen import seen_drive
from refseq.map.profile import BEST
from refseq.map.reduction import reduced
from refseq.view import LASER, View
from tests.refseq.rooms import bits_drive, bits_map, cast, rectangle, without
from tests.support import CAMERAS, CountedImages, corridor_drive, texture

COUNT, SPACING = 28, 0.85
CHANGED = range(10, 17)
"""Views at which later drives meet other pictures on the walls."""


def drive(seed: int, change: int = 0) -> list[View]:
    """A drive whose pictures are others in the middle; ``change`` says which, 0 for those of the first drive."""
    views = corridor_drive(np.random.default_rng(seed), count=COUNT, spacing=SPACING, size=96)
    if not change:
        return views
    return [
        replace(view, images=pictures(n + 200 * change), scan=None if n % 2 else view.scan) if n in CHANGED else view
        for n, view in enumerate(views)
    ]


def pictures(number: int) -> dict[str, NDArray[np.uint8]]:
    """Pictures of the cameras so many views along the corridor."""
    return {name: texture(number * SPACING, 96, 1.0, i) for i, name in enumerate(CAMERAS)}


@pytest.fixture(scope="module")
def map_() -> Map:
    return learn(drive(1), profile=BEST, sensors=["forward", "lateral"], name="way")


@pytest.fixture(scope="module")
def walled() -> Map:
    """A map of all sensors, which has the walls."""
    return learn(drive(1), profile=BEST, name="way")


@pytest.fixture(scope="module")
def grown(map_: Map) -> Grown:
    return add_drive(map_, drive(2, 1), name="later.mcap")


def found_alone(map_: Map, views: Sequence[View]) -> int:
    """Number of the changed views that find their place by themselves."""
    beliefs = localise(map_, [views[n] for n in CHANGED], stages=[Stage.UNIFORM])[Stage.UNIFORM]
    return sum(abs(belief.best - n) <= 1 and belief.lost < 0.5 for n, belief in zip(CHANGED, beliefs, strict=True))


def test_what_was_not_recognised_is_kept_at_its_place_and_then_is(map_: Map, grown: Grown) -> None:
    assert grown.placed >= 0.8 * COUNT
    kept = {view for view, _ in grown.kept}
    assert kept <= set(CHANGED), "all else was recognised well"
    assert len(kept) >= len(CHANGED) - 2
    assert all(abs(view - place) <= 1 for view, place in grown.kept)
    assert found_alone(map_, drive(3, 1)) <= 2
    assert found_alone(grown.map, drive(3, 1)) >= len(kept)
    assert found_alone(grown.map, drive(3)) >= len(CHANGED) - 1, "what was learnt first is not lost"
    assert len(grown.map) == len(map_)
    assert len(map_.grown.drives) == 0, "the map given stays as it is"


def stretched(views: Sequence[View], scale: float) -> list[View]:
    """A drive by an odometer of another scale."""
    return [replace(view, distance=view.distance * scale) for view in views]


@pytest.mark.quick_cases("1.1")
@pytest.mark.parametrize("scale", [0.9, 1.0, 1.1])
def test_an_odometer_of_another_scale_is_absorbed_and_told(map_: Map, scale: float) -> None:
    added = add_drive(map_, stretched(drive(2), scale))
    assert added.placed >= 0.8 * COUNT
    assert added.stretch == pytest.approx(scale, abs=0.03)


def test_a_jump_of_the_odometer_is_no_scale(map_: Map) -> None:
    """It went 20 m from one view to the next one, and 1.1 m for each of the map's everywhere else."""
    views = stretched(drive(2), 1.1)
    views[7] = replace(views[7], distance=20.0)
    placed = [_PlacedView(number, number, 1.0, well=True) for number in range(COUNT)]
    assert _stretch(map_, views, placed) == pytest.approx(1.1, abs=0.02)


@pytest.mark.quick_cases("1.4")
@pytest.mark.parametrize("wider", [1.4, 6.0])
def test_a_drive_between_other_walls_is_refused_though_it_looks_alike(walled: Map, wider: float) -> None:
    """The same pictures on the walls of a wider corridor: scans lie badly there, or not at all."""
    assert add_drive(walled, drive(2)).placed >= 0.8 * COUNT
    elsewhere = [
        replace(view, scan=replace(view.scan, ranges=np.float32(wider) * view.scan.ranges))
        for view in drive(2)
        if view.scan
    ]
    anywhere = GrowthSettings(placed=0.0, sure=0.0)
    with pytest.raises(
        MapError, match=rf"views, of which {COUNT} look like places of it, but 0 of {COUNT} lie on their walls"
    ):
        add_drive(walled, elsewhere, settings=anywhere)


def test_the_look_at_walls_asks_for_no_picture(walled: Map) -> None:
    rules, asked = GrowthSettings(), list[str]()
    placed = _placed(walled, seen_drive(walled, drive(2), 0), rules)
    assert len(placed) >= 0.8 * COUNT
    counted = [replace(view, images=CountedImages(view.images, asked)) for view in drive(2)]
    _check_walls(walled, counted, placed, rules)
    assert asked == []


def test_the_same_drive_adds_nothing_the_second_time(grown: Grown) -> None:
    again = add_drive(grown.map, drive(2, 1), name="copy.mcap")
    assert again.known
    assert again.map.to_bytes() == grown.map.to_bytes()
    assert again.drive.name == "later.mcap"


def test_a_drive_that_is_recognised_well_adds_no_experience(map_: Map) -> None:
    added = add_drive(map_, drive(2))
    assert len(added.kept) <= 2
    assert added.drive.kept == len(added.kept)
    assert not added.known


def test_a_grown_map_is_the_same_when_read_again(grown: Grown, tmp_path) -> None:
    grown.map.save(tmp_path / "grown.refseq")
    loaded = Map.load(tmp_path / "grown.refseq")
    assert loaded.to_bytes() == grown.map.to_bytes()
    assert loaded.grown == grown.map.grown
    later = drive(3, 1)[8:18]
    for one, other in zip(*(localise(m, later)[Stage.CHAIN] for m in (loaded, grown.map)), strict=True):
        np.testing.assert_array_equal(one.places, other.places)


def test_an_experience_is_used_by_a_drive_that_it_knows_best_and_by_no_other(grown: Grown) -> None:
    """A drive that sees what was learnt first uses none of them, one that sees what came later nearly all.

    One that meets other walls again uses none either, though of two that do not know a view one is always the better.
    """
    uses = []
    for changed in (0, 1, 2):
        experiences = add_drive(grown.map, drive(3, changed)).map.sequence.experiences
        assert experiences is not None
        uses.append(experiences.uses[: len(grown.kept)])
    assert uses[0].tolist() == uses[2].tolist() == [0] * len(grown.kept)
    assert uses[1].max() == 1
    assert uses[1].mean() > 0.7


@pytest.mark.parametrize(
    ("uses", "most", "stay"),
    [
        ((0, 0, 0, 0), 4, [0, 1, 2, 3]),
        ((5, 1, 2, 0), 2, [0, 3]),  # the newest has had no time to be used
        ((5, 1, 2, 0), 3, [0, 2, 3]),
        ((1, 0, 1, 0), 2, [2, 3]),  # of equally used ones the later
        ((0, 0, 0, 0), 3, [1, 2, 3]),
        ((5, 5, 5, 0), 1, [3]),
    ],
)
def test_the_newest_and_the_most_used_experiences_stay(uses: tuple[int, ...], most: int, stay: list[int]) -> None:
    """Those of another place, of which there is room for all, lie between."""
    places = np.array([4, 9, 4, 4, 4])
    counts = np.insert(uses, 1, 0)
    empty = IncidenceMatrix.from_columns([{} for _ in places], {"bits/a": 1})
    stays = _remembered(Experiences(empty, places, counts), most)
    assert stays.tolist() == sorted([1, *np.flatnonzero(places == 4)[stay].tolist()])


@pytest.mark.slow
def test_the_least_used_experience_makes_room(map_: Map) -> None:
    rules = GrowthSettings(most=2)
    larger, sizes = map_, []
    for seed, change in ((2, 1), (3, 2), (4, 1)):
        larger = add_drive(larger, drive(seed, change), settings=rules).map
    experiences = larger.sequence.experiences
    assert experiences is not None
    both = np.isin(experiences.places, np.flatnonzero(np.bincount(experiences.places) == 2)) & (experiences.ranks == 0)
    assert (experiences.uses[both] > 0).mean() > 0.7, "the third drive used those of the first"
    for seed, change in ((5, 3), (6, 4), (7, 5)):
        added = add_drive(larger, drive(seed, change), settings=rules)
        larger = added.map
        assert added.forgotten > 0
        sizes.append(len(larger.to_bytes()))
    experiences = larger.sequence.experiences
    assert experiences is not None
    assert np.bincount(experiences.places).max() == 2
    assert max(sizes) < 1.2 * min(sizes), "a full map does not grow any more"
    first, last, between = (found_alone(larger, drive(8, change)) for change in (1, 5, 3))
    assert min(first, last) >= 4, f"what was used is remembered ({first}), and what came last ({last})"
    assert between < min(first, last) - 1, f"what nothing used is forgotten ({between})"


def test_places_taken_out_of_a_sequence_take_their_experiences_with_them(grown: Grown) -> None:
    sequence = grown.map.sequence
    assert sequence.experiences is not None
    left = reduced(sequence, np.arange(16))
    assert left.experiences is not None
    assert left.experiences.places.max() < 16
    assert left.matrix.N == left.experiences.matrix.N < sequence.matrix.N
    shown = np.diff(left.matrix.pointers) + np.diff(left.experiences.matrix.pointers)
    words = shown[: left.matrix.blocks["sift/forward"].stop]
    assert (words > 0).all()


def test_a_path_whose_experiences_are_all_given_to_another_can_be_read_and_grows(grown: Grown, tmp_path: Path) -> None:
    short = learn(drive(1)[6:25], profile=BEST, sensors=["forward", "lateral"], name="short")
    merged = merge_maps([short, grown.map]).map
    assert [len(one.experiences or ()) for one in merged.sequences] == [0, 0]
    merged.save(tmp_path / "whole.refseq")
    again = add_drive(Map.load(tmp_path / "whole.refseq"), drive(3, 2))
    assert len(again.kept) > 0


def between_cupboards(views: Sequence[View]) -> list[View]:
    """A drive whose scans tell its places: cupboards of many sizes stand along both walls, from 0.2 to 1.5 m apart."""
    rng = np.random.default_rng(0)
    walls = rectangle(0, -1.2, 102, 1.2)
    for side in (-1, 1):
        x = 0.5
        while x < COUNT * SPACING + 4:
            wide, deep = rng.uniform(0.3, 1.2), rng.uniform(0.1, 0.6)
            walls += rectangle(x, side * 1.2, x + wide, side * (1.2 - deep))
            x += wide + rng.uniform(0.2, 1.5)
    return [replace(view, scan=cast(walls, view.truth)) for view in views if view.truth is not None]


@pytest.mark.quick_cases("forward")
@pytest.mark.parametrize("sensor", ["forward", LASER])
def test_an_ill_camera_that_the_map_does_not_ask_does_not_keep_a_drive_from_it(sensor: str) -> None:
    map_ = learn(between_cupboards(drive(1)), profile=BEST, sensors=[sensor], name="way")
    seen = between_cupboards(drive(2))
    covered = [
        replace(view, images={name: one if name == sensor else np.zeros_like(one) for name, one in view.images.items()})
        for view in seen
    ]
    assert add_drive(map_, covered).placed == add_drive(map_, seen).placed > 0.8 * COUNT


def test_an_atlas_grows_along_all_its_paths() -> None:
    views = drive(1)
    parts = [
        learn(part, profile=BEST, sensors=["forward", "lateral"], name=name)
        for name, part in (("west", views[:20]), ("east", views[8:]))
    ]
    atlas = merge_maps(parts).map
    assert len(atlas) < 2 * 20
    added = add_drive(atlas, drive(2, 1))
    places = np.concatenate([atlas.numbered(path) for path in atlas.paths])
    views_of = {int(place): number for place, number in zip(places, [*range(20), *range(8, COUNT)], strict=True)}
    assert len(added.kept) >= len(CHANGED) - 3
    assert all(abs(views_of[place] - view) <= 1 for view, place in added.kept)
    assert add_drive(added.map, drive(2, 1)).map is added.map
    again = merge_maps([added.map]).map
    assert again.grown == added.map.grown
    assert sum(len(s.experiences or ()) for s in again.sequences) == len(added.kept)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda m, v: (m, v[:1]), "the drive has 1 view over 0.0 m; valid is a way of 3 m"),
        (
            lambda m, v: (m, []),
            "the drive has no forward; valid are drives with all sensors of the map, forward, lateral",
        ),
        (
            lambda m, v: (m, [without(one, "lateral") for one in v]),
            "the drive has no lateral; valid are drives with all sensors",
        ),
        (lambda m, v: (m, v[::-1]), r"the drive has 28 views, of which \d+ are found on the map; valid is a drive"),
        (lambda m, v: (learn(v, sensors=[LASER]), v), "its matching is mixture, which takes no further experiences"),
    ],
)
def test_a_drive_that_cannot_be_added_is_told_in_a_line(map_: Map, change, told: str) -> None:
    asked, views = change(map_, drive(1))
    with pytest.raises(MapError, match=told) as raised:
        add_drive(asked, views)
    assert "\n" not in str(raised.value)


def test_a_drive_of_another_robot_is_told(map_: Map) -> None:
    ours = map_.noted({"robot": "robuter"})
    with pytest.raises(MapError, match="the drive is of robot segway-rmp; valid is that of the map, robuter"):
        add_drive(ours, drive(2), metadata={"robot": "segway-rmp"})
    assert not add_drive(ours, drive(2), metadata={"robot": "robuter"}).known


def test_a_map_of_two_robots_takes_drives_of_both_and_of_no_third(map_: Map) -> None:
    ours, rules = map_.noted({"robot": "robuter, segway-rmp"}), GrowthSettings()
    for robot in ("robuter", "segway-rmp", ""):
        check_drive(ours, drive(2), {"robot": robot}, rules)
    for robot in ("rob", "robuter, segway"):
        with pytest.raises(MapError, match=f"of robot {robot}; valid is that of the map, robuter, segway-rmp"):
            check_drive(ours, drive(2), {"robot": robot}, rules)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"sure": 2.0}, "sure is 2.0"),
        ({"most": 0}, "0 experiences"),
        ({"most": 1.5}, "1.5 experiences of a place are to be kept; valid is a whole number from 1"),
        ({"near": float("nan")}, "near is nan; valid are metres, 0 or more"),
        ({"least": -1.0}, "least is -1.0; valid are metres, 0 or more"),
    ],
)
def test_wrong_rules_are_told(wrong: dict[str, float], told: str) -> None:
    with pytest.raises(MapError, match=told):
        GrowthSettings(**wrong)  # type: ignore[arg-type]


def rounds(seed: int, count: int) -> list[View]:
    """A corridor of 30 places that is driven along so many times."""
    rng = np.random.default_rng(seed)
    seen = np.random.default_rng(0).random((30, 150)) < 0.12
    return bits_drive({"a": np.vstack([seen ^ (rng.random(seen.shape) < 0.01) for _ in range(count)])})


def looped() -> Map:
    """A map of two rounds whose places are known to be one."""
    map_ = bits_map(rounds(1, 2), BEST)
    loops = np.column_stack([np.arange(30), np.arange(30, 60)])
    return replace(map_, paths=(replace(map_.paths[0], loops=loops),))


def test_a_drive_along_a_loop_is_placed_though_two_places_share_its_belief() -> None:
    once, twice = bits_map(rounds(1, 1), BEST), looped()
    shared = localise(twice, rounds(2, 1), stages=[Stage.CHAIN])[Stage.CHAIN]
    assert np.median([belief.places.max() for belief in shared]) < 0.6
    for map_ in (once, twice):
        assert len(_placed(map_, seen_drive(map_, rounds(2, 1), 0), GrowthSettings())) == 30


def test_along_a_loop_an_odometer_tells_its_scale() -> None:
    beliefs = localise(looped(), stretched(rounds(2, 1), 1.25), stages=[Stage.CHAIN])[Stage.CHAIN]
    assert beliefs[-1].odometer_scale == pytest.approx(0.8, abs=0.05)
