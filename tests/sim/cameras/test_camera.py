from dataclasses import replace

import numpy as np
import pytest

from refseq_bench.sim.cameras.camera import Camera, CameraModel
from refseq_bench.sim.cameras.exposure import ExposureControl
from refseq_bench.sim.cameras.lens import Lens
from refseq_bench.sim.cameras.sensor import WHITE, Sensor
from refseq_bench.sim.errors import SimError

SMALL = Sensor(size=(64, 48))
LONG = Lens(focal=0.02, blur=0.0)
"""So narrow a field that its corners are as bright as its centre."""
MODEL = CameraModel(lens=LONG, sensor=SMALL)
QUIET = CameraModel(lens=LONG, sensor=Sensor(size=(64, 48), read_noise=0.0))


def flat(luminance: float, shape: tuple[int, int] = (48, 64)) -> np.ndarray:
    return np.full(shape, luminance, np.float32)


def camera(seed: int = 0, model: CameraModel = MODEL) -> Camera:
    return Camera(model, np.random.default_rng(seed))


def test_electrons_follow_the_camera_equation() -> None:
    # E = pi T L / (4 N^2) lx on 5.6 um pixels; 1 lx of 555 nm is 1 W / 683 m^2, a photon has h c / lambda.
    photon = 6.626e-34 * 2.998e8 / 555e-9
    expected = np.pi * 0.9 / (4 * 2.0**2) * 5.6e-6**2 / 683 / photon * 0.4
    assert CameraModel().sensitivity == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("luminance", [1.2, 150.0])
def test_photon_transfer_curve_of_the_numbers_is_a_line_of_the_gain_and_the_read_noise(luminance: float) -> None:
    eye = camera(2, CameraModel(lens=replace(LONG, focal=0.1)))
    eye.adapt(flat(luminance, (480, 640)), 0.0)
    levels = luminance * np.array([0.3, 0.5, 1.0, 1.5, 2.0, 3.0])
    frames = [eye.digital(flat(level, (480, 640))).astype(float) for level in levels]
    slope, intercept = np.polyfit([f.mean() for f in frames], [f.var() for f in frames], 1)
    conversion = eye.exposure.gain * WHITE / 16_000  # DN per electron
    assert slope == pytest.approx(conversion, rel=0.02)
    noise = np.sqrt(intercept - 1 / 12) / conversion  # rounding adds 1 / 12
    assert noise == pytest.approx(20.0, rel=0.1)


def test_the_two_exposures_of_the_photon_transfer_curve_are_with_and_without_gain() -> None:
    gains = []
    for luminance in (1.2, 150.0):
        eye = camera()
        eye.adapt(flat(luminance), 0.0)
        gains.append(eye.exposure.gain)
    assert gains[0] > 3.0
    assert gains[1] == 1.0


def test_numbers_rise_with_light_and_time_as_a_line() -> None:
    eye = camera(model=QUIET)
    eye.adapt(flat(100.0), 0.0)
    per_candela = QUIET.sensitivity * eye.exposure.shutter * WHITE / 16_000
    for level in (20.0, 100.0, 300.0):
        assert eye.digital(flat(level)).mean() == pytest.approx(level * per_candela, rel=0.01)


def test_bytes_are_the_numbers_through_the_gamma_curve() -> None:
    view = np.geomspace(1, 3000, 48 * 64, dtype=np.float32).reshape(48, 64)
    one, other = camera(5), camera(5)
    share = one.digital(view) / WHITE
    assert np.array_equal(other.expose(view), np.round(255 * share ** (1 / 2.2)))


def test_noise_stands_out_in_the_dark() -> None:
    def spread(luminance: float) -> float:
        return float(camera().expose(flat(luminance)).std())

    assert spread(0.1) > 3 * spread(30.0)


@pytest.mark.parametrize("luminance", [0.7, 7.0, 70.0, 700.0])
def test_exposure_brings_three_decades_of_light_to_the_same_grey(luminance: float) -> None:
    image = camera().expose(flat(luminance))
    assert image.mean() == pytest.approx(255 * 0.18 ** (1 / 2.2), abs=1.5)


@pytest.mark.parametrize(("luminance", "shutter", "gain"), [(1e-4, 1 / 15, 16.0), (1e7, 1e-4, 1.0)])
def test_at_its_limits_the_picture_gets_dark_or_burns_out(luminance: float, shutter: float, gain: float) -> None:
    eye = camera()
    image = eye.expose(flat(luminance))
    assert eye.exposure.shutter == pytest.approx(shutter)
    assert eye.exposure.gain == pytest.approx(gain)
    assert image.mean() > 254 if luminance > 1 else image.mean() < 60


def test_the_loop_nears_its_goal_by_63_percent_in_one_lag_however_it_is_cut() -> None:
    def after(steps: int) -> float:
        eye = camera()
        eye.adapt(flat(10.0), 0.0)
        for _ in range(steps):
            eye.adapt(flat(200.0), MODEL.exposure.lag / steps)
        return eye.exposure.product

    def goal(luminance: float) -> float:
        eye = camera()
        eye.adapt(flat(luminance), 0.0)
        return eye.exposure.product

    travelled = np.log(after(1) / goal(10.0)) / np.log(goal(200.0) / goal(10.0))
    assert travelled == pytest.approx(1 - np.exp(-1), rel=1e-6)
    assert after(7) == pytest.approx(after(1), rel=1e-6)


def test_going_from_lamp_light_into_the_sun_dazzles_and_settles_without_overshoot() -> None:
    eye = camera()
    eye.adapt(flat(5.0), 0.0)
    means = []
    for _ in range(12):
        means.append(eye.expose(flat(2000.0)).mean())
        eye.adapt(flat(2000.0), 0.2)
    assert means[0] > 250
    assert (np.diff(means) < 0.5).all()
    assert means[-1] == pytest.approx(255 * 0.18 ** (1 / 2.2), abs=2)


def test_a_sun_patch_does_not_black_out_the_hallway() -> None:
    view = flat(20.0)
    view[40:, 20:30] = 20_000.0
    image = camera().expose(view)
    assert np.median(image) > 90


def test_the_meter_sees_the_dark_corners_of_its_lens() -> None:
    wide = CameraModel(lens=Lens(focal=1e-4, blur=0.0), sensor=SMALL)  # 49 degrees to each side
    eyes = [camera(model=model) for model in (MODEL, wide)]
    for eye in eyes:
        eye.adapt(flat(100.0), 0.0)
    assert eyes[1].exposure.product > 1.2 * eyes[0].exposure.product
    middle = [eye.digital(flat(100.0))[20:28, 28:36].mean() for eye in eyes]
    corner = [eye.digital(flat(100.0))[:2, :2].mean() for eye in eyes]
    assert corner[0] == pytest.approx(middle[0], rel=0.05)
    cosine = 1 / np.sqrt(1 + (23.0**2 + 31.0**2) * (5.6e-6 / 1e-4) ** 2)
    assert corner[1] == pytest.approx(middle[1] * cosine**4, rel=0.15)


def test_brighter_scenes_give_brighter_bytes_at_a_held_exposure() -> None:
    eye = camera(model=QUIET)
    eye.adapt(flat(50.0), 0.0)
    means = [eye.expose(flat(level)).mean() for level in (0.0, 5.0, 20.0, 50.0, 100.0, 500.0)]
    assert (np.diff(means) > 1.0).all()
    assert means[0] == 0
    assert means[-1] == 255


def test_the_same_seed_gives_the_same_images_and_another_seed_others() -> None:
    view = np.random.default_rng(9).uniform(1, 100, (480, 640)).astype(np.float32)
    first, again, other = (camera(seed, CameraModel()).expose(view) for seed in (4, 4, 5))
    assert first.shape == (480, 640)
    assert first.dtype == np.uint8
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_taking_an_image_leaves_what_was_seen_as_it_was() -> None:
    view = flat(30.0)
    camera().expose(view)
    assert (view == 30.0).all()


def test_impossible_figures_and_pictures_are_named() -> None:
    with pytest.raises(SimError, match=r"^gamma = 0\.0 is not > 0 and finite$"):
        CameraModel(gamma=0.0)
    with pytest.raises(SimError, match=r"^camera: dt = -1\.0 is not >= 0 s$"):
        camera().adapt(flat(1.0), -1.0)
    with pytest.raises(SimError, match=r"^camera: no exposure before the first adapt\(\) or expose\(\)$"):
        _ = camera().exposure
    with pytest.raises(SimError, match=r"^camera: picture = 80 × 60 is not 64 × 48$"):
        camera().expose(flat(1.0, (60, 80)))


def test_a_model_says_at_once_that_its_lens_cannot_fill_its_sensor() -> None:
    with pytest.raises(SimError, match="the corner of 640 × 480 is at 400"):
        CameraModel(lens=Lens(k1=-0.9), exposure=ExposureControl())
