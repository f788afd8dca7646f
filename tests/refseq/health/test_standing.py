"""Tests for a robot that stood: by the odometer, by pictures, by scans, and by what is left of them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from refseq.health.monitor import HealthMonitor
from refseq.health.standing import CLEAR, Motion, Sight, StandWatch, Step
from refseq.planar import Pose
from refseq.view import View
from tests.refseq.health.drives import STEP, WALLS, drive, picture
from tests.refseq.rooms import cast

VIEWS = drive()


def steps(views: list[View]) -> list[Step]:
    monitor = HealthMonitor()
    return [monitor.update(view).step for view in views]


def motions(views: list[View]) -> list[Motion]:
    return [step.motion for step in steps(views)]


def stand(at: int, count: int, seed: int = 5) -> list[View]:
    """Views of a robot that stands where a view was taken: the same but for noise."""
    rng, view = np.random.default_rng(seed), VIEWS[at]
    assert view.truth is not None
    return [
        replace(
            view,
            time=view.time + 0.1 * (k + 1),
            images={f"camera-{c}": picture(view.truth.x, c, rng) for c in (1, 2)},
            scan=cast(WALLS, view.truth, rng=rng),
            distance=0.0,
            turn=0.0,
        )
        for k in range(count)
    ]


def only(view: View, *sensors: str) -> View:
    images = {name: image for name, image in view.images.items() if name in sensors}
    return replace(view, images=images, scan=view.scan if "laser" in sensors else None)


def calm(view: View) -> View:
    """The view with less noise, as large pictures have it when they are reduced."""
    return replace(view, images={name: cv2.GaussianBlur(image, (7, 7), 0) for name, image in view.images.items()})


def test_a_drive_with_a_good_odometer_is_taken_by_it_to_the_last_bit() -> None:
    for view, step in zip(VIEWS, steps(VIEWS), strict=True):
        assert step == Step(Motion.MEASURED, view.distance, view.turn)


@pytest.mark.parametrize("sensors", [("camera-1",), ("laser",), ("camera-1", "camera-2", "laser")])
def test_a_robot_that_stands_is_told_by_any_sensor(sensors: tuple[str, ...]) -> None:
    views = [only(view, *sensors) for view in [*VIEWS[:8], *stand(7, 5), *VIEWS[8:12]]]
    assert motions(views) == [Motion.MEASURED] * 8 + [Motion.STOOD] * 5 + [Motion.MEASURED] * 4


@pytest.mark.parametrize("sensors", [("camera-1",), ("laser",), ("camera-1", "laser")])
@pytest.mark.parametrize("change", [{"distance": 0.0, "turn": 0.0}, {"has_odometry": False}])
def test_without_an_odometer_the_pictures_tell_a_robot_that_moves_from_one_that_stands(
    sensors: tuple[str, ...], change: dict[str, object]
) -> None:
    views = [replace(calm(only(view, *sensors)), **change) for view in [*VIEWS[:6], *stand(5, 4), *VIEWS[6:12]]]
    found = motions(views)
    assert found[1:] == [Motion.UNKNOWN] * 5 + [Motion.STOOD] * 4 + [Motion.UNKNOWN] * 6


def test_a_robot_that_is_carried_off_while_it_stands_has_moved() -> None:
    elsewhere = [replace(view, distance=0.0, turn=0.0) for view in VIEWS[20:21]]
    for sensors in (("camera-1",), ("laser",)):
        views = [only(view, *sensors) for view in [*VIEWS[:6], *stand(5, 2), *elsewhere]]
        assert motions(views)[-3:] == [Motion.STOOD, Motion.STOOD, Motion.UNKNOWN]


def test_a_robot_that_creeps_has_moved_at_length_by_the_whole_way() -> None:
    rng, at = np.random.default_rng(3), VIEWS[0].truth
    assert at is not None
    views = [
        View(0.1 * k, scan=cast(WALLS, Pose(at.x + 0.008 * k, at.y, 0.0), rng=rng), distance=0.008 if k else 0.0)
        for k in range(13)
    ]
    found = steps(views)
    counted = [step for step in found if step.motion is not Motion.STOOD]
    assert sum(step.distance for step in counted) == pytest.approx(0.008 * (len(found) - 1), abs=0.02)
    assert 1 < len(counted) < len(found)
    assert all(step.motion is Motion.MEASURED for step in counted)


def test_an_odometer_that_has_told_of_motion_is_believed_where_no_sensor_can_tell() -> None:
    bare = [(-50.0, -1.2, 90.0, -1.2), (-50.0, 1.2, 90.0, 1.2)]
    rng = np.random.default_rng(6)
    views = [View(float(k), scan=cast(bare, Pose(0.0, 0.0, 0.0), rng=rng)) for k in range(4)]
    assert motions(views)[1:] == [Motion.MEASURED] * 3  # it may be one that is missing
    assert motions([*VIEWS[:3], replace(views[0], distance=0.5), *views[1:]])[-3:] == [Motion.STOOD] * 3


@pytest.mark.parametrize("grey", [0, 120])
def test_pictures_of_nothing_tell_neither(grey: int) -> None:
    rng = np.random.default_rng(8)
    bare = [np.clip(rng.normal(grey, 2, (120, 160)), 0, 255).astype(np.uint8) for _ in range(2)]
    assert Sight({"camera": bare[0]}).moved_since(Sight({"camera": bare[1]})) is None
    watch = StandWatch()
    for k, one in enumerate(bare):
        step = watch.update(View(float(k), has_odometry=False), Sight({"camera": one}), trusted=True)
        assert step.motion is Motion.UNKNOWN


def test_small_pictures_tell_neither() -> None:
    small = VIEWS[0].images["camera-1"][:59, :79]
    assert Sight({"camera": small}).moved_since(Sight({"camera": small})) is None


def test_a_lamp_that_is_switched_on_is_no_motion() -> None:
    rng = np.random.default_rng(3)
    dark, lit = (
        Sight({"camera": np.clip(picture(10.0, 1, rng) * gain, 0, 255).astype(np.uint8)}) for gain in (0.4, 1.0)
    )
    found = lit.moved_since(dark)
    assert found is not None
    assert abs(found) < CLEAR
    moved = Sight({"camera": picture(10.0 + STEP, 1, rng)}).moved_since(lit)
    assert moved is not None
    assert moved > CLEAR
