"""Evidence of a few places beside the words': what is blind with words is one product with them, whoever is first."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.belief import Timings, belief_from
from refseq.inference.matching.log_ratio import unless_blind
from refseq.map.blocks.few_places import NO_PLACES, FewPlaces
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.view import Scan, View

BLIND = 0.2
SCREENED = np.log([5.0, 6.0, 7.0])
WORDS, KEYS, SCAN = np.log([3.0, 0.1, 1.0]), np.log([50.0, 2.0, 1.0]), np.log([0.1, 0.01, 20.0])


@dataclass
class Told:
    """A block that tells the same of every view, and brought a tenth of that."""

    ratios: NDArray[np.float64]
    blind: float
    most: int = 3
    key: str = ""
    sees: bool = True
    screened: int = 0

    def log_ratios(self, places: NDArray[np.intp], screened: NDArray[np.intp] = NO_PLACES) -> NDArray[np.float64]:
        return np.concatenate([self.ratios[places], SCREENED[screened]])

    def brought(self, places: NDArray[np.intp]) -> dict[str, NDArray[np.float64]]:
        return {self.key: self.ratios[places] / 10} if self.key else {}


def learnt(profile: str) -> Map:
    walls = Scan(np.full(19, 3.0), -math.pi / 2, math.pi / 18, 8.0)
    return learn([View(float(k), scan=walls, distance=0.85 * (k > 0)) for k in range(3)], profile=profile)


@pytest.fixture(scope="module")
def map_() -> Map:
    return learnt("best")


@pytest.mark.parametrize(
    ("screened", "ratios"), [(0, [0.1, 1, 1]), (1, [0.1, 1, 1]), (2, [0.1, 1, 7]), (9, [0.1, 6, 7])]
)
def test_places_that_words_find_likely_are_screened_but_those_they_name(
    map_: Map, screened: int, ratios: list[float]
) -> None:
    """Of the words' order, places 0, 2 and 1, the first is named; so many from the first on are looked through."""
    measured = Measurement(np.ones(3) / 3, 0.85, Timings(), WORDS)
    last = replace(belief_from(np.ones(3)), lost=0.0)
    (weighed,) = FewPlaces(map_, [Told(SCAN, 0.0, most=1, screened=screened)]).weighed([measured], last)
    assert weighed.log_ratio is not None
    np.testing.assert_allclose(np.exp(weighed.log_ratio - WORDS), ratios)


@pytest.mark.parametrize("first", ["keys", "scan"])
def test_a_ratio_of_its_own_is_multiplied_behind_what_is_blind_with_words(map_: Map, first: str) -> None:
    blocks = [Told(KEYS, BLIND), Told(SCAN, 0.0)]
    words = unless_blind(WORDS, BLIND)
    measured = Measurement(np.ones(3) / 3, 0.85, Timings(), words)
    few = FewPlaces(map_, blocks if first == "keys" else blocks[::-1])
    (weighed,) = few.weighed([measured], None)
    expected = (BLIND + (1 - BLIND) * np.exp(WORDS + KEYS)) * np.exp(SCAN)
    assert weighed.log_ratio is not None
    np.testing.assert_allclose(np.exp(weighed.log_ratio), expected)
    np.testing.assert_allclose(weighed.never_blind, SCAN)


def test_what_blocks_brought_stands_beside_what_words_did_where_they_were_asked(map_: Map) -> None:
    """One place is asked on the way, twice as many at a start: of others nobody knows."""
    words = Measurement(np.ones(3) / 3, 0.85, Timings(), WORDS, by_block={"sift/camera": WORDS})
    keys = Told(KEYS, BLIND, most=1, key="keys/camera")
    (weighed,) = FewPlaces(map_, [keys]).weighed([words], None)
    assert set(weighed.by_block) == {"sift/camera", "keys/camera"}
    assert weighed.by_block["sift/camera"].tolist() == WORDS.tolist()
    np.testing.assert_array_equal(weighed.by_block["keys/camera"], [KEYS[0] / 10, np.nan, KEYS[2] / 10])
    unasked = FewPlaces(learnt("best+log_ratio.usual=0"), [keys]).weighed([words], None)
    assert set(unasked[0].by_block) == {"sift/camera"}
