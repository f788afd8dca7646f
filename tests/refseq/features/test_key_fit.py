"""Keys laid on keys: of a plane that a known similarity moves, of clutter, of pictures."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.features.key_fit import LARGER, REACH, KeyFit, fit_keys, mutually_nearest
from refseq.features.sift import NO_KEYS, SiftSettings, SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq.view import View
from tests.refseq.keys import moved, scene

quick = settings(derandomize=True)


def both(one: PictureKeys, other: PictureKeys) -> PictureKeys:
    return PictureKeys(np.concatenate([one.points, other.points]), np.concatenate([one.descriptors, other.descriptors]))


@quick
@given(
    seed=st.integers(0, 2**32 - 1),
    scale=st.floats(0.55, 1.8),
    turn=st.floats(-0.3, 0.3),
    shift=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
)
def test_a_plane_that_a_similarity_moves_is_found(
    seed: int, scale: float, turn: float, shift: tuple[float, float]
) -> None:
    """60 keys of a plane among 30 that are seen elsewhere now: all of the plane's fit, and hardly any other."""
    rng = np.random.default_rng(seed)
    plane, clutter = scene(rng, 60), scene(rng, 30)
    strewn = PictureKeys(rng.uniform((0, 0), (640, 480), (30, 2)).astype(np.float32), clutter.descriptors)
    fit = fit_keys(both(plane, clutter), both(moved(plane, scale, turn, shift), strewn))
    assert fit.matches == 90
    assert 60 <= fit.inliers <= 64
    assert fit.scale == pytest.approx(scale, rel=0.02)


@pytest.mark.parametrize(("scale", "turn"), [(1.0, 0.6), (2.5, 0.0), (0.4, 0.0)])
def test_no_robot_sees_a_place_turned_or_from_afar(scale: float, turn: float) -> None:
    plane = scene(np.random.default_rng(1), 50)
    assert fit_keys(plane, moved(plane, scale, turn, (0, 0))) == KeyFit(matches=50)


def test_a_key_off_by_more_than_the_reach_does_not_fit() -> None:
    plane = scene(np.random.default_rng(2), 40)
    points = plane.points.copy()
    points[:10, 0] += 2 * REACH
    assert fit_keys(plane, PictureKeys(points, plane.descriptors)) == KeyFit(40, 30, pytest.approx(1.0, abs=1e-3))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_two_pairs_fit_anything_and_count_nothing(count: int) -> None:
    keys = scene(np.random.default_rng(3), count)
    assert fit_keys(keys, keys) == KeyFit(matches=count)
    assert fit_keys(NO_KEYS, scene(np.random.default_rng(3), 5)) == KeyFit()
    assert fit_keys(scene(np.random.default_rng(3), 5), NO_KEYS) == KeyFit()


def test_the_same_keys_give_the_same_fit() -> None:
    rng = np.random.default_rng(4)
    place, view = scene(rng, 80), scene(rng, 80)
    assert len({fit_keys(place, view) for _ in range(5)}) == 1


def test_the_picture_of_a_wall_that_is_nearer_now() -> None:
    """Pixels, not points: a wall seen 1.25 times as large and 20 pixels aside, by SIFT as the profile has it."""
    rng = np.random.default_rng(5)
    wall = cv2.resize(rng.integers(0, 255, (24, 32)).astype(np.uint8), (640, 480), interpolation=cv2.INTER_CUBIC)
    nearer = cv2.warpAffine(wall, np.array([[1.25, 0, -60.0], [0, 1.25, -60]]), (640, 480))
    words = SiftWords("camera", SiftSettings(contrast=0.01, halved=True, root=True))
    found = []
    for picture in (wall, nearer):
        view = View(0.0, images={"camera": picture})
        described = words.describe(view)
        shown = words.shown(view)
        assert shown.descriptors.tobytes() == described.tobytes()
        found.append(shown)
    fit = fit_keys(*found)
    assert fit.inliers >= 20
    assert fit.inliers >= 0.6 * fit.matches
    assert fit.scale == pytest.approx(1.25, rel=0.02)
    assert 1 / LARGER < fit.scale < LARGER


@quick
@given(
    one=arrays(np.uint8, st.tuples(st.integers(0, 6), st.just(3)), elements=st.integers(0, 4)),
    other=arrays(np.uint8, st.tuples(st.integers(0, 6), st.just(3)), elements=st.integers(0, 4)),
)
def test_mutually_nearest_by_brute_force(one: np.ndarray, other: np.ndarray) -> None:
    """Few small numbers, so that many distances tie: then the first counts."""

    def distances(a: np.ndarray, b: np.ndarray) -> list[int]:
        return [int(((a.astype(int) - c.astype(int)) ** 2).sum()) for c in b]

    def first(row: list[int]) -> int:
        return row.index(min(row))

    expected = [
        (i, first(distances(row, other)))
        for i, row in enumerate(one)
        if len(other) and first(distances(other[first(distances(row, other))], one)) == i
    ]
    rows, columns = mutually_nearest(one, other)
    assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == expected
