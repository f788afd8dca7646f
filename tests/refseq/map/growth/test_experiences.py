"""Layers of experiences: a place's ratio is the mean over what it showed, and older experiences make room."""

from dataclasses import replace

import numpy as np
import pytest

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.log_ratio import LogRatioModel, LogRatioSettings
from refseq.map.growth.experiences import FIRST, Experiences, LayeredRatios, showing

K, N = 30, 120
ALONG = np.arange(K, dtype=float)


def columns_of(shown: np.ndarray) -> list[dict[str, np.ndarray]]:
    return [{"bits/a": np.flatnonzero(column)} for column in shown.T]


def matrix_of(shown: np.ndarray) -> IncidenceMatrix:
    return IncidenceMatrix.from_columns(columns_of(shown), {"bits/a": len(shown)})


@pytest.fixture
def first() -> np.ndarray:
    return np.random.default_rng(1).random((N, K)) < 0.15


@pytest.fixture
def later() -> np.ndarray:
    """Later views of places 4, 5 and 20, and of place 5 once more, (N, 4)."""
    return np.random.default_rng(2).random((N, 4)) < 0.15


def experiences_of(later: np.ndarray) -> Experiences:
    return Experiences(matrix_of(later), np.array([4, 5, 20, 5]), np.zeros(4, np.intp))


def test_a_matrix_shows_the_experiences_asked_for_and_all_else_as_it_was(first: np.ndarray, later: np.ndarray) -> None:
    shown = showing(matrix_of(first), experiences_of(later), np.array([0, 2]))
    wanted = first.copy()
    wanted[:, [4, 20]] = later[:, [0, 2]]
    for place, column in enumerate(shown.columns()):
        np.testing.assert_array_equal(column, np.flatnonzero(wanted[:, place]))


def test_a_ratio_is_the_mean_over_all_experiences(first: np.ndarray, later: np.ndarray) -> None:
    settings, base = LogRatioSettings(), matrix_of(first)
    its = experiences_of(later)
    np.testing.assert_array_equal(its.ranks, [0, 0, 0, 1])
    model = LogRatioModel(base, ALONG, settings)
    layered = LayeredRatios(model, base, ALONG, settings, its)
    layers = []
    for numbers in ([0, 1, 2], [3]):
        wanted = first.copy()
        wanted[:, its.places[numbers]] = later[:, numbers]
        layers.append(LogRatioModel(matrix_of(wanted), ALONG, settings))
    observed = {"bits/a": np.flatnonzero(later[:, 3])}
    alone = np.exp(model.log_ratios(observed))
    one, two = (np.exp(layer.log_ratios(observed)) for layer in layers)
    wanted = alone.copy()
    wanted[[4, 20]] = (alone[[4, 20]] + one[[4, 20]]) / 2
    wanted[5] = (alone[5] + one[5] + two[5]) / 3
    np.testing.assert_allclose(np.exp(layered.ratios(observed).log_ratios), wanted)
    assert layered.ratios(observed).by_block == {}
    asking = LayeredRatios(model, base, ALONG, replace(settings, usual=1), its).ratios(observed)
    blocks = [np.exp(one.by_block(observed)["bits/a"]) for one in (model, *layers)]
    mean = blocks[0].copy()
    mean[[4, 20]] = (blocks[0][[4, 20]] + blocks[1][[4, 20]]) / 2
    mean[5] = sum(block[5] for block in blocks) / 3
    np.testing.assert_allclose(np.exp(asking.by_block["bits/a"]), mean)
    np.testing.assert_array_equal(asking.log_ratios, layered.ratios(observed).log_ratios)
    assert np.argmax(wanted) == 5
    assert np.argmax(alone) != 5
    assert layered.best(observed, 5) == 3
    assert layered.best({"bits/a": np.flatnonzero(first[:, 5])}, 5) == FIRST


def test_experiences_go_with_their_places(later: np.ndarray) -> None:
    left = experiences_of(later).at(np.array([3, 5, 20, 21]))
    np.testing.assert_array_equal(left.places, [1, 2, 1])
    columns = list(left.matrix.columns())
    for column, number in zip(columns, [1, 2, 3], strict=True):
        np.testing.assert_array_equal(column, np.flatnonzero(later[:, number]))
