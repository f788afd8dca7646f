"""Annotations of a path for missions: doors in scans of known floors, and behaviours that survive files and merging."""

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

from refseq.atlas.merge import merge
from refseq.atlas.overlap import OverlapSettings
from refseq.errors import MapError
from refseq.features.doors import find_doors
from refseq.logs import RecordingWriter, read_recording
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.paths.annotations import (
    LANDMARK,
    SIGHTINGS,
    Annotations,
    DoorSide,
    PathDoor,
    annotations_of,
    doors_along,
)
from refseq.map.paths.led import led_behaviours
from refseq.map.profile import BEST
from refseq.planar import Pose, motion_between
from refseq.view import View
from tests.refseq.floors import Leaf, wall_with_doors
from tests.refseq.rooms import Wall, cast, named_maps, rectangle
from tests.support import corridor_drive, texture

LENGTH = 20.0
doors = st.builds(PathDoor, st.floats(-5, 500), st.sampled_from(DoorSide), st.floats(0.1, 3), st.booleans())
words = st.sampled_from(["", "MN:8", "MT:90", "MC:left", "MW:left,0.6"])
annotations = st.builds(Annotations, st.lists(words, max_size=12).map(tuple), st.lists(doors, max_size=4).map(tuple))


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
    true = [(x, DoorSide.LEFT, leaf) for x, leaf in left] + [(x, DoorSide.RIGHT, leaf) for x, leaf in right]
    for x, side, leaf in true:
        (one,) = [door for door in found if abs(door.along + 1.0 + scanner - x) < 0.3 and door.side is side]
        assert one.width == pytest.approx(0.9, abs=0.05)
        assert one.passable == (leaf is not Leaf.CLOSED)
    beside_the_way = [door for door in found if door.side is not DoorSide.AHEAD]
    assert len(beside_the_way) == len(true)
    assert [door.along for door in found] == sorted(door.along for door in found)


def test_a_corridor_without_doors_has_none() -> None:
    assert [door for door in doors_along(drive(corridor())) if door.side is not DoorSide.AHEAD] == []


def radiator(x: float, length: float) -> list[Wall]:
    """A thing along the right wall of the corridor that stands 0.09 m before it."""
    return rectangle(x, -1.2, x + length, -1.11)


@pytest.mark.parametrize(("width", "doors"), [(0.55, 0), (0.62, 0), (0.8, 1)])
def test_a_gap_between_things_along_a_wall_is_a_door_where_it_is_as_wide(width: float, doors: int) -> None:
    """Behind their faces the wall between two of them looks as a closed leaf does."""
    walls = [*corridor(), *radiator(7.8, 1.2), *radiator(9.0 + width, 1.2)]
    assert len([door for door in doors_along(drive(walls)) if door.side is DoorSide.RIGHT]) == doors


def test_the_wall_behind_the_end_of_a_thing_is_no_door() -> None:
    """A line that is fitted to its face and to some of the wall meets the wall farther on: 0.6 m here."""
    walls = [*corridor(), *radiator(9.0, 3.0)]
    assert [door for door in doors_along(drive(walls)) if door.side is DoorSide.RIGHT] == []


def test_a_door_that_the_way_leads_through_is_ahead() -> None:
    wall, _ = wall_with_doors((10.0, -1.2, 10.0, 1.2), [(0.75, 1.65, Leaf.NONE)], 0.15)
    views = drive([*corridor(), *wall])
    ahead = [door for door in doors_along(views) if door.side is DoorSide.AHEAD]
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
    found = annotations_of(views)
    assert {k: one for k, one in enumerate(found.behaviours) if one} == {0: "MN:5", 6: "MT:90"}
    assert len(found.behaviours) == len(views)
    assert list(found.doors) == doors_along(views)
    assert annotations_of(drive(corridor())).behaviours == led_behaviours(drive(corridor())), "a person led"


# --- kept, counted, written ---


@given(annotations)
def test_annotations_go_through_json(told: Annotations) -> None:
    assert Annotations.from_dict(json.loads(json.dumps(told.to_dict()))) == told


# --- recordings, maps, atlases ---


def test_a_map_without_the_laser_has_nothing_that_it_saw() -> None:
    views = [
        replace(view, images={"forward": texture(k, 96, 1.0, 0)})
        for k, view in enumerate(drive(corridor([(9.0, Leaf.NONE)])))
    ]
    both, blind = (learn(views, features=["dense"], sensors=sensors).paths[0] for sensors in (None, ["forward"]))
    assert both.annotations.doors
    assert blind.annotations == annotations_of([replace(view, scan=None) for view in views])
    assert blind.annotations.doors == ()
    assert blind.annotations.behaviours != both.annotations.behaviours, "no wall is kept to"


def told_drive(count: int = 30) -> list[View]:
    views = corridor_drive(np.random.default_rng(1), count=count, size=96)
    views[0] = replace(views[0], behaviour="MN:12")
    views[count // 2] = replace(views[count // 2], behaviour="MW:left,0.6,8")
    return views


@pytest.fixture(scope="module")
def learnt() -> Map:
    map_ = learn(told_drive(12), profile=BEST, features=("walls", "sectors"))
    (path,) = map_.paths
    told = replace(path.annotations, doors=(PathDoor(3.25, DoorSide.RIGHT, 0.9, False),))
    return replace(map_, paths=(replace(path, annotations=told),))


@pytest.fixture(scope="module")
def halves() -> list[Map]:
    views = told_drive()
    return named_maps(["first", "second"], [learn(part, profile=BEST) for part in (views[:20], views[10:])])


def test_recordings_keep_behaviours(tmp_path: Path) -> None:
    views = told_drive(6)
    with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
        for number, view in enumerate(views):
            writer.write(view, Pose(0.85 * number, 0.0, 0.0))
    read = read_recording(tmp_path / "drive.mcap")
    assert [view.behaviour for view in read.views] == [view.behaviour for view in views]
    assert not read.skipped


def test_maps_keep_their_annotations(learnt: Map, tmp_path: Path) -> None:
    learnt.save(tmp_path / "map.refseq")
    (told,) = (path.annotations for path in learnt.paths)
    assert Map.load(tmp_path / "map.refseq").paths[0].annotations == told
    assert told.behaviours[0] == "MN:12"


def test_a_merged_map_keeps_the_annotations_of_each_path(halves: list[Map], tmp_path: Path) -> None:
    told = [half.paths[0].annotations for half in halves]
    merged = merge(halves, OverlapSettings(alone=0, clear=0))
    assert len(merged) < sum(map(len, halves)), "something was merged"
    assert [path.annotations for path in merged.paths] == told
    assert [path.annotations.behaviours[0] for path in merged.paths] == ["MN:12", ""]
    merged.save(tmp_path / "merged.refseq")
    assert [path.annotations for path in Map.load(tmp_path / "merged.refseq").paths] == told


def rewritten(path: Path, value: object) -> None:
    """Change what the header says of the first path, or drop it: None."""
    with zipfile.ZipFile(path) as archive:
        members = {member: archive.read(member) for member in archive.namelist()}
    header = json.loads(members["map.json"])
    del header["paths"][0]["annotations"]
    if value is not None:
        header["paths"][0]["annotations"] = value
    members["map.json"] = json.dumps(header).encode()
    with zipfile.ZipFile(path, "w") as archive:
        for member, content in members.items():
            archive.writestr(member, content)


def error_of(path: Path) -> str:
    with pytest.raises(MapError) as caught:
        Map.load(path)
    return str(caught.value)


def door(**changes: object) -> dict[str, object]:
    return {"behaviours": [], "doors": [{"along": 1.0, "side": "left", "width": 0.9, "passable": True} | changes]}


DAMAGED = [
    (3, "annotations are no table of behaviours and doors"),
    ("", "annotations are no table of behaviours and doors"),
    ({"doors": []}, "annotations are no table of behaviours and doors"),
    ({"behaviours": "MN", "doors": []}, "annotations: behaviours are no list of texts"),
    ({"behaviours": [1], "doors": []}, "annotations: behaviours are no list of texts"),
    ({"behaviours": ["MN"], "doors": []}, "annotations: 1 behaviours for 12 places"),
    ({"behaviours": [], "doors": {}}, "annotations: doors are no list"),
    ({"behaviours": [], "doors": [{}]}, "annotations: a door is no table of along, side, width and passable"),
    (door(along="far"), "annotations: a door's along and width are no numbers"),
    (door(width=10**400), "annotations: a door's along and width are no numbers"),
    (door(width=None), "annotations: a door's along and width are no numbers"),
    (door(side="up"), "'up' is not a valid DoorSide"),
    (door(side=["left"]), "['left'] is not a valid DoorSide"),
    (door(passable="no"), "annotations: a door's passable is 'no'; valid is true or false"),
]


@pytest.mark.parametrize(("value", "told"), [*DAMAGED, (None, "'annotations' is missing")])
def test_damaged_annotations(learnt: Map, tmp_path: Path, value: object, told: str) -> None:
    path = tmp_path / "map.refseq"
    learnt.save(path)
    rewritten(path, value)
    assert error_of(path) == f"{path}: map.json and arrays do not make a map: {told}"


def test_a_number_that_json_does_not_have_is_told_of(learnt: Map, tmp_path: Path) -> None:
    path = tmp_path / "map.refseq"
    learnt.save(path)
    rewritten(path, door(along=math.nan))
    assert error_of(path) == f"{path}: is not a .refseq map: map.json is missing or no JSON"
