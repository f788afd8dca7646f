import math
import tracemalloc
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from refseq.features.walls import ScanLines, WallLines, WallSettings, find_lines, find_walls, fuse, grow_segments
from refseq.map.learning import learn
from refseq.planar import Pose
from refseq.view import LASER, Scan, View
from tests.refseq.floors import box, random_floor
from tests.refseq.rooms import Wall, cast, rectangle
from tests.support import corridor_drive

SETTINGS = WallSettings()
ROOMS: dict[str, list[Wall]] = {
    "square": rectangle(0, 0, 6, 6),
    "corridor": rectangle(0, -1.2, 20, 1.2),
    "corner": [(0, 0, 8, 0), (8, 0, 8, 3), (8, 3, 3, 3), (3, 3, 3, 9), (3, 9, 0, 9), (0, 9, 0, 0)],
}
POSES = [Pose(1.5, 0.7, 0.0), Pose(1.2, 0.9, 0.6), Pose(2.0, 1.0, 1.2), Pose(1.5, 0.5, -0.4)]


@dataclass(frozen=True)
class Seen:
    """What can be seen of a wall: its distance, direction in the scanner's frame, and the longest stretch whose points
    are near enough to each other to be one wall at all [m, rad, m]; ``whole`` [m] is all that is seen of it.
    """

    distance: float
    direction: float
    dense: float
    whole: float


def seen_walls(walls: Sequence[Wall], pose: Pose) -> list[Seen]:
    """From the exact scan and the plan."""
    scan = cast(walls, pose)
    c, s = math.cos(pose.heading), math.sin(pose.heading)
    points = scan.points @ np.array([[c, s], [-s, c]]) + [pose.x, pose.y]
    found = []
    for x0, y0, x1, y1 in walls:
        start, along = np.array([x0, y0]), np.array([x1 - x0, y1 - y0]) / math.hypot(x1 - x0, y1 - y0)
        normal = np.array([-along[1], along[0]])
        on = np.flatnonzero(np.abs((points - start) @ normal) < 1e-4)
        if len(on) < 2:
            continue
        position = (points[on] - start) @ along
        apart = (np.diff(on) > 1) | (np.abs(np.diff(position)) > SETTINGS.gap)
        runs = np.split(position, np.flatnonzero(apart) + 1)
        found.append(
            Seen(
                abs(float((np.array([pose.x, pose.y]) - start) @ normal)),
                math.atan2(along[1], along[0]) - pose.heading,
                max(float(np.ptp(run)) for run in runs),
                float(np.ptp(position)),
            )
        )
    return found


def on_wall(lines: ScanLines, wall: Seen, off: float, tilt: float) -> np.ndarray:
    """Which lines lie on a wall: within ``off`` [m] and ``tilt`` [deg], and no longer than what is seen of it."""
    slope = np.arctan2(*lines.direction.T[::-1]) - wall.direction
    return (
        (np.abs(lines.distance - wall.distance) < off)
        & (np.abs(np.sin(slope)) < math.sin(math.radians(tilt)))
        & (lines.length < wall.whole + 0.2)
    )


@dataclass
class Tally:
    """What was found against what there is; ``off`` [m] and ``tilt`` [deg] are what a line may be beside a wall."""

    off: float
    tilt: float
    found: int = 0
    true: int = 0
    walls: int = 0
    met: int = 0
    covered: list[float] = field(default_factory=list)

    def add(self, lines: ScanLines, expected: Sequence[Seen]) -> None:
        on = np.array([on_wall(lines, wall, self.off, self.tilt) for wall in expected]).reshape(
            len(expected), len(lines)
        )
        self.found += len(lines)
        self.true += int(on.any(axis=0).sum())
        for wall, its in zip(expected, on, strict=True):
            if wall.dense > 1.25 * SETTINGS.length:
                self.walls += 1
                self.met += bool(its.any())
                self.covered += [lines.length[its].max() / wall.dense] if its.any() else []

    def check(self, precision: float, recall: float, covered: float) -> None:
        figures = (self.true / self.found, self.met / self.walls, float(np.median(self.covered)))
        print(
            f"\nwalls: precision {figures[0]:.3f} of {self.found}, recall {figures[1]:.3f} of {self.walls}, "
            f"median share of a wall's length {figures[2]:.2f}"
        )
        assert figures[0] > precision
        assert figures[1] > recall
        assert figures[2] > covered


def test_walls_of_known_rooms_are_found() -> None:
    """Scans with 5 mm noise in 1 cm steps: every line found is a wall, and nearly every long wall is found."""
    tally = Tally(0.03, 2.0)
    for room in ROOMS.values():
        for pose in POSES:
            for seed in range(2):
                tally.add(
                    find_walls(cast(room, pose, rng=np.random.default_rng(seed)), SETTINGS), seen_walls(room, pose)
                )
    tally.check(0.97, 0.9, 0.85)


@pytest.mark.quick_cases("10")
@pytest.mark.parametrize("floors", [10, 40])
def test_walls_of_floors_with_doors_and_clutter_are_found(floors: int) -> None:
    """As above at ten random poses a floor; a closed door's leaf, 8 cm behind the face, may become part of the wall."""
    rng = np.random.default_rng(0)
    tally = Tally(0.1, 4.0)
    for _ in range(floors):
        floor = random_floor(rng)
        for _ in range(10):
            pose = floor.pose(rng)
            tally.add(find_walls(cast(floor.walls, pose, rng=rng), SETTINGS), seen_walls(floor.walls, pose))
    tally.check(0.9, 0.95, 0.9)


def test_growth_is_of_2_to_6_points_that_keep_their_direction() -> None:
    scan = cast(rectangle(-3, -3, 3, 3), Pose(0, 0, 0))
    segments = grow_segments(scan, SETTINGS)
    assert set(segments.count.tolist()) <= set(range(2, SETTINGS.points + 1))
    assert segments.count.max() == SETTINGS.points
    assert segments.count.sum() >= 0.98 * 361
    assert (segments.last - segments.first + 1 == segments.count).all()


def test_a_gap_wider_than_the_limit_ends_a_segment() -> None:
    """Two walls in one line, a metre apart: the doorway is not bridged."""
    walls = [(3.0, -4.0, 3.0, -0.5), (3.0, 0.5, 3.0, 4.0), (9.0, -9.0, 9.0, 9.0)]
    found = find_walls(cast(walls, Pose(0, 0, 0)), SETTINGS)
    assert found.length[found.distance < 4] == pytest.approx([3.4, 3.4], abs=0.3)


@pytest.mark.parametrize("thing", [box(np.array([2.0, 0.0]), 0.2, 0.3), box(np.array([1.5, 0.9]), 0.15, 0.0)])
def test_a_thin_thing_in_front_does_not_cut_a_wall(thing: list[Wall]) -> None:
    """Its beams lie between the two parts of the wall, so that these are no neighbours in the scan."""
    scan = cast([(3.0, -4.0, 3.0, 4.0), *thing], Pose(0, 0, 0), rng=np.random.default_rng(0))
    assert find_walls(scan, SETTINGS).length == pytest.approx([8.0], abs=0.1)


def test_what_is_seen_behind_a_wall_cuts_it() -> None:
    """A slit of 40 cm, nearer than the largest gap that is fused over; the same slit with nothing behind is no gap."""
    walls = [(2.0, -4.0, 2.0, -0.2), (2.0, 0.2, 2.0, 4.0)]
    through = cast([*walls, (5.0, -2.0, 5.0, 2.0)], Pose(0, 0, 0))
    assert find_walls(through, SETTINGS).length == pytest.approx([3.7, 3.7], abs=0.2)
    assert find_walls(cast(walls, Pose(0, 0, 0)), SETTINGS).length == pytest.approx([8.0], abs=0.3)


def test_ranges_that_are_off_do_not_cut_a_wall() -> None:
    scan = cast([(3.0, -4.0, 3.0, 4.0)], Pose(0, 0, 0))
    scan.ranges[[130, 180, 181, 230]] = [1.0, 5.0, 2.5, 2.0]
    assert find_walls(scan, SETTINGS).length == pytest.approx([8.0], abs=0.1)


@pytest.mark.parametrize("max_range", [8.0, 80.0])
def test_beams_without_return_are_in_no_wall(max_range: float) -> None:
    """Their end points at the maximum range form an arc that must not become walls."""
    assert len(grow_segments(Scan(np.full(361, np.inf, np.float32), max_range=max_range), SETTINGS)) == 0


@pytest.mark.parametrize("beams", [0, 1, 2])
def test_a_scan_of_hardly_any_beams(beams: int) -> None:
    assert len(find_walls(Scan(np.ones(beams, np.float32)), SETTINGS)) == 0


def test_a_round_wall_is_no_wall() -> None:
    assert find_walls(Scan(np.full(361, 1.5, np.float32)), SETTINGS).first.tolist() == []


Piece = tuple[float, float, float, float]


def pieces(*ends: Piece) -> ScanLines:
    """A line of six points for each (x0, x1, y0, y1)."""
    points = [np.stack([np.linspace(x0, x1, 6), np.linspace(y0, y1, 6)], axis=1) for x0, x1, y0, y1 in ends]
    return ScanLines.through(np.concatenate(points), 6 * np.arange(len(ends)))


def test_fusion_joins_what_is_alike_and_near() -> None:
    joined = fuse(pieces((0, 1, 2, 2), (1.2, 2, 2, 2), (2.1, 3, 2, 2)), SETTINGS)
    assert len(joined) == 1
    assert (joined.length[0], joined.distance[0], joined.count[0]) == pytest.approx((3.0, 2.0, 18))
    assert (joined.first[0], joined.last[0]) == (0, 17)


@pytest.mark.parametrize("other", [(1.6, 2.6, 2, 2), (1.1, 2.1, 2, 2.6), (1.1, 2.1, 2.3, 2.3)])
def test_fusion_leaves_what_is_too_far_too_tilted_or_beside(other: Piece) -> None:
    assert len(fuse(pieces((0, 1, 2, 2), other), SETTINGS)) == 2


def test_fusion_keeps_what_lies_between_and_the_order() -> None:
    fused = fuse(pieces((0, 1, 2, 2), (0.9, 1.1, 1, 1.2), (1.2, 2, 2, 2), (2.6, 3, 2, 2)), SETTINGS)
    assert fused.first.tolist() == [0, 6, 18]
    assert fused.length == pytest.approx([2.0, 0.2 * math.sqrt(2), 0.4])


def test_fit_is_that_of_all_points() -> None:
    """The moments of the parts give the same total-least-squares line as all points by their singular values."""
    rng = np.random.default_rng(2)
    points = np.stack([np.linspace(0, 4, 30), 1 + 0.5 * np.linspace(0, 4, 30)], axis=1) + rng.normal(0, 0.02, (30, 2))
    parts = ScanLines.through(points, np.array([0, 11]))
    fused = parts[[0]].fused_with(parts[[1]])
    centre = points.mean(axis=0)
    along, normal = np.linalg.svd(points - centre)[2]
    assert np.abs(fused.normal @ normal) == pytest.approx([1.0], abs=1e-9)
    assert fused.direction[0] == pytest.approx(along * np.sign(along[0]), abs=1e-9)
    assert fused.distance == pytest.approx([abs(float(normal @ centre))], abs=1e-9)


@pytest.mark.parametrize(
    ("walls", "bits"),
    [
        # Bits 0–2: at least 1, 2, 3 walls at 4 m and more; 3–5: at 2 to 4 m; 6–8: nearer than 2 m.
        ([(5.0, -4.0, 5.0, 4.0)], {0}),
        ([(3.0, -4.0, 3.0, 4.0)], {3}),
        ([(1.0, -4.0, 1.0, 4.0)], {6}),
        ([(-2.0, 1.0, 4.0, 1.0), (-2.0, -1.0, 4.0, -1.0)], {6, 7}),
        ([(-2.0, 1.0, 2.2, 1.0), (-2.0, -1.0, 2.2, -1.0), (3.0, -4.0, 3.0, 4.0)], {3, 6, 7}),
        (rectangle(-3.0, -3.0, 3.0, 3.0), {3, 4, 5}),
        (rectangle(-6.0, -6.0, 6.0, 6.0), {0, 1, 2}),
        ([(1.5, -0.9, 1.5, 0.9)], set()),
        ([], set()),
    ],
)
def test_table_b1(walls: list[Wall], bits: set[int]) -> None:
    scan = cast(walls, Pose(0.0, 0.0, 0.0))
    extractor = WallLines(SETTINGS)
    assert set(extractor.observe(View(0.0, scan=scan)).ids.tolist()) == bits
    assert set(extractor.learn(View(0.0, scan=scan)).tolist()) == bits
    assert extractor.size == 9


@pytest.mark.parametrize(("distance", "bit"), [(1.99, 6), (2.01, 3), (3.99, 3), (4.01, 0)])
def test_bands_of_table_b1(distance: float, bit: int) -> None:
    scan = cast([(distance, -4.0, distance, 4.0)], Pose(0.0, 0.0, 0.0))
    assert WallLines(SETTINGS).observe(View(0.0, scan=scan)).ids.tolist() == [bit]


def test_a_fine_scan_is_thinned_and_takes_no_square_of_its_beams() -> None:
    """A hundred thousand beams give the walls of every 70th, and memory for no table of all against all."""
    count = 100_000
    bearings = np.linspace(-np.pi, np.pi, count, endpoint=False)
    with np.errstate(divide="ignore"):
        square = np.minimum(2 / np.abs(np.cos(bearings)), 2 / np.abs(np.sin(bearings))).astype(np.float32)
    fine = Scan(square, -np.pi, 2 * np.pi / count)
    coarse = Scan(square[::70], -np.pi, 2 * np.pi / count * 70)
    tracemalloc.start()
    found = find_lines(fine, WallSettings())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100 << 20
    np.testing.assert_array_equal(found.moments, find_lines(coarse, WallSettings()).moments)


def test_lines_of_a_scan_are_found_once_whatever_is_a_wall(monkeypatch: pytest.MonkeyPatch) -> None:
    """Learning passes over its drive three times, for walls of two lengths and for doors."""
    grown: list[int] = []
    monkeypatch.setattr(
        "refseq.features.walls.grow_segments", lambda scan, rules: grown.append(1) or grow_segments(scan, rules)
    )
    learn(corridor_drive(np.random.default_rng(3), count=12, size=48), sensors=[LASER], profile="best")
    assert len(grown) == 12
    scan = cast(ROOMS["corner"], Pose(1.5, 1.5, 0.8))
    long, short = (find_walls(scan, WallSettings(length=length)) for length in (5.0, 0.0))
    assert len(long) < len(short)
    assert len(grown) == 13
    find_lines(scan, WallSettings(gap=0.2))
    find_lines(replace(scan), WallSettings())
    assert len(grown) == 15


def test_points_that_are_all_near_take_bounded_memory() -> None:
    ranges = np.random.default_rng(0).uniform(0.05, 0.3, 1440).astype(np.float32)
    tracemalloc.start()
    find_lines(Scan(ranges, -np.pi, 2 * np.pi / 1440), WallSettings())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 300 << 20
