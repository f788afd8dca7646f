"""Keys as a map keeps them: where they were to an eighth of a pixel, and each value of a descriptor to a sixteenth."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.features.sift import NO_KEYS
from refseq.features.word_extractor import PictureKeys
from refseq.map.paths.keys import MOST, PathKeys


def drawn(rng: np.random.Generator, count: int) -> PictureKeys:
    points = rng.uniform((0, 0), (1600, 1200), (count, 2)).astype(np.float32)
    return PictureKeys(points, rng.integers(0, 256, (count, 128)).astype(np.uint8))


@settings(deadline=None, max_examples=30, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), counts=st.lists(st.integers(0, 12), max_size=6))
def test_what_is_kept_is_near_what_was_seen(seed: int, counts: list[int]) -> None:
    rng = np.random.default_rng(seed)
    views = [drawn(rng, count) for count in counts]
    kept = PathKeys.of(views)
    assert kept.counts.tolist() == counts
    assert (len(kept.points), len(kept.packed)) == (sum(counts), sum(counts))
    for number, view in enumerate(views):
        its = kept.at(number)
        assert (its.points.dtype, its.descriptors.dtype) == (np.float32, np.uint8)
        np.testing.assert_allclose(its.points, view.points, atol=1 / 16)
        assert (np.abs(its.descriptors.astype(int) - view.descriptors) <= 8).all()
    again = PathKeys.of([kept.at(number) for number in range(len(views))])
    assert (again.points.tobytes(), again.packed.tobytes()) == (kept.points.tobytes(), kept.packed.tobytes())


def test_the_strongest_are_kept_in_68_bytes_each() -> None:
    view = drawn(np.random.default_rng(1), MOST + 50)
    kept = PathKeys.of([NO_KEYS, view])
    assert kept.counts.tolist() == [0, MOST]
    assert kept.points.nbytes + kept.packed.nbytes == 68 * MOST
    np.testing.assert_allclose(kept.at(1).points, view.points[:MOST], atol=1 / 16)
    assert len(kept.at(0).points) == 0


def test_pictures_wider_than_positions_reach_end_at_the_last() -> None:
    kept = PathKeys.of([PictureKeys(np.array([[9000.0, -1.0]], np.float32), np.zeros((1, 128), np.uint8))])
    assert kept.at(0).points.tolist() == [[65535 / 8, 0.0]]
