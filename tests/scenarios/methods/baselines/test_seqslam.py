"""SeqSLAM, against loops."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.errors import MapError
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.seqslam import (
    SeqSlam,
    SeqSlamSettings,
    enhance,
    normalise_patches,
    sequence_scores,
    trajectories,
)
from tests.support import CAMERAS, corridor_drive

TINY = SeqSlamSettings(width=16, height=8, patch=4, around=4, views=4, slowest=0.5, fastest=1.5, step=0.5)


@pytest.fixture(scope="module")
def drive() -> list[View]:
    return corridor_drive(np.random.default_rng(0), count=30, spacing=1.0, size=48)


def test_patches_are_normalised_one_by_one() -> None:
    image = np.random.default_rng(0).uniform(0, 255, (8, 12))
    image[4:, :4] = 77.7
    found = normalise_patches(image, 4)
    for top in (0, 4):
        for left in (0, 4, 8):
            square = image[top : top + 4, left : left + 4]
            expected = np.zeros((4, 4)) if (top, left) == (4, 0) else (square - square.mean()) / square.std()
            assert found[top : top + 4, left : left + 4] == pytest.approx(expected)


@given(st.integers(0, 1000), st.floats(0.2, 3), st.floats(-50, 50))
def test_a_change_of_gain_or_offset_is_not_seen(seed: int, gain: float, offset: float) -> None:
    image = np.random.default_rng(seed).uniform(0, 255, (8, 8))
    assert normalise_patches(gain * image + offset, 4) == pytest.approx(normalise_patches(image, 4), abs=1e-6)


@given(st.lists(st.floats(0, 9), min_size=1, max_size=9), st.integers(0, 4))
def test_differences_are_enhanced_among_their_neighbours(differences: list[float], reach: int) -> None:
    found = enhance(np.array(differences), reach)
    for k, value in enumerate(differences):
        near = differences[max(0, k - reach) : k + reach + 1]
        mean = sum(near) / len(near)
        deviation = math.sqrt(sum((d - mean) ** 2 for d in near) / len(near))
        if deviation > 1e-6:
            assert found[k] == pytest.approx((value - mean) / deviation, rel=1e-6, abs=1e-6)
        elif len(set(near)) == 1:
            assert abs(found[k]) < 1e-3


def test_equal_differences_are_enhanced_to_nothing() -> None:
    assert enhance(np.full(7, 3.0), 2).tolist() == [0] * 7


def test_published_trajectories_are_ten_views_at_five_speeds() -> None:
    lags = trajectories(SeqSlamSettings())
    assert lags.shape == (5, 10)
    assert (lags[:, 0] == 0).all()
    assert sorted(lags[:, 9]) == [7, 8, 9, 10, 11]  # 0.8 to 1.2 times 9, rounded
    assert any((row == np.arange(10)).all() for row in lags)


@given(st.integers(0, 1000), st.integers(1, 6), st.integers(1, 4))
def test_scores_are_those_of_loops_over_trajectories(seed: int, places: int, views: int) -> None:
    rows = list(np.random.default_rng(seed).normal(size=(views, places)))
    found = sequence_scores(rows, trajectories(TINY))
    for k in range(places):
        candidates = []
        for speed in (0.5, 1.0, 1.5):
            total = 0.0
            for back in range(views):
                place = k - round(speed * back)
                total += rows[back][place] if place >= 0 else 0.0
            candidates.append(total / views)
        assert found[k] == pytest.approx(min(candidates))


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 1000))
def test_a_whole_drive_by_loops(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # Images of the thumbnails' size are not resized.
    pictures = rng.integers(0, 256, (7, 2, 8, 16), dtype=np.uint8)
    views = [View(0.0, images=dict(zip(CAMERAS, pair, strict=True))) for pair in pictures]
    places, queries = views[:5], [*views[1:4], *views[5:]]
    slam = SeqSlam(places, TINY)
    rows: list[np.ndarray] = []
    for view in queries:
        differences = []
        for place in places:
            pair = [
                np.hstack([normalise_patches(v.images[c].astype(float), 4) for c in CAMERAS]) for v in (view, place)
            ]
            differences.append(np.abs(pair[0] - pair[1]).sum() / pair[0].size)
        rows.insert(0, enhance(np.array(differences), 2))
        scores = sequence_scores(rows[: TINY.views], trajectories(TINY))
        belief = slam.update(view)
        expected = np.exp(-scores / TINY.worth)
        assert belief.places == pytest.approx(expected / expected.sum(), rel=1e-4)
        assert belief.best == np.argmin(scores)
        assert belief.lost == pytest.approx(TINY.needed / (TINY.needed + max(0.0, -scores.min())))


@pytest.mark.parametrize("first", [0, 11, 25])
def test_a_drive_is_followed_from_anywhere(drive: list[View], first: int) -> None:
    slam = SeqSlam(drive)
    found = [slam.update(view) for view in drive[first:]]
    assert [belief.best for belief in found] == list(range(first, 30))


def test_one_view_of_elsewhere_does_not_mislead(drive: list[View]) -> None:
    slam = SeqSlam(drive)
    views = [*drive[10:16], drive[2], *drive[17:20]]
    found = [slam.update(view) for view in views]
    assert [belief.best for belief in found] == list(range(10, 20))
    assert found[6].lost > found[5].lost


def test_views_of_another_world_are_more_likely_off_the_path(drive: list[View]) -> None:
    slam = SeqSlam(drive)
    rng = np.random.default_rng(5)
    other = [View(0.0, images={c: rng.integers(0, 256, (48, 64), dtype=np.uint8) for c in CAMERAS}) for _ in range(12)]
    known = [slam.update(view).lost for view in drive[:12]][-1]
    unknown = [slam.update(view).lost for view in other][-1]
    assert known < 0.5 < unknown


def test_a_view_without_images_changes_no_order(drive: list[View]) -> None:
    slam = SeqSlam(drive)
    for view in drive[5:11]:
        last = slam.update(view)
    blind = slam.update(View(0.0))
    assert blind.best == last.best + 1
    assert SeqSlam(drive).update(View(0.0)).places == pytest.approx(np.full(30, 1 / 30))


def test_a_drive_without_images_is_refused() -> None:
    with pytest.raises(MapError, match=r"^1 views show nothing to compare; valid is a drive with images$"):
        SeqSlam([View(0.0)])
