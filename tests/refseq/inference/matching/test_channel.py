import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from refseq.inference.matching.channel import ChannelModel, capacity, feature_counts, z_channel
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import Noise

rates = st.floats(0, 1)


def told(share: float, noise: Noise) -> float:
    """I(there; seen) of a feature of a share of the places [bits], from the joint table."""
    joint = np.array(
        [
            [share * noise.detection, share * (1 - noise.detection)],
            [(1 - share) * noise.false_alarm, (1 - share) * (1 - noise.false_alarm)],
        ]
    )
    apart = np.outer(joint.sum(axis=1), joint.sum(axis=0))
    return float(sum(p * math.log2(p / q) for p, q in zip(joint.flat, apart.flat, strict=True) if p > 0))


@given(rates, rates)
def test_capacity_is_the_most_that_any_share_of_places_tells(p: float, q: float) -> None:
    noise = Noise(p, q)
    best = minimize_scalar(lambda share: -told(share, noise), bounds=(0, 1), method="bounded", options={"xatol": 1e-9})
    assert capacity(noise) == pytest.approx(-best.fun, abs=1e-6)


def test_capacities_of_textbooks() -> None:
    """Noiseless; symmetric, 1 − h(0.11) = ½; the Z-channel with a half, log2(5 / 4); and one that tells nothing."""
    assert capacity(Noise(1.0, 0.0)) == pytest.approx(1.0)
    assert capacity(Noise(0.89, 0.11)) == pytest.approx(0.5, abs=1e-3)
    assert capacity(z_channel(Noise(0.5, 0.3))) == pytest.approx(math.log2(1.25))
    assert capacity(Noise(0.4, 0.4)) == 0.0


def matrix_of(dense: np.ndarray) -> IncidenceMatrix:
    """A matrix of one block."""
    return IncidenceMatrix.from_columns(
        [{"a/laser": np.flatnonzero(column)} for column in dense.T], {"a/laser": len(dense)}
    )


def test_counts_by_hand() -> None:
    dense = np.array([[1, 0, 0], [1, 1, 0], [0, 0, 1], [0, 0, 0]])
    counts = feature_counts(
        matrix_of(dense),
        range(4),
        [(0, np.array([0, 2])), (1, np.array([1])), (1, np.array([], int)), (2, np.array([2]))],
    )
    assert counts.there.tolist() == [1, 3, 1, 0]
    assert counts.detected.tolist() == [1, 1, 1, 0]
    assert counts.absent.tolist() == [3, 1, 3, 4]
    assert counts.alarms.tolist() == [0, 0, 1, 0]
    assert counts.noise == Noise(3.5 / 6, 1.5 / 12)
    p, q = counts.rates(strength=2.0)
    assert p == pytest.approx((counts.detected + 2 * 3.5 / 6) / (counts.there + 2))
    assert q == pytest.approx((counts.alarms + 2 * 1.5 / 12) / (counts.absent + 2))


def test_rates_of_a_drive_are_found_again_and_the_likelihood_is_the_dense_product() -> None:
    rng = np.random.default_rng(1)
    dense = rng.random((60, 20)) < 0.3
    p, q = rng.uniform(0.3, 0.9, 60), rng.uniform(0.01, 0.1, 60)
    places = rng.integers(0, 20, 3000)
    views = [(int(k), np.flatnonzero(rng.random(60) < np.where(dense[:, k], p, q))) for k in places]
    matrix = matrix_of(dense)
    counts = feature_counts(matrix, range(60), views)
    found_p, found_q = counts.rates()
    assert np.abs(found_p - p).max() < 0.1
    assert np.abs(found_q - q).max() < 0.05
    model, (_, ids) = ChannelModel(matrix, {"a/laser": counts}), views[0]
    seen = np.isin(np.arange(60), ids)[:, None]
    rate = np.where(dense, found_p[:, None], found_q[:, None])
    expected = np.log(np.where(seen, rate, 1 - rate)).sum(axis=0)
    scores = model.log_likelihood({"a/laser": ids})
    np.testing.assert_allclose(scores - scores[0], expected - expected[0], atol=1e-9)
    assert not model.log_likelihood({}).any()
