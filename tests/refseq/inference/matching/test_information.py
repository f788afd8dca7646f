"""Information against brute force: the joint table of every view and place, on matrices small enough to write it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import (
    NOISELESS,
    Noise,
    coin_entropy,
    column_information,
    feature_information,
    neighbour_noise,
    posterior_information,
    proven_information,
    view_information,
)
from refseq.inference.matching.neighbours import Neighbours

quick = settings(derandomize=True)
matrices = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(lambda shape: arrays(np.bool_, shape))
rates = st.floats(0, 1) | st.sampled_from([0.0, 0.5, 1.0])
noises = st.builds(Noise, rates, rates)


def packed(dense: np.ndarray, split: int | None = None) -> IncidenceMatrix:
    split = len(dense) if split is None else split
    columns = [{"a": np.flatnonzero(column[:split]), "b": np.flatnonzero(column[split:])} for column in dense.T]
    return IncidenceMatrix.from_columns(columns, {"a": split, "b": len(dense) - split})


def joint_table(dense: np.ndarray, noise: list[Noise]) -> np.ndarray:
    """P(v, k), (2^N, K): the probability of every view at every place."""
    N, K = dense.shape
    table = np.zeros((2**N, K))
    for index, view in enumerate(itertools.product([False, True], repeat=N)):
        for k in range(K):
            chance = 1 / K
            for seen, there, of_feature in zip(view, dense[:, k], noise, strict=True):
                rate = of_feature.detection if there else of_feature.false_alarm
                chance *= rate if seen else 1 - rate
            table[index, k] = chance
    return table


def mutual_information(table: np.ndarray) -> float:
    """Σ P(x, k) log2 (P(x, k) / P(x) P(k))."""
    independent = table.sum(axis=1, keepdims=True) * table.sum(axis=0, keepdims=True)
    there = table > 0
    return float(np.sum(table[there] * np.log2(table[there] / independent[there])))


# --- features ---


@quick
@given(matrices, noises)
def test_a_feature_tells_what_its_joint_table_says(dense: np.ndarray, noise: Noise) -> None:
    found = feature_information(packed(dense), range(len(dense)), noise)
    for row, bits in zip(dense, found, strict=True):
        assert bits == pytest.approx(mutual_information(joint_table(row[None], [noise])), abs=1e-9)
        assert 0 <= bits <= min(1, math.log2(len(row))) + 1e-12


def test_a_coin_that_falls_either_way_has_a_bit() -> None:
    np.testing.assert_allclose(coin_entropy(np.array([0.0, 0.5, 1.0, 0.25])), [0, 1, 0, 0.811278], atol=1e-6)


def test_a_feature_of_half_of_the_places_tells_a_bit_and_a_constant_one_nothing() -> None:
    dense = np.array([[1, 1, 0, 0], [1, 1, 1, 1], [0, 0, 0, 0], [1, 0, 0, 0]], bool)
    np.testing.assert_allclose(feature_information(packed(dense), range(4)), [1, 0, 0, 0.811278], atol=1e-6)
    np.testing.assert_allclose(feature_information(packed(dense), range(3, 4)), [0.811278], atol=1e-6)
    # What is seen as often without the feature as with it tells nothing.
    np.testing.assert_allclose(feature_information(packed(dense), range(4), Noise(0.3, 0.3)), 0, atol=1e-12)


@quick
@given(arrays(np.bool_, st.tuples(st.integers(1, 4), st.integers(1, 6))), st.data())
def test_rates_of_neighbours_are_those_counted_by_hand(dense: np.ndarray, data: st.DataObject) -> None:
    split = data.draw(st.integers(0, len(dense)))
    pairs = [(now, after) for row in dense[split:] for now, after in itertools.pairwise(row)]
    there, absent = [after for now, after in pairs if now], [after for now, after in pairs if not now]
    found = neighbour_noise(packed(dense, split), range(split, len(dense)))
    assert found.detection == pytest.approx((sum(there) + 0.5) / (len(there) + 1))
    assert found.false_alarm == pytest.approx((sum(absent) + 0.5) / (len(absent) + 1))


def test_rates_of_neighbours_count_no_pair_over_a_gap() -> None:
    """Places 0 to 2 and 3 to 5 are 30 m apart: four pairs a feature are left of five."""
    dense = np.array([[1, 1, 1, 1, 1, 1], [0, 0, 1, 1, 0, 0], [0, 0, 1, 0, 1, 1]], bool)
    found = neighbour_noise(packed(dense), range(3), Neighbours.of(np.array([0.0, 1, 2, 32, 33, 34])))
    # Seen again: 4 of 4 times, 0 of 1, 1 of 1; seen anew: 0 of 0 times, 1 of 3, 2 of 3.
    assert found.detection == pytest.approx((5 + 0.5) / (6 + 1))
    assert found.false_alarm == pytest.approx((3 + 0.5) / (6 + 1))


@pytest.mark.parametrize("rates", [(1.1, 0.0), (0.5, -0.1), (math.nan, 0.0)])
def test_a_rate_that_is_no_probability_is_refused(rates: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=r"is no probability; valid is 0 to 1$"):
        Noise(*rates)


# --- views ---


@settings(quick, max_examples=10)
@given(matrices, noises, noises, st.data())
def test_views_tell_what_their_joint_table_says(
    dense: np.ndarray, noise: Noise, other: Noise, data: st.DataObject
) -> None:
    split = data.draw(st.integers(0, len(dense)))
    matrix = packed(dense, split)
    found = view_information(matrix, {"a": noise, "b": other}, np.random.default_rng(0), draws=400)
    exact = mutual_information(joint_table(dense, [noise] * split + [other] * (len(dense) - split)))
    limit = math.log2(dense.shape[1])
    assert found.limit == limit
    assert 0 <= found.bits <= limit
    assert -1e-12 <= exact <= limit + 1e-12
    # Places are drawn evenly, not one by one, which makes the estimate better than its error says; a rare view of much
    # information may be in no draw at all, hence the floor.
    assert abs(found.bits - exact) <= 5 * found.error + 0.02


def test_an_estimate_comes_nearer_with_more_draws() -> None:
    dense = np.random.default_rng(1).random((6, 5)) < 0.5
    noise = Noise(0.7, 0.2)
    exact = mutual_information(joint_table(dense, [noise] * 6))
    errors = []
    for draws in (100, 2500):
        found = view_information(packed(dense), {"a": noise}, np.random.default_rng(2), draws)
        assert abs(found.bits - exact) < 4 * found.error
        errors.append(found.error)
    assert errors[1] == pytest.approx(errors[0] / 5, rel=0.3)


@quick
@given(matrices, st.data())
def test_without_noise_places_are_told_apart_as_far_as_their_columns_differ(
    dense: np.ndarray, data: st.DataObject
) -> None:
    split = data.draw(st.integers(0, len(dense)))
    matrix = packed(dense, split)
    found = column_information(matrix, matrix.blocks["b"])
    assert found.bits == pytest.approx(
        mutual_information(joint_table(dense[split:], [NOISELESS] * (len(dense) - split))), abs=1e-9
    )
    drawn = view_information(matrix, {"b": NOISELESS}, np.random.default_rng(0), draws=dense.shape[1])
    assert drawn.bits == pytest.approx(found.bits, abs=1e-9)
    both = column_information(matrix, matrix.blocks["a"], matrix.blocks["b"])
    assert found.bits - 1e-9 <= both.bits <= both.limit == math.log2(dense.shape[1])
    assert column_information(matrix) == both, "of all, as without blocks the statistics are"


def test_two_places_alike_and_two_alone_tell_one_and_a_half_bits() -> None:
    matrix = packed(np.array([[1, 1, 0, 0], [1, 1, 0, 1]], bool))
    assert column_information(matrix, range(2)).bits == pytest.approx(1.5)  # entropy of ½, ¼, ¼


def test_the_same_seed_gives_the_same_estimate_and_without_draws_there_is_none() -> None:
    matrix = packed(np.random.default_rng(1).random((6, 5)) < 0.5)
    one, two = (view_information(matrix, {"a": Noise(0.7, 0.2)}, np.random.default_rng(7), 50) for _ in range(2))
    assert one == two
    with pytest.raises(ValueError, match=r"^0 draws; valid is at least one$"):
        view_information(matrix, {"a": NOISELESS}, np.random.default_rng(7), 0)


# --- posteriors ---

posteriors = st.integers(1, 6).flatmap(
    lambda K: st.lists(
        st.lists(st.floats(0, 1), min_size=K, max_size=K)
        .filter(lambda weights: sum(weights) > 1e-6)
        .map(lambda weights: np.array(weights) / sum(weights)),
        min_size=1,
        max_size=5,
    )
)


@quick
@given(posteriors)
def test_posteriors_tell_between_nothing_and_the_place(found: list[np.ndarray]) -> None:
    told = posterior_information(found)
    assert 0 <= told.bits <= told.limit == math.log2(len(found[0]))
    by_hand = [sum(-p * math.log2(p) for p in posterior if p > 0) for posterior in found]
    assert told.bits == pytest.approx(told.limit - np.mean(by_hand), abs=1e-9)


def test_sure_posteriors_tell_all_and_uniform_ones_nothing() -> None:
    assert posterior_information(list(np.eye(8))).bits == 3
    assert posterior_information([np.full(8, 1 / 8)] * 3).bits == pytest.approx(0)
    assert proven_information(list(np.eye(8)), range(8)).bits == 3
    assert proven_information([np.full(8, 1 / 8)] * 3, [0, 4, 7]).bits == pytest.approx(0)
    assert posterior_information([np.ones(1)]).limit == 0


@quick
@given(matrices, noises, noises)
def test_proven_information_never_exceeds_what_there_is(dense: np.ndarray, true: Noise, believed: Noise) -> None:
    """Averaged over all views and places, whatever rates the posteriors were made with; equal for the true ones."""
    table, model = (joint_table(dense, [noise] * len(dense)) for noise in (true, believed))
    exact = mutual_information(table)
    bits = 0.0
    for view, of_model in zip(table, model, strict=True):
        if view.sum() == 0:
            continue
        K = len(view)
        posterior = of_model / of_model.sum() if of_model.sum() > 0 else np.full(K, 1 / K)
        bits += sum(view[k] * proven_information([posterior], [k]).bits for k in range(K) if view[k] > 0)
    assert bits <= exact + 1e-9
    if true == believed:
        assert bits == pytest.approx(exact, abs=1e-9)


def test_a_true_place_that_was_ruled_out_costs_everything() -> None:
    found = proven_information([np.array([0.5, 0.5]), np.array([1.0, 0.0])], [0, 1])
    assert (found.bits, found.error) == (-math.inf, math.inf)
    surer = proven_information([np.array([0.9, 0.1])], [1])
    assert surer.bits == pytest.approx(1 + math.log2(0.1))
