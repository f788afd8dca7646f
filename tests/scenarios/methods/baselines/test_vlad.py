import itertools
import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.errors import MapError
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.vlad import DenseSift, VladMap, VladSettings, k_means, root_sift, vlad
from tests.support import CAMERAS, corridor_drive, texture

SMALL = VladSettings(widths=(64,), step=8, words=6, tiles=1, rounds=5)


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(0), count=8, spacing=1.0, size=48)


def test_vlad_by_hand() -> None:
    centres = np.array([[0, 0], [10, 0], [0, 10]], np.float32)
    points = np.array([[3, 0], [0, 1], [10, -4], [12, 0]], np.float32)
    # Residuals (3, 1) and (2, −4), each made one long; nothing is nearest to the third centre.
    first, second = np.array([3, 1]) / math.sqrt(10), np.array([2, -4]) / math.sqrt(20)
    roots = np.concatenate([np.sqrt(first), [1, -1] * np.sqrt(np.abs(second)), [0, 0]])
    assert vlad(points, centres) == pytest.approx(roots / np.linalg.norm(roots), abs=1e-6)


def test_vlad_without_descriptors_is_zero() -> None:
    assert not vlad(np.zeros((0, 2), np.float32), np.ones((3, 2), np.float32)).any()


@given(st.integers(0, 100), st.integers(1, 40))
def test_vlad_is_one_long_and_blind_to_the_order(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points, centres = rng.random((count, 4), np.float32), rng.random((3, 4), np.float32)
    found = vlad(points, centres)
    assert np.linalg.norm(found) == pytest.approx(1, abs=1e-5)
    assert vlad(rng.permutation(points), centres) == pytest.approx(found, abs=1e-4)


def test_root_sift_has_hellinger_distances() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.random((2, 128)).astype(np.float32) * 200
    roots = root_sift(np.stack([one, other]))
    assert np.linalg.norm(roots, axis=1) == pytest.approx([1, 1], abs=1e-5)
    assert float(roots[0] @ roots[1]) == pytest.approx(
        float(np.sqrt(one / one.sum() * other / other.sum()).sum()), 1e-5
    )


def test_k_means_finds_clumps_that_lie_apart() -> None:
    rng = np.random.default_rng(3)
    clumps = np.array([[0, 0], [9, 0], [0, 9]], np.float32)
    points = (clumps[rng.integers(3, size=300)] + rng.normal(0, 0.3, (300, 2))).astype(np.float32)
    centres = k_means(points, 3, 20, np.random.default_rng(0))
    assert centres[np.lexsort(np.round(centres.T))] == pytest.approx(clumps[np.lexsort(clumps.T)], abs=0.2)


def test_k_means_never_grows_worse_and_keeps_to_what_there_is() -> None:
    points = np.random.default_rng(0).random((60, 3), np.float32)
    costs = []
    for rounds in range(6):
        centres = k_means(points, 5, rounds, np.random.default_rng(1))
        costs.append(((points[:, None] - centres) ** 2).sum(axis=2).min(axis=1).sum())
    assert all(later <= earlier + 1e-4 for earlier, later in itertools.pairwise(costs))
    assert costs[-1] < costs[0]
    assert len(k_means(points[:2], 5, 3, np.random.default_rng(1))) == 2


def test_blank_squares_are_left_out() -> None:
    blank = np.full((48, 64), 90, np.uint8)
    assert len(DenseSift(SMALL)(blank).values) == 0
    half = blank.copy()
    half[:, :32] = texture(0.0, 48, 1.0, 0)[:, :32]
    found = DenseSift(SMALL)(half)
    assert len(found.values) > 0
    # A square reaches half its width, 12 of 64 pixels, beyond its middle.
    assert found.across.max() <= (32 + 12) / 64


def test_a_view_looks_most_like_itself_and_its_place(drive: list[View]) -> None:
    places = VladMap.learn(drive, np.random.default_rng(0), SMALL)
    for number, view in enumerate(drive):
        likeness = places.compare(view).values
        assert likeness is not None
        assert likeness[number] == pytest.approx(1, abs=1e-5)
        assert np.argmax(likeness) == number
        assert (np.abs(likeness) <= 1 + 1e-5).all()


def test_cameras_that_a_view_lacks_do_not_count(drive: list[View]) -> None:
    places = VladMap.learn(drive, np.random.default_rng(0), SMALL)
    one, other = (View(0.0, images={camera: drive[2].images[camera]}) for camera in CAMERAS)
    both = places.compare(drive[2]).values
    halves = [places.compare(part).values for part in (one, other)]
    assert both == pytest.approx(np.mean([half for half in halves if half is not None], axis=0), abs=1e-6)
    assert places.compare(View(0.0)).values is None
    assert places.compare(View(0.0, images={"another": drive[2].images[CAMERAS[0]]})).values is None


def test_tiles_tell_where_in_the_image_things_are() -> None:
    rng = np.random.default_rng(0)
    pictures = [cv2.resize(rng.integers(0, 255, (24, 32), dtype=np.uint8), (256, 192)) for _ in range(4)]
    left = np.where(np.arange(256) < 128, pictures[0], 90).astype(np.uint8)
    views = [View(0.0, images={"c": picture}) for picture in (left, *pictures[1:])]
    right = View(0.0, images={"c": np.roll(left, 128, axis=1)})

    def likeness(tiles: int) -> float:
        settings = VladSettings(widths=(256,), step=8, words=6, tiles=tiles, rounds=5)
        values = VladMap.learn(views, np.random.default_rng(0), settings).compare(right).values
        assert values is not None
        return float(values[0])

    assert likeness(1) > likeness(2) + 0.3


def test_a_drive_that_shows_nothing_is_refused() -> None:
    with pytest.raises(MapError, match=r"^2 views show nothing to describe; valid is a drive with images$"):
        VladMap.learn([View(0.0), View(1.0, images={"c": np.zeros((48, 64), np.uint8)})], np.random.default_rng(0))
