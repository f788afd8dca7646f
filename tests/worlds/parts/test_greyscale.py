import numpy as np
import pytest

from refseq_bench.worlds.parts import greyscale


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_srgb_code_is_that_of_the_standard() -> None:
    assert (greyscale.grey(0.2140), greyscale.grey(0.2159)) == (127, 128)
    codes = np.arange(256, dtype=np.uint8)
    np.testing.assert_allclose(255 * greyscale.srgb(greyscale.linear(codes)), codes, atol=1e-3)


def test_dither_keeps_the_mean_of_a_tone_between_two_codes() -> None:
    image = greyscale.encode(np.full((200, 200), 0.7), rng())
    assert set(np.unique(image)) == {217, 218}
    assert greyscale.linear(image).mean() == pytest.approx(0.7, abs=2e-3)
