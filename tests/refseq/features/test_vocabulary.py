import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.features.vocabulary import Vocabulary

quick = settings(deadline=None, max_examples=60, derandomize=True)


def empty(alias_distance: float, size: int = 128, kind: type = np.uint8) -> Vocabulary:
    return Vocabulary(alias_distance, np.zeros((0, size), kind))


def near_duplicates(seed: int, count: int, kinds: int) -> np.ndarray:
    """Descriptors in loose heaps, so that aliases, near misses and chains of aliases all occur."""
    rng = np.random.default_rng(seed)
    centres = rng.integers(0, 256, (kinds, 128))
    noise = rng.integers(-35, 36, (count, 128)) * (rng.random((count, 1)) < 0.8)
    return np.clip(centres[rng.integers(0, kinds, count)] + noise, 0, 255).astype(np.uint8)


def one_by_one(descriptors: np.ndarray, limit: float) -> tuple[list[int], list[np.ndarray]]:
    """The rule itself: the nearest word so far (the older of equals) if within the limit, else a new word."""
    words: list[np.ndarray] = []
    ids = []
    for descriptor in descriptors.astype(np.int64):
        squared = [int(((descriptor - word) ** 2).sum()) for word in words]
        if squared and min(squared) <= limit**2:
            ids.append(int(np.argmin(squared)))
        else:
            ids.append(len(words))
            words.append(descriptor)
    return ids, words


@quick
@given(st.integers(0, 10**6), st.integers(0, 40), st.integers(1, 6), st.lists(st.integers(0, 40), max_size=4))
def test_image_by_image_gives_what_all_at_once_gives(seed: int, count: int, kinds: int, cuts: list[int]) -> None:
    descriptors = near_duplicates(seed, count, kinds)
    batch, parts = empty(250.0), empty(250.0)
    together = batch.learn(descriptors)
    apart = [parts.learn(part) for part in np.split(descriptors, sorted(min(cut, count) for cut in cuts))]
    np.testing.assert_array_equal(np.concatenate(apart), together)
    np.testing.assert_array_equal(parts.words, batch.words)
    ids, words = one_by_one(descriptors, 250.0)
    np.testing.assert_array_equal(together, ids)
    assert len(batch) == len(words)
    assert set(batch.match(descriptors)) == set(ids)


def at_distance(squared: int) -> np.ndarray:
    """A descriptor that far from the zero one, as a sum of squares of bytes."""
    values = []
    while squared:
        values.append(min(255, int(squared**0.5)))
        squared -= values[-1] ** 2
    return np.array([values + [0] * (128 - len(values))], np.uint8)


@pytest.mark.parametrize(("squared", "alias"), [(2499, True), (2500, True), (2501, False)])
def test_the_limit_is_exact(squared: int, alias: bool) -> None:
    vocabulary = empty(50.0)
    vocabulary.learn(at_distance(0))
    assert list(vocabulary.match(at_distance(squared))) == ([0] if alias else [])
    assert list(vocabulary.learn(at_distance(squared))) == [0 if alias else 1]
    assert len(vocabulary) == (1 if alias else 2)


def test_distances_of_the_farthest_descriptors_are_exact() -> None:
    """The largest sums still fit float32's whole numbers."""
    full = np.full((1, 128), 255, np.uint8)
    less = full.copy()
    less[0, 0] = 254
    vocabulary = empty(0.5)
    assert list(vocabulary.learn(np.concatenate([full, less, full]))) == [0, 1, 0]


def test_duplicates_are_aliases() -> None:
    descriptors = np.repeat(near_duplicates(1, 1, 1), 5, axis=0)
    vocabulary = empty(0.0)
    assert list(vocabulary.learn(descriptors)) == [0] * 5
    assert list(vocabulary.learn(descriptors)) == [0] * 5
    assert len(vocabulary) == 1


def test_of_two_words_equally_near_the_older_is_meant() -> None:
    old, new, between = (np.array([[value] + [0] * 127], np.uint8) for value in (0, 100, 50))
    vocabulary = empty(60.0)
    vocabulary.learn(old)
    assert list(vocabulary.learn(np.concatenate([new, between]))) == [1, 0]
    assert list(vocabulary.match(between)) == [0]


def test_an_empty_vocabulary_knows_nothing() -> None:
    vocabulary = empty(250.0)
    assert len(vocabulary.match(near_duplicates(1, 3, 1))) == 0
    assert len(vocabulary.learn(np.zeros((0, 128), np.uint8))) == 0


@quick
@given(st.integers(0, 10**6), st.integers(0, 40), st.lists(st.integers(0, 40), max_size=4), st.integers(1, 9))
def test_float_descriptors_of_any_size_do_not_depend_on_the_images(
    seed: int, count: int, cuts: list[int], size: int
) -> None:
    rng = np.random.default_rng(seed)
    descriptors = (rng.integers(0, 5, (count, size)) + rng.normal(0, 0.1, (count, size))).astype(np.float32)
    descriptors[rng.random(count) < 0.2] = 1.1
    batch, parts = empty(0.5, size, np.float32), empty(0.5, size, np.float32)
    together = batch.learn(descriptors)
    apart = [parts.learn(part) for part in np.split(descriptors, sorted(min(cut, count) for cut in cuts))]
    np.testing.assert_array_equal(np.concatenate(apart), together)
    np.testing.assert_array_equal(parts.words, batch.words)
    assert parts.words.dtype == np.float32
    words: list[np.ndarray] = []
    for descriptor, word in zip(descriptors.astype(float), together, strict=True):
        distances = [float(np.linalg.norm(descriptor - other)) for other in words]
        if distances and min(distances) <= 0.5:
            assert distances[word] <= min(distances) + 1e-9
        else:
            assert word == len(words)
            words.append(descriptor)


def test_equal_floats_are_aliases_at_no_distance_at_all() -> None:
    moments = np.array([[-2.71, 1e3, 0.1, -7e-3, 1 / 3, 9.99, 41.0]] * 4, np.float32)
    vocabulary = empty(0.0, 7, np.float32)
    assert list(vocabulary.learn(moments)) == [0] * 4
    assert list(vocabulary.match(moments)) == [0]
