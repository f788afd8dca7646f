"""Noise that was put on a picture is read off it, whatever the picture shows beside."""

import numpy as np
import pytest

from refseq.health.noise import picture_noise


@pytest.mark.parametrize("sigma", [2.0, 8.0, 20.0])
def test_noise_is_measured_on_walls_that_get_darker_and_have_edges(sigma: float) -> None:
    rng = np.random.default_rng(4)
    wall = np.linspace(80, 150, 640) + np.linspace(-20, 20, 480)[:, None]
    wall[:, 200:] += 30.0  # an edge of a door
    picture = (wall + rng.normal(0, sigma, wall.shape)).clip(0, 255).round().astype(np.uint8)
    assert picture_noise(picture) == pytest.approx(sigma, rel=0.05)


@pytest.mark.parametrize("shape", [(480, 640), (2, 640), (1, 1), (0, 0), (3, 3)])
def test_a_picture_without_noise_or_too_small_for_any_has_none(shape: tuple[int, int]) -> None:
    assert picture_noise(np.full(shape, 70, np.uint8)) == 0.0
