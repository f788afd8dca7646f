import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.features.hu import HuMoments, HuSettings, hu_moments, log_scaled
from refseq.planar import Pose
from refseq.view import Scan, View
from tests.refseq.rooms import Wall, cast, rectangle

SETTINGS = HuSettings()
# Seen whole from the scanner at the origin, and without any symmetry.
ROOM = [(-1, -1, 5, -2), (5, -2, 5, 0.5), (5, 0.5, 1.5, 1), (1.5, 1, 1, 4), (1, 4, -1, 3), (-1, 3, -1, -1)]


def whole(walls: list[Wall], heading: float = 0.0, beams: int = 2881) -> Scan:
    """A scan all around, so that the outline is that of the room at every heading."""
    ahead = cast(walls, Pose(0, 0, heading), beams)
    behind = cast(walls, Pose(0, 0, heading + math.pi), beams)
    return Scan(np.concatenate([ahead.ranges, behind.ranges[1:]]), ahead.start, ahead.step)


def scaled(
    walls: list[tuple[float, float, float, float]], x: float, y: float
) -> list[tuple[float, float, float, float]]:
    return [(x * x0, y * y0, x * x1, y * y1) for x0, y0, x1, y1 in walls]


def descriptor(scan: Scan) -> np.ndarray:
    return log_scaled(hu_moments(scan), SETTINGS.floor)[0]


def by_hand(points: np.ndarray) -> np.ndarray:
    """Hu's formulas, on moments of a fan of triangles around the origin by a cubature that is exact to degree 3."""
    a, b = points, np.roll(points, -1, axis=0)
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    weights = (-27 / 48, 25 / 48, 25 / 48, 25 / 48)
    at = [(a + b) / 3, 0.2 * a + 0.2 * b, 0.6 * a + 0.2 * b, 0.2 * a + 0.6 * b]
    m00 = area.sum()
    centre = sum(w * (area[:, None] * p).sum(axis=0) for w, p in zip(weights, at, strict=True)) / m00

    def n(p: int, q: int) -> float:
        shifted = [x - centre for x in at]
        mu = sum(w * (area * x[:, 0] ** p * x[:, 1] ** q).sum() for w, x in zip(weights, shifted, strict=True))
        return float(mu / m00 ** ((p + q) / 2 + 1))

    s, d = n(2, 0) + n(0, 2), n(2, 0) - n(0, 2)
    e, f = n(3, 0) - 3 * n(1, 2), 3 * n(2, 1) - n(0, 3)
    g, h = n(3, 0) + n(1, 2), n(2, 1) + n(0, 3)
    return np.array(
        [
            s,
            d * d + 4 * n(1, 1) ** 2,
            e * e + f * f,
            g * g + h * h,
            e * g * (g * g - 3 * h * h) + f * h * (3 * g * g - h * h),
            d * (g * g - h * h) + 4 * n(1, 1) * g * h,
            f * g * (g * g - 3 * h * h) - e * h * (3 * g * g - h * h),
        ]
    )


def test_a_half_disc() -> None:
    """About its own centre: 1/(4π) along both axes for a disc, moved by 4r/3π across for its half."""
    area = math.pi / 2
    expected = (math.pi / 8 + math.pi / 8 - area * (4 / (3 * math.pi)) ** 2) / area**2
    assert hu_moments(Scan(np.ones(1441, np.float32), step=math.pi / 1440))[0, 0] == pytest.approx(expected, rel=1e-4)


def test_a_rectangle() -> None:
    """h1 = (a² + b²) / 12ab, h2 = ((a² − b²) / 12ab)²; symmetric, so that all the others vanish."""
    found = hu_moments(whole(rectangle(-2, -1, 2, 1)))[0]
    assert found[:2] == pytest.approx([20 / 96, (12 / 96) ** 2], rel=1e-3)
    assert found[2:] == pytest.approx(np.zeros(5), abs=1e-6)


@given(st.lists(st.floats(0.5, 8.0), min_size=8, max_size=40))
def test_they_are_hus_moments_of_the_filled_polygon(ranges: list[float]) -> None:
    scan = Scan(np.array(ranges, np.float32), step=math.pi / (len(ranges) - 1))
    polygon = np.concatenate([np.zeros((1, 2)), scan.points])
    assert hu_moments(scan)[0] == pytest.approx(by_hand(polygon), rel=1e-3, abs=1e-6)


def test_they_are_those_of_a_drawn_mask() -> None:
    """Filled pixels at 5 mm, counted as ones."""
    scan = whole(ROOM)
    mask = np.zeros((1800, 1800), np.uint8)
    cv2.fillPoly(mask, [np.round(scan.points * 200 + 500).astype(np.int32)], 255)
    drawn = cv2.HuMoments(cv2.moments(mask, binaryImage=True)).ravel()
    assert hu_moments(scan)[0] == pytest.approx(drawn, rel=0.03, abs=1e-6)


@pytest.mark.parametrize("heading", [0.3, math.pi / 2, 2.0, math.pi, -2.5])
@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_turned_and_scaled_rooms_are_alike(heading: float, scale: float) -> None:
    other = descriptor(whole(scaled(ROOM, scale, scale), heading))
    assert np.linalg.norm(other - descriptor(whole(ROOM))) < 0.02


def test_the_mirror_image_differs_in_the_sign_of_the_seventh() -> None:
    room, mirrored = (hu_moments(whole(walls))[0] for walls in (ROOM, scaled(ROOM, 1, -1)))
    assert abs(room[6]) > 1e-7
    assert mirrored == pytest.approx(room * [1, 1, 1, 1, 1, 1, -1], rel=0.02)


def test_different_rooms_differ() -> None:
    """By more than the alias distance, each from each."""
    rooms = [ROOM, rectangle(-2, -1, 2, 1), rectangle(-6, -1, 6, 1), [ROOM[0], (5, -2, -1, 3), ROOM[5]]]
    found = [descriptor(whole(walls)) for walls in rooms]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(found) for b in found[:i]]
    assert min(apart) > SETTINGS.alias_distance


def test_noise_keeps_the_word() -> None:
    """Scans of the same place with 1 cm noise are aliases of one word."""
    rng = np.random.default_rng(0)
    extractor = HuMoments(SETTINGS)
    words = [
        extractor.learn(View(0.0, scan=cast(ROOM, Pose(0, 0, 0.1), rng=rng, noise=0.01))).tolist() for _ in range(50)
    ]
    assert words == [[0]] * 50
    assert extractor.size == 1


def test_beams_without_return_are_left_out() -> None:
    scan = cast(rectangle(0, -2, 4, 2), Pose(0, 0, 0))
    holes = scan.ranges.copy()
    holes[180:184] = np.inf
    # The chord across the hole bends nothing, for the wall behind it is straight.
    assert descriptor(Scan(holes)) == pytest.approx(descriptor(scan), abs=0.01)


@pytest.mark.parametrize("ranges", [np.full(361, np.inf), np.zeros(361), np.zeros(0), np.ones(1)])
def test_nothing_seen_has_no_word(ranges: np.ndarray) -> None:
    extractor = HuMoments(SETTINGS)
    view = View(0.0, scan=Scan(ranges.astype(np.float32)))
    assert extractor.learn(view).tolist() == []
    assert extractor.observe(view).ids.tolist() == []
    assert extractor.size == 0


def test_log_scale_is_odd_and_counts_decades() -> None:
    moments = np.array([[0.0, 1e-8, 1e-3, -1e-3, 1.0, 10.0, -10.0]])
    assert log_scaled(moments, 1e-4)[0] == pytest.approx([0, 4.3e-5, 1.041, -1.041, 4, 5, -5], abs=1e-3)


def test_words_are_kept_and_found_again() -> None:
    rooms = [ROOM, rectangle(-2, -1, 2, 1), rectangle(-6, -1, 6, 1)]
    extractor = HuMoments(SETTINGS)
    views = [View(0.0, scan=whole(walls)) for walls in rooms]
    assert [extractor.learn(view).tolist() for view in views] == [[0], [1], [2]]
    again = HuMoments(SETTINGS, extractor.state()["words"])
    assert [again.observe(view).ids.tolist() for view in views] == [[0], [1], [2]]
    unknown = View(0.0, scan=whole([ROOM[0], (5, -2, -1, 3), ROOM[5]]))
    assert again.observe(unknown).ids.tolist() == []
