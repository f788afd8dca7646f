"""Evidence of a few places beside the words': what is blind with words is one product with them, whoever is first."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.belief import Timings
from refseq.inference.matching.log_ratio import unless_blind
from refseq.map.blocks.few_places import FewPlaces
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.view import Scan, View

BLIND = 0.2
WORDS, KEYS, SCAN = np.log([3.0, 0.1, 1.0]), np.log([50.0, 2.0, 1.0]), np.log([0.1, 0.01, 20.0])


@dataclass
class Told:
    """A block that tells the same of every view."""

    ratios: NDArray[np.float64]
    blind: float
    most: int = 3
    sees: bool = True

    def told(self, places: NDArray[np.intp]) -> NDArray[np.float64]:
        return self.ratios[places]


@pytest.fixture(scope="module")
def map_() -> Map:
    walls = Scan(np.full(19, 3.0), -math.pi / 2, math.pi / 18, 8.0)
    return learn([View(float(k), scan=walls, distance=0.85 * (k > 0)) for k in range(3)], profile="best")


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
