import numpy as np

from refseq_bench.worlds.lighting import outlook
from refseq_bench.worlds.parts import greyscale


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_night_outside_is_dark_with_a_few_lights() -> None:
    night, day = (greyscale.linear(outlook.outside(2048, 320, 0.25, d, rng())) for d in (False, True))
    assert np.median(night) < 0.02
    assert night.max() > 0.2
    assert np.median(day) > 0.2
