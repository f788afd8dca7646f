import numpy as np

from refseq.features.nearest import BLOCK, nearest


def test_of_equally_near_words_the_first_is_meant_across_blocks() -> None:
    words = np.full((2 * BLOCK, 4), 200, np.uint8)
    words[[5, BLOCK + 5]] = 7
    found = nearest(np.full((1, 4), 7, np.uint8), words)
    assert found.ids.tolist() == [5]
    assert found.squared.tolist() == [0]


def test_without_words_all_is_infinitely_far() -> None:
    assert nearest(np.zeros((2, 4), np.uint8), np.zeros((0, 4), np.uint8)).squared.tolist() == [np.inf, np.inf]
