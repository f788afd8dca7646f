from collections.abc import Callable

import cv2
import numpy as np
import pytest

from refseq_bench.worlds.parts import greyscale, textures


def keypoints(image: np.ndarray) -> int:
    return len(cv2.SIFT_create().detect(image, None))


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_blank_plaster_has_nearly_none() -> None:
    image = textures.plaster((4.0, 2.8), 0.7, rng())
    seen = cv2.resize(image, None, fx=6.4, fy=6.4, interpolation=cv2.INTER_LINEAR)[400:880, 400:1040]
    assert keypoints(seen) < 10


def test_plaster_has_the_albedo_of_its_paint() -> None:
    assert greyscale.linear(textures.plaster((4.0, 2.8), 0.7, rng())).mean() == pytest.approx(0.7, abs=0.01)


@pytest.mark.parametrize("draw", [textures.tiles, textures.ceiling_panels])
def test_tiles_repeat_without_a_seam(draw: Callable[..., greyscale.Image]) -> None:
    image = draw((8, 4), 0.5, rng())
    assert image.shape[1] % 8 == 0
    assert image.shape[0] % 4 == 0
    assert image[:, 0].mean() < image[:, 20].mean()
