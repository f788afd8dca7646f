"""What a path remembers for missions: doors in scans of known floors, and behaviours that survive files and merging."""

import json
import math
import zipfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.atlas.atlas import Atlas, beside
from refseq.atlas.file import load_atlas, save_atlas
from refseq.atlas.merge import merge
from refseq.errors import MapError
from refseq.features.doors import find_doors
from refseq.logs import RecordingWriter, read_recording
from refseq.map.annotations import LANDMARK, SIGHTINGS, Guide, PathDoor, Side, doors_along, guide_of
from refseq.map.file import load_map, save_map
from refseq.map.profile import BEST
from refseq.map.reduction import reduced
from refseq.map.sequence import ReferenceSequence, learn
from refseq.planar import Pose, motion_between
from refseq.view import View
from tests.refseq.floors import Leaf, wall_with_doors
from tests.refseq.rooms import Wall, cast
from tests.support import corridor_drive

LENGTH = 20.0
doors = st.builds(PathDoor, st.floats(-5, 500), st.sampled_from(Side), st.floats(0.1, 3), st.booleans())
words = st.sampled_from(["", "MN:8", "MT:90", "MC:left", "MW:left,0.6"])
guides = st.builds(Guide, st.lists(words, max_size=12).map(tuple), st.lists(doors, max_size=4).map(tuple))


# --- doors in scans ---


def corridor(left: Sequence[tuple[float, Leaf]] = (), right: Sequence[tuple[float, Leaf]] = ()) -> list[Wall]:
    """A corridor of 20 m along x, 2.4 m wide, with doors of 0.9 m about some x, and rooms of 3 m behind its walls."""
    on_left = sorted((LENGTH - x - 0.45, LENGTH - x + 0.45, leaf) for x, leaf in left)
    on_right = sorted((x - 0.45, x + 0.45, leaf) for x, leaf in right)
    walls, _ = wall_with_doors((LENGTH, 1.2, 0.0, 1.2), on_left, 0.15)
    more, _ = wall_with_doors((0.0, -1.2, LENGTH, -1.2), on_right, 0.15)
    ends = [(0.0, -1.2, 0.0, 1.2), (LENGTH, -1.2, LENGTH, 1.2), (0.0, 4.2, LENGTH, 4.2), (0.0, -4.2, LENGTH, -4.2)]
    return [*walls, *more, *ends]


def drive(
    walls: Sequence[Wall], scanner: float = 0.0, step: float = 0.85, told: dict[int, str] | None = None
) -> list[View]:
    """A drive along the middle from x = 1 to 18.5 m; the laser is so far ahead of the robot [m]."""
    rng = np.random.default_rng(1)
    xs = np.arange(1.0, 18.5, step)
    poses = [Pose(float(x), 0.15 * math.sin(x / 3), 0.05 * math.cos(x / 3)) for x in xs]
    views = []
    for number, pose in enumerate(poses):
        distance, turn = motion_between(poses[number - 1], pose) if number else (0.0, 0.0)
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        at = Pose(pose.x + scanner * cos, pose.y + scanner * sin, pose.heading)
        scan = cast(walls, at, rng=rng)
        views.append(
            View(
                2.0 * number,
                scan=scan,
                distance=distance,
                turn=turn,
                truth=pose,
                behaviour=(told or {}).get(number, ""),
            )
        )
    return views


@pytest.mark.parametrize("scanner", [0.0, 0.25])
def test_doors_are_found_where_they_are(scanner: float) -> None:
    """Open and closed ones on both sides; along is where the laser, so far ahead of the robot, is abreast of each."""
    left = [(5.0, Leaf.OPEN), (9.5, Leaf.CLOSED), (14.0, Leaf.NONE)]
    right = [(7.0, Leaf.NONE), (11.0, Leaf.OPEN)]
    found = doors_along(drive(corridor(left, right), scanner))
    true = [(x, Side.LEFT, leaf) for x, leaf in left] + [(x, Side.RIGHT, leaf) for x, leaf in right]
    for x, side, leaf in true:
        (one,) = [door for door in found if abs(door.along + 1.0 + scanner - x) < 0.3 and door.side is side]
        assert one.width == pytest.approx(0.9, abs=0.1)
        assert one.passable == (leaf is not Leaf.CLOSED)
    beside_the_way = [door for door in found if door.side is not Side.AHEAD]
    assert len(beside_the_way) == len(true)
    assert [door.along for door in found] == sorted(door.along for door in found)


def test_a_corridor_without_doors_has_none() -> None:
    assert [door for door in doors_along(drive(corridor())) if door.side is not Side.AHEAD] == []


def test_a_door_that_the_way_leads_through_is_ahead() -> None:
    wall, _ = wall_with_doors((10.0, -1.2, 10.0, 1.2), [(0.75, 1.65, Leaf.NONE)], 0.15)
    views = drive([*corridor(), *wall])
    ahead = [door for door in doors_along(views) if door.side is Side.AHEAD]
    assert [door.along + 1.0 for door in ahead] == [pytest.approx(10.0, abs=0.3)]
    assert ahead[0].passable


def test_what_one_view_shows_alone_is_no_door() -> None:
    views = drive(corridor([(9.0, Leaf.NONE)]))
    showing = [k for k, view in enumerate(views) if view.scan is not None and find_doors(view.scan, LANDMARK)]
    first = next(k for k in showing if k + 1 in showing)
    for count in (0, 1, SIGHTINGS):
        seen = range(first, first + count)
        shown = [view if k in seen else replace(view, scan=None) for k, view in enumerate(views)]
        assert len(doors_along(shown)) == (count >= SIGHTINGS)


def test_a_guide_holds_what_views_tell() -> None:
    views = drive(corridor([(9.0, Leaf.NONE)]), told={0: "MN:5", 6: "MT:90"})
    guide = guide_of(views)
    assert {k: one for k, one in enumerate(guide.behaviours) if one} == {0: "MN:5", 6: "MT:90"}
    assert len(guide.behaviours) == len(views)
    assert list(guide.doors) == doors_along(views)
    assert guide_of(drive(corridor())).behaviours == ()


# --- kept, counted, written ---


@given(guides)
def test_a_guide_goes_through_json(guide: Guide) -> None:
    assert Guide.from_dict(json.loads(json.dumps(guide.to_dict()))) == guide


@given(st.lists(words, min_size=1, max_size=12), st.data())
def test_of_places_that_go_behaviours_begin_at_the_next(told: list[str], data: st.DataObject) -> None:
    """At each place that is left, the behaviour in force is the one that was in force there before."""
    places = sorted(data.draw(st.sets(st.integers(0, len(told) - 1), min_size=1)))
    kept = Guide(tuple(told)).kept(np.array(places)).behaviours
    assert len(kept) == len(places)
    for number, place in enumerate(places):
        assert in_force(kept, number) == in_force(tuple(told), place)
    every = np.arange(len(told))
    assert Guide(tuple(told)).kept(every) == Guide(tuple(told))
    assert Guide((), (PathDoor(1.0, Side.LEFT, 0.9, True),)).kept(np.array(places)).behaviours == ()


def in_force(told: tuple[str, ...], place: int) -> str:
    return next((one for one in reversed(told[: place + 1]) if one), "")


@given(guides, st.floats(-50, 50))
def test_a_path_that_begins_later_is_counted_from_there(guide: Guide, start: float) -> None:
    later = guide.since(start)
    assert later.behaviours == guide.behaviours
    assert [door.along + start for door in later.doors] == pytest.approx([door.along for door in guide.doors])
    assert guide.since(0.0) == guide


# --- recordings, maps, atlases ---


def told_drive(count: int = 30) -> list[View]:
    views = corridor_drive(np.random.default_rng(1), count=count, size=96)
    views[0] = replace(views[0], behaviour="MN:12")
    views[count // 2] = replace(views[count // 2], behaviour="MW:left,0.6,8")
    return views


@pytest.fixture(scope="module")
def sequence() -> ReferenceSequence:
    views = told_drive(12)
    learnt = learn(views, profile=BEST, features=("walls", "sectors"))
    door = PathDoor(3.25, Side.RIGHT, 0.9, False)
    return replace(learnt, guide=replace(learnt.guide, doors=(door,)))


@pytest.fixture(scope="module")
def halves() -> list[ReferenceSequence]:
    views = told_drive()
    return [learn(part, profile=BEST) for part in (views[:20], views[10:])]


def test_recordings_keep_behaviours(tmp_path: Path) -> None:
    views = told_drive(6)
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        for number, view in enumerate(views):
            writer.write(view, Pose(0.85 * number, 0.0, 0.0))
    read = read_recording(tmp_path / "drive.mcap")
    assert [view.behaviour for view in read.views] == [view.behaviour for view in views]
    assert not read.skipped


def test_maps_keep_their_guide(sequence: ReferenceSequence, tmp_path: Path) -> None:
    save_map(sequence, tmp_path / "map.refseq")
    assert load_map(tmp_path / "map.refseq").guide == sequence.guide
    assert sequence.guide.behaviours[0] == "MN:12"
    less = reduced(sequence, np.array([0, 1, 5, 8, 11]))
    assert less.guide.behaviours == ("MN:12", "", "", "MW:left,0.6,8", "")
    assert less.guide.doors == sequence.guide.doors


def test_a_merged_atlas_keeps_the_guide_of_each_path(halves: list[ReferenceSequence], tmp_path: Path) -> None:
    atlas = merge(["first", "second"], halves).atlas
    assert len(atlas) < sum(map(len, halves)), "something was merged"
    assert [path.guide for path in atlas.paths] == [half.guide for half in halves]
    assert [path.guide.behaviours[0] for path in atlas.paths] == ["MN:12", ""]
    save_atlas(atlas, tmp_path / "atlas.refseq")
    assert [path.guide for path in load_atlas(tmp_path / "atlas.refseq").paths] == [half.guide for half in halves]
    save_map(halves[0], tmp_path / "map.refseq")
    assert load_atlas(tmp_path / "map.refseq").paths[0].guide == halves[0].guide


def rewritten(path: Path, name: str, key: str, value: object) -> None:
    """Change an entry of the header, or drop it: None."""
    with zipfile.ZipFile(path) as archive:
        members = {member: archive.read(member) for member in archive.namelist()}
    header = json.loads(members[name])
    header.pop(key)
    members[name] = json.dumps(header if value is None else header | {key: value}).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for member, content in members.items():
            archive.writestr(member, content)


def error_of(path: Path) -> str:
    with pytest.raises(MapError) as caught:
        load_atlas(path)
    return str(caught.value)


def door(**changes: object) -> dict[str, object]:
    return {"behaviours": [], "doors": [{"along": 1.0, "side": "left", "width": 0.9, "passable": True} | changes]}


DAMAGED = [
    (3, "guide is no table of behaviours and doors"),
    ("", "guide is no table of behaviours and doors"),
    ({"doors": []}, "guide is no table of behaviours and doors"),
    ({"behaviours": "MN", "doors": []}, "guide: behaviours are no list of texts"),
    ({"behaviours": [1], "doors": []}, "guide: behaviours are no list of texts"),
    ({"behaviours": ["MN"], "doors": []}, "guide: 1 behaviours for 12 places"),
    ({"behaviours": [], "doors": {}}, "guide: doors are no list"),
    ({"behaviours": [], "doors": [{}]}, "guide: a door is no table of along, side, width and passable"),
    (door(along="far"), "guide: a door's along and width are no numbers"),
    (door(along=math.nan), "guide: a door's along and width are no numbers"),
    (door(width=10**400), "guide: a door's along and width are no numbers"),
    (door(width=None), "guide: a door's along and width are no numbers"),
    (door(side="up"), "'up' is not a valid Side"),
    (door(side=["left"]), "['left'] is not a valid Side"),
    (door(passable="no"), "guide: a door's passable is 'no'; valid is true or false"),
]


@pytest.mark.parametrize(("value", "told"), DAMAGED)
def test_damaged_guides(sequence: ReferenceSequence, tmp_path: Path, value: object, told: str) -> None:
    path = tmp_path / "map.refseq"
    save_map(sequence, path)
    rewritten(path, "map.json", "guide", value)
    assert error_of(path) == f"{path}: map.json and arrays do not make a map: {told}"
    save_atlas(beside(["a"], [sequence]), path)
    rewritten(path, "atlas.json", "guides", [value])
    assert error_of(path) == f"{path}: atlas.json and members do not make an atlas: {told}"


@pytest.mark.parametrize("value", ["all", {"a": 1}, [None]])
def test_damaged_guides_of_an_atlas(sequence: ReferenceSequence, tmp_path: Path, value: object) -> None:
    path = tmp_path / "atlas.refseq"
    save_atlas(beside(["a", "b"], [sequence, sequence]), path)
    rewritten(path, "atlas.json", "guides", value)
    message = error_of(path)
    assert message.startswith(f"{path}: atlas.json and members do not make an atlas: guide")
    assert "\n" not in message


def test_files_from_before_there_were_guides(sequence: ReferenceSequence, tmp_path: Path) -> None:
    path = tmp_path / "map.refseq"
    save_map(sequence, path)
    rewritten(path, "map.json", "guide", None)
    assert load_map(path).guide == Guide()
    save_atlas(beside(["a"], [sequence]), path)
    rewritten(path, "atlas.json", "guides", None)
    loaded: Atlas = load_atlas(path)
    assert loaded.paths[0].guide == Guide()
    np.testing.assert_array_equal(loaded.paths[0].along, sequence.along)
