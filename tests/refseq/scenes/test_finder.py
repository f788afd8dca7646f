"""A scene is found where a known homography has put it, and nowhere where it is not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from refseq.errors import SceneError
from refseq.scenes import SceneFinder
from refseq.scenes.finder import projected
from refseq.scenes.scene import Box, cut_scene
from refseq.view import View
from tests.refseq.scenes.drawn import BOX, CAMERA, moved, picture, scene, shown, view

FINDER = SceneFinder(scene())
DRAWN = (Phase.explicit, Phase.generate)
"""A picture takes a while: what fails is not made smaller."""


@settings(max_examples=6, deadline=None, phases=DRAWN)
@given(
    ahead=st.floats(-1.2, 1.0), right=st.floats(-0.4, 0.4), slant=st.floats(-0.6, 0.6), among=st.integers(100, 10_000)
)
def test_a_warped_patch_is_found_where_it_is(ahead: float, right: float, slant: float, among: int) -> None:
    plane = float(np.sin(slant)), 0.0, float(np.cos(slant))
    homography = moved((right, 0.0, ahead), plane, 3.0)
    true = projected(homography, BOX.corners)
    found = FINDER.find(view(shown(FINDER.scene, homography, among)))
    assert true is not None
    assert found is not None
    assert np.abs(found.corners - true).max() < 6


@settings(max_examples=6, deadline=None, phases=DRAWN)
@given(seed=st.integers(100, 100_000))
def test_a_picture_without_it_does_not_show_it(seed: int) -> None:
    assert FINDER.find(view(picture(seed))) is None


@pytest.mark.parametrize("image", [np.zeros((480, 640), np.uint8), np.eye(480, 640, dtype=np.uint8) * 255])
def test_a_picture_with_hardly_a_key_does_not_show_it(image: np.ndarray) -> None:
    assert FINDER.find(view(image)) is None


def test_upside_down_or_mirrored_it_is_another_thing() -> None:
    own = picture(1)
    assert FINDER.find(view(own)) is not None
    assert FINDER.find(view(np.ascontiguousarray(own[::-1, ::-1]))) is None
    assert FINDER.find(view(np.ascontiguousarray(own[:, ::-1]))) is None


def test_a_scene_that_differs_in_one_pixel_is_told_apart_by_its_text() -> None:
    """Results of missions are kept under it; numpy's own text leaves out the middle of a picture."""
    patch = scene().patch.copy()
    patch[90, 100] ^= 1
    assert repr(replace(scene(), patch=patch)) != repr(scene()) == repr(scene())


def test_a_scene_with_too_few_keys_is_refused() -> None:
    with pytest.raises(SceneError, match=r"^the scene has 0 keys to know it by; valid are 40 or more"):
        SceneFinder(replace(scene(), patch=np.zeros((180, 200), np.uint8)))


def test_another_camera_is_told_with_those_that_are_there() -> None:
    with pytest.raises(SceneError, match=r"^the scene is of 'camera-1', which is not there; cameras there are left$"):
        FINDER.find(View(0.0, {"left": picture(1)}))
    with pytest.raises(SceneError, match=r"^the scene is of pictures of 640 × 480 pixels; those of"):
        FINDER.find(view(picture(1, 320, 240)))


@pytest.mark.parametrize("box", [Box(-1, 0, 9, 9), Box(0, 0, 0, 9), Box(600, 0, 41, 9), Box(0, 479, 9, 2)])
def test_a_box_that_is_not_in_the_picture_is_refused(box: Box) -> None:
    with pytest.raises(SceneError, match=r"is not in the picture; valid is x,y,width,height within 640 × 480 pixels$"):
        cut_scene(view(picture(1)), CAMERA, box)
