import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.features.doors import DetectedDoor, DoorCounts, DoorSettings, find_doors
from refseq.features.walls import WallSettings
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.floors import Doorway, Floor, Leaf, in_sight, random_floor, wall_with_doors
from tests.refseq.rooms import Wall, cast, rectangle

SETTINGS = DoorSettings()
HALL = rectangle(-20, -20, 20, 20)


def ahead(distance: float, *places: tuple[float, float, Leaf], thickness: float = 0.15) -> list[Wall]:
    """A wall of 12 m square to the view, with doors from and to so far from its middle [m], in a large hall."""
    shifted = [(start + 6, to + 6, leaf) for start, to, leaf in places]
    return HALL + wall_with_doors((distance, -6.0, distance, 6.0), shifted, thickness)[0]


def seen(walls: list[Wall], pose: Pose | None = None) -> list[DetectedDoor]:
    return find_doors(cast(walls, pose or Pose(0, 0, 0), rng=np.random.default_rng(0)), SETTINGS)


@pytest.mark.parametrize("distance", [1.5, 3.0, 5.0])
@pytest.mark.parametrize("width", [0.7, 0.9, 1.2, 1.7])
@pytest.mark.parametrize("middle", [-0.5, 0.0, 1.0])
def test_an_opening_in_a_wall(distance: float, width: float, middle: float) -> None:
    (door,) = seen(ahead(distance, (middle - width / 2, middle + width / 2, Leaf.NONE)))
    assert door.centre == pytest.approx((distance, middle), abs=0.06)
    assert door.width == pytest.approx(width, abs=0.06)
    assert door.heading == pytest.approx(0.0, abs=0.03)
    assert door.distance == pytest.approx(math.hypot(distance, middle), abs=0.06)
    assert door.bearing == pytest.approx(math.atan2(middle, distance), abs=0.03)
    assert door.passable
    assert SETTINGS.probability < door.probability < 1


@pytest.mark.parametrize("turn", [-1.2, -0.5, 0.4, 1.3])
def test_a_door_is_the_same_from_another_heading(turn: float) -> None:
    walls = ahead(2.5, (-0.4, 0.5, Leaf.NONE))
    (door,) = seen(walls, Pose(0, 0, turn))
    assert door.bearing == pytest.approx(math.atan2(0.05, 2.5) - turn, abs=0.03)
    assert door.heading == pytest.approx(-turn, abs=0.03)


@pytest.mark.parametrize(
    ("leaf", "passable"), [(Leaf.NONE, True), (Leaf.OPEN, True), (Leaf.AJAR, False), (Leaf.CLOSED, None)]
)
@pytest.mark.parametrize("y", [-1.0, 0.0, 1.0])
def test_leaves(leaf: Leaf, passable: bool | None, y: float) -> None:
    """An open leaf leaves the way free, one that stands ajar blocks it; a closed door is no opening."""
    doors = seen(ahead(2.0, (-0.45, 0.45, leaf)), Pose(0, y, 0))
    assert [door.passable for door in doors] == ([] if passable is None else [passable])


def test_something_in_a_doorway_blocks_it() -> None:
    walls = ahead(2.0, (-0.5, 0.5, Leaf.NONE))
    assert [door.passable for door in seen([*walls, (2.3, -0.15, 2.3, 0.15)])] == [False]
    assert [door.passable for door in seen([*walls, (3.0, -0.15, 3.0, 0.15)])] == [True]


@pytest.mark.parametrize("stub", [0.0, 0.05, 0.1, 0.3])
def test_an_opening_at_a_corner(stub: float) -> None:
    """A door beside a side wall: the jamb there is short, or the side wall itself."""
    walls = [*ahead(3.0, (1.0 - stub - 0.9, 1.0 - stub, Leaf.NONE)), (-2.0, 1.0, 3.15, 1.0)]
    (door,) = seen(walls)
    assert door.centre == pytest.approx((3.0, 0.55 - stub), abs=0.1)
    assert door.width == pytest.approx(0.9, abs=0.15)


@pytest.mark.parametrize("width", [0.3, 2.4])
def test_gaps_too_narrow_or_wide_are_no_doors(width: float) -> None:
    assert seen(ahead(2.0, (-width / 2, width / 2, Leaf.NONE))) == []


@pytest.mark.parametrize(
    "walls",
    [
        pytest.param(rectangle(-3, -3, 3, 3), id="a room"),
        pytest.param(rectangle(-5, -1.1, 20, 1.1), id="the end of a corridor"),
        pytest.param([*HALL, (-5, 0.7, 4, 0.7), (-5, -0.7, 4, -0.7)], id="the way out of a narrow corridor"),
        pytest.param([*rectangle(-3, -3, 3, 3), *rectangle(1.5, -0.4, 2.0, 0.4)], id="a box in front of a wall"),
        pytest.param([*rectangle(-9, -9, 9, 9), (2, -4, 2, 0), (3, 0, 3, 4)], id="walls that are not in line"),
        pytest.param([(-2.0, 2.0, 2.0, 2.0)], id="a wall and nothing"),
        pytest.param([], id="nothing"),
    ],
)
def test_no_doors(walls: list[Wall]) -> None:
    assert seen(walls) == []


def test_what_gives_no_return_is_no_opening() -> None:
    """Glass in a wall: the beams come back from nowhere."""
    scan = cast(ahead(2.0), Pose(0, 0, 0))
    glazed = scan.ranges.copy()
    glazed[160:202] = np.inf
    assert find_doors(Scan(glazed), SETTINGS) == []


@pytest.mark.parametrize("beams", [0, 1, 2, 3])
def test_a_scan_of_hardly_any_beams(beams: int) -> None:
    assert find_doors(Scan(np.ones(beams, np.float32)), SETTINGS) == []


@pytest.mark.parametrize(
    ("distance", "doors", "bits"),
    [
        # Bits 0, 1: at least 1, 2 doors at 4 m and more; 2, 3: at 2 to 4 m; 4, 5: nearer than 2 m.
        (5.0, [(-0.5, 0.5)], {0}),
        (5.0, [(-2.5, -1.5), (1.5, 2.5)], {0, 1}),
        (3.0, [(-0.5, 0.5)], {2}),
        (3.0, [(-1.6, -0.6), (0.6, 1.6)], {2, 3}),
        (1.5, [(-0.5, 0.5)], {4}),
        (1.4, [(-1.2, -0.3), (0.3, 1.2)], {4, 5}),
        (1.9, [(-0.5, 0.5), (1.4, 2.3)], {2, 4}),
        (3.0, [], set()),
    ],
)
@pytest.mark.parametrize("leaf", [Leaf.NONE, Leaf.AJAR])
def test_table_b2(distance: float, doors: list[tuple[float, float]], bits: set[int], leaf: Leaf) -> None:
    """Passable and blocked doors count alike."""
    scan = cast(ahead(distance, *((start, to, leaf) for start, to in doors)), Pose(0.0, 0.0, 0.0))
    extractor = DoorCounts(SETTINGS, WallSettings())
    assert set(extractor.observe(View(0.0, scan=scan)).ids.tolist()) == bits
    assert set(extractor.learn(View(0.0, scan=scan)).tolist()) == bits
    assert extractor.size == 6


@dataclass
class Tally:
    """What was found against what there is: (probability, whether it is a doorway) of each, and doorways met."""

    found: list[tuple[float, bool]] = field(default_factory=list)
    met: dict[str, list[bool]] = field(default_factory=dict)
    passable: list[bool] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    offsets: list[float] = field(default_factory=list)

    def add(self, floor: Floor, pose: Pose, doors: list[DetectedDoor]) -> None:
        open_ways = [way for way in floor.doorways if way.leaf is not Leaf.CLOSED]
        taken = set()
        for door in doors:
            spot = in_plan(door, pose)
            ways = [way for way in open_ways if is_of(door, spot, way)]
            self.found.append((door.probability, bool(ways)))
            for way in ways:
                taken.add(id(way))
                self.passable.append(door.passable == way.passable)
                self.widths.append(abs(door.width - way.width))
                self.offsets.append(math.dist(spot, way.centre))
        for way in open_ways:
            if in_sight(floor, way, pose):
                for group in (way.leaf.name, f"{way.width:.1f} m wide", band(math.dist(way.centre, (pose.x, pose.y)))):
                    self.met.setdefault(group, []).append(id(way) in taken)

    def table(self) -> str:
        rows = [f"{group:>12}: recall {np.mean(met):.3f} of {len(met)}" for group, met in sorted(self.met.items())]
        for low, high in ((0.75, 0.9), (0.9, 0.97), (0.97, 1.0)):
            inside = [pair for pair in self.found if low < pair[0] <= high]
            given, true = np.mean(inside, axis=0)
            rows.append(f"probability {low} to {high}: given {given:.2f}, true {true:.2f} of {len(inside)}")
        return "\n".join(rows)


def in_plan(door: DetectedDoor, pose: Pose) -> NDArray[np.float64]:
    """A door's centre in the plan."""
    c, s = math.cos(pose.heading), math.sin(pose.heading)
    return np.array([pose.x, pose.y]) + np.array([[c, -s], [s, c]]) @ door.centre


def is_of(door: DetectedDoor, spot: NDArray[np.float64], way: Doorway) -> bool:
    return math.dist(spot, way.centre) < 0.25 and abs(door.width - way.width) < 0.3


def band(distance: float) -> str:
    return "0 to 2 m off" if distance < 2 else "2 to 4 m off" if distance < 4 else "4 m and more"


@pytest.mark.quick_cases("10")
@pytest.mark.parametrize("floors", [10, 40])
def test_doors_of_floors_are_found(floors: int) -> None:
    """Ten random poses a floor, 5 mm noise in 1 cm steps: rooms, corridors, all widths and leaves of doors, clutter.

    Doorways in sight are those whose opening and jambs are seen whole, at 4° and more. The settings were chosen on
    other floors, those of seed 0.
    """
    rng = np.random.default_rng(1)
    tally = Tally()
    for _ in range(floors):
        floor = random_floor(rng)
        for _ in range(10):
            pose = floor.pose(rng)
            tally.add(floor, pose, find_doors(cast(floor.walls, pose, rng=rng), SETTINGS))
    precision = np.mean([true for _, true in tally.found])
    met = [met for leaf in Leaf for met in tally.met.get(leaf.name, [])]
    print(
        f"\ndoors: precision {precision:.3f} of {len(tally.found)}, recall {np.mean(met):.3f} of {len(met)} in sight, "
        f"passable or blocked rightly {np.mean(tally.passable):.3f}\n"
        f"median error of the width {np.median(tally.widths):.3f} m, of the centre {np.median(tally.offsets):.3f} m\n"
        f"{tally.table()}"
    )
    assert precision > 0.95
    assert np.mean(met) > 0.85
    assert np.mean(tally.passable) > 0.93
    assert np.median(tally.widths) < 0.05
    assert np.median(tally.offsets) < 0.03
