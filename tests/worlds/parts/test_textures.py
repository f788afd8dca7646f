from collections.abc import Callable

import cv2
import numpy as np
import pytest

from worlds.parts import textures


def keypoints(image: np.ndarray) -> int:
    return len(cv2.SIFT_create().detect(image, None))


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("style", ["text", "plots", "photo", "mixed", "diagram"])
def test_posters_are_full_of_features(style: str) -> None:
    assert keypoints(textures.poster((0.841, 1.189), style, rng())) > 200


def test_notice_boards_are_full_of_features() -> None:
    assert keypoints(textures.notice_board((1.8, 1.0), 12, rng())) > 500


def test_blank_plaster_has_nearly_none() -> None:
    image = textures.plaster((4.0, 2.8), 0.7, rng())
    seen = cv2.resize(image, None, fx=6.4, fy=6.4, interpolation=cv2.INTER_LINEAR)[400:880, 400:1040]
    assert keypoints(seen) < 10


def test_plaster_has_the_albedo_of_its_paint() -> None:
    assert textures.linear(textures.plaster((4.0, 2.8), 0.7, rng())).mean() == pytest.approx(0.7, abs=0.01)


def test_srgb_code_is_that_of_the_standard() -> None:
    assert (textures.tone(0.2140), textures.tone(0.2159)) == (127, 128)
    codes = np.arange(256, dtype=np.uint8)
    np.testing.assert_allclose(255 * textures.srgb(textures.linear(codes)), codes, atol=1e-3)


def test_dither_keeps_the_mean_of_a_tone_between_two_codes() -> None:
    image = textures.encode(np.full((200, 200), 0.7), rng())
    assert set(np.unique(image)) == {217, 218}
    assert textures.linear(image).mean() == pytest.approx(0.7, abs=2e-3)


def test_night_outside_is_dark_with_a_few_lights() -> None:
    night, day = (textures.linear(textures.outside(2048, 320, 0.25, d, rng())) for d in (False, True))
    assert np.median(night) < 0.02
    assert night.max() > 0.2
    assert np.median(day) > 0.2


@pytest.mark.parametrize("draw", [textures.tiles, textures.ceiling_panels])
def test_tiles_repeat_without_a_seam(draw: Callable[..., textures.Image]) -> None:
    image = draw((8, 4), 0.5, rng())
    assert image.shape[1] % 8 == 0
    assert image.shape[0] % 4 == 0
    assert image[:, 0].mean() < image[:, 20].mean()
