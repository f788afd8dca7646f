import numpy as np
import pytest

from refseq.features.nearest import BLOCK, blocks, nearest, squared_distances


def test_of_equally_near_words_the_first_is_meant_across_blocks() -> None:
    words = np.full((2 * BLOCK, 4), 200, np.uint8)
    words[[5, BLOCK + 5]] = 7
    found = nearest(np.full((1, 4), 7, np.uint8), words)
    assert found.ids.tolist() == [5]
    assert found.squared.tolist() == [0]


def test_without_words_all_is_infinitely_far() -> None:
    assert nearest(np.zeros((2, 4), np.uint8), np.zeros((0, 4), np.uint8)).squared.tolist() == [np.inf, np.inf]


def test_words_made_ready_give_the_same_to_the_last_bit() -> None:
    rng = np.random.default_rng(0)
    words, descriptors = (rng.integers(0, 256, (count, 128), dtype=np.uint8) for count in (BLOCK + 70, 9))
    for plain, ready in zip(nearest(descriptors, words), nearest(descriptors, words, blocks(words)), strict=True):
        np.testing.assert_array_equal(plain, ready)


def test_numbers_that_are_compared_pair_by_pair_are_not_made_ready() -> None:
    assert blocks(np.zeros((3, 4), np.float32)) is None
    assert blocks(np.zeros((3, 257), np.uint8)) is None


@pytest.mark.parametrize("size", [1, 128, 256, 300])
def test_distances_of_bytes_are_exact(size: int) -> None:
    """Against sums of whole numbers; the farthest that bytes can be apart among them."""
    rng = np.random.default_rng(size)
    one, other = (rng.integers(0, 256, (20, size), dtype=np.uint8) for _ in range(2))
    one[0], other[0] = 0, 255
    true = np.square(one[:, None].astype(np.int64) - other).sum(axis=2)
    np.testing.assert_array_equal(squared_distances(one, other), true)
