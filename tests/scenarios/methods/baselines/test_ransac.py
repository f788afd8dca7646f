"""Matches by loops, and homographies that we made ourselves."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.errors import MapError
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.matches import (
    NO_KEYS,
    ImageKeys,
    KeyTable,
    Matches,
    SparseSift,
    mutual_matches,
)
from refseq_bench.scenarios.methods.baselines.ransac import SAMPLE, RansacInliers, RansacSettings, _usac, count_inliers

BLANK = np.full((120, 160), 90, np.uint8)


def picture(seed: int) -> np.ndarray:
    """Blots of many sizes, (120, 160)."""
    rng = np.random.default_rng(seed)
    layers = [cv2.resize(rng.random((9 * n, 12 * n)), (160, 120), interpolation=cv2.INTER_CUBIC) for n in (1, 2, 4)]
    return np.clip(sum(layers) / 3 * 255, 0, 255).astype(np.uint8)


def warped(image: np.ndarray, H: np.ndarray) -> np.ndarray:
    return cv2.warpPerspective(image, H, (160, 120), borderMode=cv2.BORDER_REPLICATE)


TILT = np.array([[1.05, 0.03, 4.0], [-0.02, 0.98, -3.0], [2e-4, -1e-4, 1.0]])


# --- matches ---


def by_loops(cosines: np.ndarray, sizes: list[int], ratio: float) -> set[tuple[int, int]]:
    distances = np.sqrt(np.maximum(2 - 2 * cosines.astype(float), 0))
    found, start = set(), 0
    for size in sizes:
        block = distances[:, start : start + size]
        for i in range(block.shape[0]):
            for j in range(size):
                others = [*np.delete(block[i], j), *np.delete(block[:, j], i)]
                if others and block[i, j] < ratio * min(others):
                    found.add((i, start + j))
        start += size
    return found


@settings(max_examples=100, deadline=None)
@given(
    st.integers(0, 10_000),
    st.integers(1, 5),
    st.lists(st.integers(1, 4), min_size=1, max_size=4),
    st.booleans(),
)
def test_matches_are_those_of_loops(seed: int, rows: int, sizes: list[int], ties: bool) -> None:
    rng = np.random.default_rng(seed)
    shape = (rows, sum(sizes))
    cosines = rng.choice([-0.4, 0.1, 0.75, 1.0], shape) if ties else rng.uniform(-1, 1, shape)
    cosines = cosines.astype(np.float32)
    ours, theirs = mutual_matches(cosines.copy(), np.array(sizes), 0.8)
    assert (np.diff(theirs) > 0).all()
    assert set(zip(ours.tolist(), theirs.tolist(), strict=True)) == by_loops(cosines, sizes, 0.8)


def keys(rng: np.random.Generator, count: int) -> ImageKeys:
    descriptors = np.abs(rng.normal(size=(count, 128))).astype(np.float32) ** 4
    return ImageKeys(
        rng.random((count, 2), np.float32), descriptors / np.linalg.norm(descriptors, axis=1, keepdims=True)
    )


def test_batches_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    places = [keys(rng, count) if count else NO_KEYS for count in (0, 7, 0, 12, 3, 30, 1, 0)]
    seen = ImageKeys(np.arange(20, dtype=np.float32).reshape(10, 2), places[3].descriptors[:10])
    whole = list(KeyTable(places).matches(seen, 0.8))
    assert 3 in [place for place, _ in whole]
    for most in (1, 10, 19):
        monkeypatch.setattr(KeyTable, "BATCH", most)
        for (k, one), (other, two) in zip(whole, KeyTable(places).matches(seen, 0.8), strict=True):
            assert k == other
            assert one.view.tolist() == two.view.tolist()
            assert one.place.tolist() == two.place.tolist()


def test_keys_match_themselves_and_tell_where_they_are() -> None:
    rng = np.random.default_rng(1)
    places = [keys(rng, 9), keys(rng, 11)]
    found = dict(KeyTable(places).matches(places[1], 0.8))
    assert found[1].view.tolist() == found[1].place.tolist() == places[1].points.tolist()
    assert len(found.get(0, [])) < 5
    assert list(KeyTable(places).matches(NO_KEYS, 0.8)) == []


def test_a_blank_image_has_no_keys() -> None:
    sift = SparseSift(0.02)
    assert len(sift(BLANK)) == 0
    found = sift(picture(0))
    assert len(found) > 30
    assert np.linalg.norm(found.descriptors, axis=1) == pytest.approx(np.ones(len(found)), abs=1e-5)


# --- inliers ---


def mapped(points: np.ndarray, H: np.ndarray) -> np.ndarray:
    return cv2.perspectiveTransform(points[None], H)[0]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.integers(8, 60), st.integers(0, 30))
def test_inliers_are_the_pairs_that_one_homography_made(seed: int, good: int, bad: int) -> None:
    rng = np.random.default_rng(seed)
    place = rng.uniform(0, 600, (good + bad, 2))
    # At a whole pixel one of eight pairs falls out now and then, in 11 of 20 000 draws.
    view = mapped(place, TILT) + rng.uniform(-0.25, 0.25, (good + bad, 2))
    # Others are moved so far, each another way, that no homography takes them along with the good ones.
    turns = rng.uniform(0, 2 * np.pi, bad)
    view[good:] += rng.uniform(100, 400, (bad, 1)) * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    matches = Matches(view.astype(np.float32), place.astype(np.float32))
    found = count_inliers(matches, _usac(RansacSettings(confidence=0.9999, rounds=10_000)))
    assert good <= found <= good + max(2, bad // 4)


def test_no_more_pairs_than_a_sample_are_no_inliers() -> None:
    usac = _usac(RansacSettings())
    points = np.random.default_rng(0).uniform(0, 600, (30, 2)).astype(np.float32)
    assert count_inliers(Matches(points[:SAMPLE], points[:SAMPLE]), usac) == 0
    assert count_inliers(Matches(points[: SAMPLE + 1], points[: SAMPLE + 1]), usac) == SAMPLE + 1
    # Five pairs of which any four fit, but never all five.
    astray = points[:5] + np.array([[0, 0], [0, 0], [0, 0], [0, 0], [200, -300]], np.float32)
    assert count_inliers(Matches(astray, points[:5]), usac) == 0


# --- the localiser ---


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return [View(0.0, images={"a": picture(k), "b": BLANK if k == 2 else picture(100 + k)}) for k in range(4)]


def test_a_warped_view_is_found_by_its_geometry(drive: list[View]) -> None:
    found = RansacInliers.learn(drive)
    for k, view in enumerate(drive):
        seen = View(0.0, images={camera: warped(image, TILT) for camera, image in view.images.items()})
        belief = found.update(seen)
        assert belief.best == k
        assert belief.lost < 0.5
    table = found.inliers({"a": SparseSift(0.02)(warped(picture(1), TILT)), "b": NO_KEYS})
    assert table[1] > 20 > 8 > max(table[0], table[2], table[3])


def test_the_cameras_are_counted_together(drive: list[View]) -> None:
    found, sift = RansacInliers.learn(drive), SparseSift(0.02)
    seen = {camera: sift(warped(image, TILT)) for camera, image in drive[1].images.items()}
    alone = [found.inliers({**dict.fromkeys(seen, NO_KEYS), camera: one}) for camera, one in seen.items()]
    assert found.inliers(seen).tolist() == (alone[0] + alone[1]).tolist()


def test_a_view_that_shows_nothing_says_nothing(drive: list[View]) -> None:
    found = RansacInliers.learn(drive)
    for images in ({}, {"a": BLANK, "b": BLANK}, {"other": picture(0)}):
        belief = found.update(View(0.0, images=images))
        assert belief.places == pytest.approx(np.full(4, 1 / 4))
        assert belief.lost == 0.5


def test_a_view_of_elsewhere_is_likely_lost_the_more_it_shows(drive: list[View]) -> None:
    found = RansacInliers.learn(drive)
    one, both = {"a": picture(50), "b": BLANK}, {"a": picture(50), "b": picture(60)}
    lost = [found.update(View(0.0, images=images)).lost for images in (one, both)]
    assert 0.5 < lost[0] < lost[1]


def test_a_drive_without_images_is_refused_and_one_of_blank_walls_is_not() -> None:
    with pytest.raises(MapError, match=r"^2 views show nothing to match; valid is a drive with images$"):
        RansacInliers.learn([View(0.0), View(1.0)])
    blank = RansacInliers.learn([View(0.0, images={"a": BLANK})] * 3)
    assert blank.update(View(0.0, images={"a": picture(0)})).places == pytest.approx(np.full(3, 1 / 3))
    with pytest.raises(MapError, match=r"^no places to match with"):
        KeyTable([])
