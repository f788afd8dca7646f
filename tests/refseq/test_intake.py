"""Views of strangers: made sense of, or refused in one line that names the view, the sensor and what is valid."""

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from refseq import Localiser, Scan, View, ViewError, learn
from refseq.intake import usable

GREY = np.random.default_rng(7).integers(0, 256, (48, 64), np.uint8)


def seen(image: Any = GREY, ranges: Any = (1.0, 2.0, 3.0)) -> View:
    return View(1.5, {"front": image}, Scan(ranges), distance=0.5)


@pytest.mark.parametrize(
    ("colour", "order"),
    [
        (np.dstack([GREY, np.roll(GREY, 9), GREY[::-1]]), cv2.COLOR_RGB2GRAY),
        (np.dstack([GREY, np.roll(GREY, 9), GREY[::-1], GREY]), cv2.COLOR_RGBA2GRAY),
    ],
)
def test_colour_becomes_grey_by_the_eye_s_weights(colour: np.ndarray[Any, Any], order: int) -> None:
    grey = usable(seen(colour)).images["front"]
    assert np.array_equal(grey, cv2.cvtColor(colour, order))
    assert abs(grey.astype(float) - colour[..., :3] @ [0.299, 0.587, 0.114]).max() <= 1


def test_grey_of_one_channel_is_the_picture_itself() -> None:
    assert np.array_equal(usable(seen(GREY[:, :, None])).images["front"], GREY)
    assert usable(seen()).images["front"] is GREY


@pytest.mark.parametrize(
    ("image", "told"),
    [
        (GREY / 255, r"\(48, 64\) float64"),
        (GREY > 100, r"\(48, 64\) bool"),
        (GREY.astype(np.uint16), r"\(48, 64\) uint16"),
        (GREY[:0], r"\(0, 64\) uint8"),
        (GREY[0], r"\(64,\) uint8"),
        (np.dstack([GREY, GREY]), r"\(48, 64, 2\) uint8"),
        ("front.png", r"\(\) <U9"),
    ],
)
def test_what_is_no_picture_is_refused(image: Any, told: str) -> None:
    with pytest.raises(ViewError, match=rf"^view at 1\.5 s: front: an image of {told}; valid is .*uint8.*$"):
        usable(seen(image))


def test_ranges_are_a_row_of_numbers_from_lists_too() -> None:
    scan = usable(seen(ranges=[1, 2, 3])).scan
    assert scan is not None
    assert (scan.ranges.dtype, scan.ranges.tolist()) == (np.float32, [1, 2, 3])
    with pytest.raises(ViewError, match=r"^view at 1\.5 s: laser: ranges of \(2, 2\) float64; valid is \(n,\)"):
        usable(seen(ranges=np.ones((2, 2))))


def test_only_pictures_of_the_sensors_asked_for_are_looked_at() -> None:
    both = replace(seen(), images={"front": GREY, "broken": GREY / 255})
    assert set(usable(both, {"front"}).images) == {"front"}


def test_a_time_that_is_no_number_is_refused() -> None:
    with pytest.raises(ViewError, match="time is nan s; valid is a finite number"):
        usable(replace(seen(), time=float("nan")))


def walk(**changed: Any) -> list[View]:
    """Six views of one long picture past which the camera moves, with ``changed`` in each."""
    wall = cv2.resize(np.random.default_rng(3).integers(0, 256, (24, 200), np.uint8), (1600, 192))
    ranges = np.linspace(1, 4, 361, dtype=np.float32)
    views = [
        View(float(i), {"front": wall[:, 200 * i : 200 * i + 256].copy()}, Scan(ranges + i / 10), distance=0.8)
        for i in range(6)
    ]
    return [replace(view, **changed) for view in views]


@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_a_map_is_learnt_from_a_generator_of_colour_views_as_from_a_list_of_grey_ones(profile: str) -> None:
    colour = (replace(view, images={"front": np.dstack([view.images["front"]] * 3)}) for view in walk())
    assert learn(colour, profile=profile).to_bytes() == learn(walk(), profile=profile).to_bytes()


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_map_needs_a_motion_that_is_a_number(value: float) -> None:
    views = walk()
    views[2] = replace(views[2], distance=value)
    with pytest.raises(ViewError, match=rf"^view 2 at 2 s: distance {value} m; valid is a finite number$"):
        learn(views)


@pytest.mark.parametrize("silent", [0.0, np.inf, np.nan, 90.0])
def test_a_laser_that_sees_nothing_is_not_learnt(silent: float) -> None:
    with pytest.raises(
        ViewError, match=r"^laser: no beam came back in any of 6 views; valid is to learn from the others$"
    ):
        learn(walk(scan=Scan(np.full(361, silent, np.float32))))


def test_a_camera_that_sees_nothing_is_silent_beside_another_one_and_no_map_by_itself() -> None:
    views = [replace(view, images={**view.images, "dark": np.zeros((192, 256), np.uint8)}) for view in walk()]
    assert learn(views).sensors == {"front", "dark", "laser"}
    with pytest.raises(ViewError, match=r"^dark: nothing is seen in any of 6 views$"):
        learn(views, sensors=["dark"])


def test_cameras_of_other_names_are_told_of_and_a_missing_one_is_no_error() -> None:
    localiser = Localiser(learn(walk()))
    first = walk()[0]
    with pytest.raises(ViewError, match=r"^view at 0 s: left, right: no camera of the map; valid are front$"):
        localiser.update(replace(first, images={"left": first.images["front"], "right": first.images["front"]}))
    localiser.update(first)
    localiser.update(replace(first, images={"left": first.images["front"]}, time=1.0))
    localiser.update(replace(first, images={}, time=2.0))


@pytest.mark.parametrize("shape", [(1, 1), (1, 640), (480, 1), (2, 70), (2_000_000, 1)])
@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_the_smallest_and_the_slenderest_pictures_say_nothing(shape: tuple[int, int], profile: str) -> None:
    localiser = Localiser(learn(walk(), profile=profile))
    belief = localiser.update(replace(walk()[0], images={"front": np.full(shape, 9, np.uint8)}))
    assert belief.places.sum() == pytest.approx(1.0)


def test_a_map_is_told_in_one_line() -> None:
    assert repr(learn(walk(), name="wall")) == "<Map of 6 places: wall 4.0 m; front, laser>"
