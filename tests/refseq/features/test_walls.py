import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from refseq.features.walls import Line, WallLines, WallSettings, find_walls, fuse, grow_segments
from refseq.view import Pose, Scan, View
from tests.refseq.rooms import Wall, cast, rectangle

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


def is_of(line: Line, wall: Seen) -> bool:
    """Whether a line found lies on a wall: 3 cm and 2°, and no longer than what is seen of it."""
    normal = line.normal
    slope = math.atan2(normal[0], -normal[1]) - wall.direction
    return (
        abs(line.distance - wall.distance) < 0.03
        and abs(math.sin(slope)) < math.sin(math.radians(2))
        and line.length < wall.whole + 0.2
    )


def test_walls_of_known_rooms_are_found() -> None:
    """Scans with 5 mm noise in 1 cm steps: every line found is a wall, and nearly every long wall is found."""
    found = true = walls = met = 0
    covered: list[float] = []
    for room in ROOMS.values():
        for pose in POSES:
            expected = seen_walls(room, pose)
            for seed in range(2):
                lines = find_walls(cast(room, pose, rng=np.random.default_rng(seed)), SETTINGS)
                found += len(lines)
                true += sum(any(is_of(line, wall) for wall in expected) for line in lines)
                for wall in expected:
                    if wall.dense > 1.25 * SETTINGS.length:
                        walls += 1
                        lengths = [line.length for line in lines if is_of(line, wall)]
                        met += bool(lengths)
                        covered += [max(lengths) / wall.dense] if lengths else []
    precision, recall = true / found, met / walls
    print(f"precision {precision:.3f} of {found}, recall {recall:.3f} of {walls}, covered {np.median(covered):.2f}")
    assert precision > 0.97
    assert recall > 0.9
    assert np.median(covered) > 0.85


def test_growth_is_of_2_to_6_points_that_keep_their_direction() -> None:
    scan = cast(rectangle(-3, -3, 3, 3), Pose(0, 0, 0))
    segments = grow_segments(scan, SETTINGS)
    assert {segment.count for segment in segments} <= set(range(2, SETTINGS.points + 1))
    assert max(segment.count for segment in segments) == SETTINGS.points
    assert sum(segment.count for segment in segments) >= 0.98 * 361


def test_a_gap_wider_than_the_limit_ends_a_segment() -> None:
    """Two walls in one line, a metre apart: the doorway is not bridged."""
    walls = [(3.0, -4.0, 3.0, -0.5), (3.0, 0.5, 3.0, 4.0), (9.0, -9.0, 9.0, 9.0)]
    lines = [found for found in find_walls(cast(walls, Pose(0, 0, 0)), SETTINGS) if found.distance < 4]
    assert len(lines) == 2
    assert [found.length for found in lines] == pytest.approx([3.4, 3.4], abs=0.3)


@pytest.mark.parametrize("max_range", [8.0, 80.0])
def test_beams_without_return_are_in_no_wall(max_range: float) -> None:
    """Their end points at the maximum range form an arc that must not become walls."""
    assert grow_segments(Scan(np.full(361, np.inf, np.float32), max_range=max_range), SETTINGS) == []


def test_a_round_wall_is_no_wall() -> None:
    assert find_walls(Scan(np.full(361, 1.5, np.float32)), SETTINGS) == []


def test_fusion_joins_what_is_alike_and_near() -> None:
    def piece(x0: float, x1: float, y0: float, y1: float) -> Line:
        return Line.through(np.stack([np.linspace(x0, x1, 6), np.linspace(y0, y1, 6)], axis=1))

    (joined,) = fuse([piece(0, 1, 2, 2), piece(1.2, 2, 2, 2), piece(2.1, 3, 2, 2)], SETTINGS)
    assert (joined.length, joined.distance, joined.count) == pytest.approx((3.0, 2.0, 18))
    for other in (piece(1.6, 2.6, 2, 2), piece(1.1, 2.1, 2, 2.6), piece(1.1, 2.1, 2.3, 2.3)):
        assert len(fuse([piece(0, 1, 2, 2), other], SETTINGS)) == 2  # too far, too tilted, beside


def test_fit_is_that_of_all_points() -> None:
    """The moments of the parts give the same total-least-squares line as all points by their singular values."""
    rng = np.random.default_rng(2)
    points = np.stack([np.linspace(0, 4, 30), 1 + 0.5 * np.linspace(0, 4, 30)], axis=1) + rng.normal(0, 0.02, (30, 2))
    fused = Line.through(points[:11]).fused_with(Line.through(points[11:]))
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre)[2][1]
    assert abs(float(normal @ fused.normal)) == pytest.approx(1.0, abs=1e-9)
    assert fused.distance == pytest.approx(abs(float(normal @ centre)), abs=1e-9)


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
