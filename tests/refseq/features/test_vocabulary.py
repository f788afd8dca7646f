import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.features.vocabulary import Vocabulary

quick = settings(derandomize=True)


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


def in_parts(descriptors: np.ndarray, cuts: list[int]) -> list[np.ndarray]:
    """As images bring them, some of them empty."""
    return np.split(descriptors, sorted(min(cut, len(descriptors)) for cut in cuts))


@quick
@given(
    st.integers(0, 10**6),
    st.integers(0, 60),
    st.integers(1, 6),
    st.lists(st.integers(0, 60), max_size=12),
    st.sampled_from([0.0, 120.0, 250.0, 400.0]),
)
def test_image_by_image_gives_what_the_rule_gives_all_at_once(
    seed: int, count: int, kinds: int, cuts: list[int], limit: float
) -> None:
    descriptors = near_duplicates(seed, count, kinds)
    batch, parts = empty(limit), empty(limit)
    together = batch.learn(descriptors)
    apart = [parts.learn(part) for part in in_parts(descriptors, cuts)]
    np.testing.assert_array_equal(np.concatenate(apart), together)
    np.testing.assert_array_equal(parts.words, batch.words)
    ids, words = one_by_one(descriptors, limit)
    np.testing.assert_array_equal(together, ids)
    np.testing.assert_array_equal(batch.words, np.reshape(words, (-1, 128)))
    assert set(batch.match(descriptors)) <= set(ids)


def test_more_descriptors_and_words_than_are_compared_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("refseq.features.vocabulary.BLOCK", 16)
    monkeypatch.setattr("refseq.features.nearest.BLOCK", 16)
    descriptors = near_duplicates(5, 300, 90)
    vocabulary = empty(250.0)
    ids, words = one_by_one(descriptors, 250.0)
    np.testing.assert_array_equal(vocabulary.learn(descriptors), ids)
    np.testing.assert_array_equal(vocabulary.words, words)
    assert len(words) > 3 * 16  # or few blocks would have done


@quick
@given(st.integers(0, 10**6), st.integers(1, 30), st.lists(st.integers(0, 90), max_size=8))
def test_duplicates_change_nothing(seed: int, count: int, cuts: list[int]) -> None:
    """Why Algorithm 3's noise may go: whatever repeats what was there, within an image or later, is an alias of it."""
    descriptors = near_duplicates(seed, count, 8)
    rng = np.random.default_rng(seed)
    repeated = np.sort(np.concatenate([np.arange(count), rng.integers(0, count, 2 * count)]))
    alone, often = empty(250.0), empty(250.0)
    expected = alone.learn(descriptors)
    ids = np.concatenate([often.learn(part) for part in in_parts(descriptors[repeated], cuts)])
    np.testing.assert_array_equal(ids, expected[repeated])
    often.learn(descriptors[rng.permutation(count)])
    np.testing.assert_array_equal(often.words, alone.words)


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


def test_growing_leaves_earlier_words_and_the_given_array_alone() -> None:
    descriptors = np.random.default_rng(2).integers(0, 256, (300, 128)).astype(np.uint8)
    given = descriptors[:7].copy()
    vocabulary = Vocabulary(0.0, given)
    seen = [vocabulary.words]
    for start in range(7, 300, 11):
        vocabulary.learn(descriptors[start : start + 11])
        seen.append(vocabulary.words)
    np.testing.assert_array_equal(given, descriptors[:7])
    for words in seen:
        np.testing.assert_array_equal(words, descriptors[: len(words)])
    with pytest.raises(ValueError, match="read-only"):
        vocabulary.words[0] = 0


def test_growing_moves_each_word_a_few_times_only() -> None:
    vocabulary = empty(0.0, 2)
    places = set()
    for number in range(2000):
        vocabulary.learn(np.array([divmod(number, 256)], np.uint8))
        places.add(vocabulary.words.ctypes.data)
    assert len(vocabulary) == 2000
    assert len(places) < 20


def test_words_that_came_after_matching_are_matched_too() -> None:
    first, second = np.full((1, 4), 10, np.uint8), np.full((1, 4), 200, np.uint8)
    vocabulary = Vocabulary(3.0, np.zeros((0, 4), np.uint8))
    vocabulary.learn(first)
    assert vocabulary.match(np.concatenate([first, second])).tolist() == [0]
    vocabulary.learn(second)
    assert vocabulary.match(np.concatenate([first, second])).tolist() == [0, 1]
