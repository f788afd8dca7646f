"""Cameras that change places, on made-up features: numbers, of which each camera's words are a set."""

from typing import Any

import numpy as np
import pytest

from refseq.features.word_extractor import KeyWords, PictureKeys
from refseq.health.change import MOST
from refseq.map.exchange import DESCRIPTORS, FEWEST, ExchangeWatch
from refseq.view import View

LEFT, RIGHT = "left", "right"
WORDS = {LEFT: set(range(0, 100)), RIGHT: set(range(100, 200))}
UNKNOWN = 1000


class NumberWords(KeyWords):
    """A feature whose descriptors are numbers, and whose words are those of a set."""

    def __init__(self, sensor: str, words: set[int], feature: str = "sift") -> None:
        self.sensor, self.key, self._words = sensor, f"{feature}/{sensor}", words
        self.asked: list[int] = []

    def find_keys(self, image: np.ndarray) -> PictureKeys:
        """None: its pictures are numbers."""
        raise NotImplementedError

    def describe(self, view: View) -> np.ndarray:
        """A picture's numbers are its descriptors."""
        return view.images[self.sensor].ravel().astype(np.intp)

    def count_known(self, described: np.ndarray, sample: np.ndarray) -> int:
        """Those that are words."""
        self.asked.append(len(sample))
        return len(self._words & set(described[sample].tolist()))


class DenseNumbers:
    """Words that are of no keys."""

    def __init__(self, sensor: str) -> None:
        self.sensor, self.key = sensor, f"dense/{sensor}"


def watch_of(*sequences: dict[str, set[int]], feature: str = "sift") -> tuple[ExchangeWatch, Any]:
    extractors: Any = [[NumberWords(name, words, feature) for name, words in one.items()] for one in sequences]
    return ExchangeWatch(extractors), extractors


def ratio(watch: ExchangeWatch, left: range | list[int], right: range | list[int]) -> float:
    """The ratio for what both cameras see; both are told the same."""
    seen = {LEFT: np.array(left, np.intp), RIGHT: np.array(right, np.intp)}
    view = View(0.0, images={name: np.zeros((1, 1), np.uint8) for name in seen})
    found = watch.ratios(view, {f"sift/{name}": numbers for name, numbers in seen.items()})
    assert found[LEFT] == found[RIGHT]
    return found[LEFT]


def test_words_of_the_other_camera_speak_for_an_exchange_as_much_as_own_ones_against_it():
    watch, _ = watch_of(WORDS)
    assert ratio(watch, range(20), range(100, 120)) == -MOST
    assert ratio(watch, range(100, 120), range(20)) == MOST
    some, others = [*range(5), *[UNKNOWN] * 15], [*range(100, 105), *[UNKNOWN] * 15]
    assert -MOST < ratio(watch, some, others) < 0
    assert ratio(watch, others, some) == pytest.approx(-ratio(watch, some, others))


@pytest.mark.parametrize("feature", ["sift", "neural"])
def test_words_of_keys_are_compared_whoever_found_them(feature: str):
    watch, _ = watch_of(WORDS, feature=feature)
    images = {LEFT: np.arange(100, 120, dtype=np.uint8), RIGHT: np.arange(20, dtype=np.uint8)}
    both = View(0.0, images={name: image[None] for name, image in images.items()})
    assert watch.ratios(both, {}) == {LEFT: MOST, RIGHT: MOST}


def test_what_neither_or_both_cameras_know_says_nothing():
    watch, _ = watch_of({LEFT: set(range(100)), RIGHT: set(range(100))})
    assert ratio(watch, range(20), range(20)) == 0
    assert ratio(watch, [UNKNOWN] * 20, [UNKNOWN] * 20) == 0


def test_a_camera_that_looks_at_a_bare_wall_leaves_the_word_to_the_other():
    watch, _ = watch_of(WORDS)
    few = list(range(100, 100 + FEWEST - 1))
    assert ratio(watch, range(100, 120), []) == ratio(watch, range(100, 120), few) == MOST
    assert ratio(watch, few, few) == 0


def test_the_sequence_that_knows_most_decides():
    strangers: dict[str, set[int]] = {LEFT: {100, 101}, RIGHT: set()}
    for sequences in ((strangers, WORDS), (WORDS, strangers)):
        watch, _ = watch_of(*sequences)
        assert ratio(watch, [*range(20), 100, 101], range(100, 122)) == -MOST


def test_only_a_sample_is_looked_for():
    watch, ((left, right),) = watch_of(WORDS)
    assert ratio(watch, list(range(90)), list(range(100, 190))) == -MOST
    assert set(left.asked + right.asked) == {DESCRIPTORS}


def test_cameras_that_were_left_out_are_described_here_and_one_that_is_missing_tells_nothing():
    watch, _ = watch_of(WORDS)
    images = {LEFT: np.arange(100, 120, dtype=np.uint8), RIGHT: np.arange(20, dtype=np.uint8)}
    both = View(0.0, images={name: image[None] for name, image in images.items()})
    assert watch.ratios(both, {}) == {LEFT: MOST, RIGHT: MOST}
    assert watch.ratios(View(0.0, images={LEFT: both.images[LEFT]}), {}) == {}


def test_dense_words_are_not_asked():
    watch = ExchangeWatch([[DenseNumbers(name) for name in WORDS]])
    view = View(0.0, images=dict.fromkeys(WORDS, np.zeros((1, 1), np.uint8)))
    assert watch.ratios(view, {}) == {}
