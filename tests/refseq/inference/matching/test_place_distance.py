import math
from itertools import product

import numpy as np
import pytest

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import Noise, neighbour_noise
from refseq.inference.matching.place_distance import PlaceDistances, nats_a_difference


def matrix_of(bits: np.ndarray) -> IncidenceMatrix:
    """One extractor's matrix, from (K, N)."""
    return IncidenceMatrix.from_columns([{"a": np.flatnonzero(row)} for row in bits], {"a": bits.shape[1]})


def probability(seen: tuple[int, ...], column: np.ndarray, noise: Noise) -> float:
    rates = np.where(column, noise.detection, noise.false_alarm)
    return float(np.prod(np.where(seen, rates, 1 - rates)))


def test_it_is_juangs_measure_both_ways_over_all_observations() -> None:
    bits = np.random.default_rng(3).random((6, 4)) < 0.5
    matrix = matrix_of(bits)
    noise, distances = neighbour_noise(matrix, matrix.blocks["a"]), PlaceDistances(matrix)

    def lost(of: int, by: int) -> float:
        """Nats that an observation of one place loses on average when it is explained by another."""
        every = [(probability(o, bits[of], noise), probability(o, bits[by], noise)) for o in product((0, 1), repeat=4)]
        return math.fsum(p * math.log(p / q) for p, q in every)

    for one, other in product(range(6), repeat=2):
        assert distances.nats(one, other) == pytest.approx((lost(one, other) + lost(other, one)) / 2, abs=1e-12)


def test_the_scale_is_that_of_places_far_apart() -> None:
    bits = np.kron(np.eye(8, dtype=bool), np.ones((2, 3), bool))  # pairs of places that show the same three features
    distances = PlaceDistances(matrix_of(bits))
    assert distances.between(0, 1) == 0
    assert distances.between(0, 9) == pytest.approx(1)


def test_places_that_all_show_the_same_are_not_apart() -> None:
    assert PlaceDistances(matrix_of(np.ones((5, 3), bool))).between(0, 4) == 0


def test_the_few_places_that_show_anything_are_told_apart() -> None:
    bits = np.zeros((12, 6), bool)
    bits[2, :3] = bits[9, 3:] = True
    distances = PlaceDistances(matrix_of(bits))
    assert distances.between(2, 3) == math.inf
    assert distances.between(3, 4) == 0


def test_a_feature_that_is_seen_no_more_often_where_it_is_tells_nothing() -> None:
    assert nats_a_difference(Noise(0.2, 0.2)) == 0
    assert nats_a_difference(Noise(0.9, 0.1)) > nats_a_difference(Noise(0.6, 0.1)) > 0
