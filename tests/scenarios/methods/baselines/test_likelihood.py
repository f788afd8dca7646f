import numpy as np
import pytest

from refseq_bench.scenarios.methods.baselines.likelihood import SimilarityLikelihood


def cosines(distances: np.ndarray) -> np.ndarray:
    return 1 - distances**2 / 2


def test_contrast_is_reached_between_the_quantiles() -> None:
    distances = np.linspace(0.4, 1.2, 201)
    found = SimilarityLikelihood(7.0)(cosines(distances))
    low, high = np.quantile(found, [0.025, 0.975])
    assert high / low == pytest.approx(7.0, rel=1e-3)
    assert found.max() == found[0] == 1


def test_the_spread_is_the_mean_over_the_views_so_far() -> None:
    similarity = SimilarityLikelihood(4.0)
    narrow, wide = np.linspace(0.5, 0.7, 41), np.linspace(0.5, 1.1, 41)
    similarity(cosines(narrow))
    second = similarity(cosines(wide))
    spreads = [np.subtract(*np.quantile(d, [0.975, 0.025])) for d in (narrow, wide)]
    assert second[-1] == pytest.approx(4.0 ** -(0.6 / np.mean(spreads)))
    similarity.reset()
    assert similarity(cosines(wide))[-1] == pytest.approx(4.0 ** -(0.6 / spreads[1]))


def test_places_that_all_look_alike_are_all_as_likely() -> None:
    assert SimilarityLikelihood(4.0)(np.full(5, 0.3)).tolist() == [1] * 5
