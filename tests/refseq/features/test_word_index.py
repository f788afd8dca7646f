import faiss
import numpy as np
import pytest

from refseq.features.nearest import nearest
from refseq.features.vocabulary import Vocabulary
from refseq.features.word_index import WordIndex


def heaps(seed: int, count: int, kinds: int = 400) -> np.ndarray:
    """Descriptors about centres: some are near many others, none is near all."""
    rng = np.random.default_rng(seed)
    centres = np.random.default_rng(99).gamma(0.5, 40, (kinds, 128))
    return np.clip(centres[rng.integers(0, kinds, count)] + rng.normal(0, 12, (count, 128)), 0, 255).astype(np.uint8)


def indexed(words: np.ndarray) -> WordIndex:
    index = WordIndex()
    index.update(words)
    return index


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_few_words_are_found_exactly(count: int) -> None:
    """Where there are no more cells than are searched, nothing is missed."""
    words, descriptors = heaps(1, count), heaps(2, 30)
    found, expected = indexed(words).nearest(descriptors), nearest(descriptors, words)
    np.testing.assert_array_equal(found.ids, expected.ids)
    np.testing.assert_array_equal(found.squared, expected.squared)


def test_no_descriptors_find_nothing() -> None:
    found = indexed(heaps(1, 40)).nearest(np.zeros((0, 128), np.uint8))
    assert found.ids.shape == found.squared.shape == (0,)


def test_of_many_words_nearly_all_are_found_and_distances_are_true() -> None:
    words, descriptors = heaps(1, 6000), heaps(2, 500)
    found, expected = indexed(words).nearest(descriptors), nearest(descriptors, words)
    assert np.mean(found.ids == expected.ids) > 0.97
    true = ((words[found.ids].astype(int) - descriptors) ** 2).sum(axis=1)
    np.testing.assert_array_equal(found.squared, true)
    assert (found.squared >= expected.squared).all()


def test_words_find_themselves() -> None:
    words = np.unique(heaps(3, 3000), axis=0)
    found = indexed(words).nearest(words)
    np.testing.assert_array_equal(found.ids, np.arange(len(words)))
    assert not found.squared.any()


def test_the_index_depends_on_the_words_alone() -> None:
    """Neither how they came nor the number of threads matters: a map's index is the one that its learning had."""
    words, descriptors = heaps(1, 5000), heaps(2, 400)
    expected = indexed(words).nearest(descriptors)
    grown = WordIndex()
    for size in (1, 2, 700, 700, 1023, 1024, 1025, 4095, 4097, 5000):
        grown.update(words[:size])
        assert (grown.nearest(words[size - 1 : size]).squared == 0).all()
    threads = faiss.omp_get_max_threads()
    try:
        for count in (1, 3):
            faiss.omp_set_num_threads(count)
            for index in (grown, indexed(words)):
                found = index.nearest(descriptors)
                np.testing.assert_array_equal(found.ids, expected.ids)
                np.testing.assert_array_equal(found.squared, expected.squared)
    finally:
        faiss.omp_set_num_threads(threads)


def test_a_vocabulary_beyond_its_limit_matches_by_the_index_and_learns_exactly() -> None:
    first, second, descriptors = heaps(1, 3000), heaps(4, 3000), heaps(2, 200)
    exact, large = (Vocabulary(150.0, np.zeros((0, 128), np.uint8), limit) for limit in (np.inf, 100))
    for part in (first, second):
        np.testing.assert_array_equal(large.learn(part), exact.learn(part))
        found = indexed(large.words).nearest(descriptors)
        by_index = np.unique(found.ids[found.squared <= 150.0**2])
        np.testing.assert_array_equal(large.match(descriptors), by_index)
        all_of_them = exact.match(descriptors)
        assert 0.9 * len(all_of_them) < len(np.intersect1d(by_index, all_of_them))
    again = Vocabulary(150.0, large.words.copy(), 100)
    np.testing.assert_array_equal(again.match(descriptors), large.match(descriptors))


def test_up_to_its_limit_a_vocabulary_matches_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.features.word_index._PROBES", 1)  # an index that misses much
    words = heaps(1, 4000)
    descriptors = heaps(2, 300)
    expected = Vocabulary(150.0, words).match(descriptors)
    np.testing.assert_array_equal(Vocabulary(150.0, words, len(words)).match(descriptors), expected)
    assert len(Vocabulary(150.0, words, len(words) - 1).match(descriptors)) != len(expected)
