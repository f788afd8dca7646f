import numpy as np
import pytest

from sim.camera import Camera, CameraModel, centre_weights, gather, wanted_exposure
from sim.errors import SimError

MODEL = CameraModel()


def flat(luminance: float, shape: tuple[int, int] = (48, 64)) -> np.ndarray:
    return np.full(shape, luminance, np.float32)


def camera(seed: int = 0, **figures: float) -> Camera:
    return Camera(CameraModel(**figures), np.random.default_rng(seed))


def test_electrons_follow_the_camera_equation() -> None:
    # E = pi T L / (4 N^2) lx on 5.6 um pixels; 1 lx of 555 nm is 1 W / 683 m^2, a photon has h c / lambda.
    photon = 6.626e-34 * 2.998e8 / 555e-9
    expected = np.pi * 0.9 * 50.0 / (4 * 2.0**2) * 5.6e-6**2 / 683 / photon * 0.4 * 0.01
    electrons = gather(MODEL, flat(50.0, (480, 640)), 0.01, np.random.default_rng(1))
    assert electrons.mean() == pytest.approx(expected, rel=2e-3)


def test_photon_transfer_curve_has_slope_one_and_the_read_noise_as_intercept() -> None:
    rng = np.random.default_rng(2)
    frames = [gather(MODEL, flat(level, (480, 640)), 0.01, rng) for level in (0.0, 5.0, 10.0, 20.0, 50.0, 100.0)]
    slope, intercept = np.polyfit([f.mean() for f in frames], [f.var() for f in frames], 1)
    assert slope == pytest.approx(1.0, abs=0.02)
    assert np.sqrt(intercept) == pytest.approx(MODEL.read_noise, rel=0.1)


def test_a_full_well_holds_no_more() -> None:
    electrons = gather(MODEL, flat(1e6), 0.01, np.random.default_rng(3))
    assert (electrons == MODEL.full_well).all()


def test_noise_stands_out_in_the_dark() -> None:
    def spread(luminance: float) -> float:
        return float(camera().expose(flat(luminance)).std())

    assert spread(0.1) > 3 * spread(30.0)


@pytest.mark.parametrize("luminance", [0.7, 7.0, 70.0, 700.0])
def test_exposure_brings_three_decades_of_light_to_the_same_grey(luminance: float) -> None:
    image = camera().expose(flat(luminance))
    assert image.mean() == pytest.approx(255 * MODEL.target ** (1 / MODEL.gamma), abs=1.5)


def test_exposure_falls_with_light_within_its_limits() -> None:
    product, shutters, gains = [], [], []
    for luminance in np.logspace(-4, 7, 45):
        eye = camera()
        eye.adapt(flat(luminance), 0.0)
        shutters.append(eye.exposure.shutter)
        gains.append(eye.exposure.gain)
        product.append(shutters[-1] * gains[-1])
    assert (np.diff(product) <= 1e-9).all()
    assert (min(shutters), max(shutters)) == pytest.approx(MODEL.shutter)
    assert (min(gains), max(gains)) == pytest.approx(MODEL.gain)
    assert all(gain == pytest.approx(1.0) for s, gain in zip(shutters, gains, strict=True) if s < 0.999 / 15)


def test_the_loop_nears_its_goal_by_63_percent_in_one_lag_however_it_is_cut() -> None:
    def after(steps: int) -> float:
        eye = camera()
        eye.adapt(flat(10.0), 0.0)
        for _ in range(steps):
            eye.adapt(flat(200.0), MODEL.lag / steps)
        return eye.exposure.shutter * eye.exposure.gain

    start, goal = (wanted_exposure(MODEL, flat(luminance)) for luminance in (10.0, 200.0))
    travelled = np.log(after(1) / start) / np.log(goal / start)
    assert travelled == pytest.approx(1 - np.exp(-1), rel=1e-6)
    assert after(7) == pytest.approx(after(1), rel=1e-6)


def test_going_from_lamp_light_into_the_sun_dazzles_and_passes_without_overshoot() -> None:
    eye = camera()
    eye.adapt(flat(5.0), 0.0)
    means = []
    for _ in range(12):
        means.append(eye.expose(flat(2000.0)).mean())
        eye.adapt(flat(2000.0), 0.2)
    assert means[0] > 250
    assert (np.diff(means) < 0.5).all()
    assert means[-1] == pytest.approx(255 * MODEL.target ** (1 / MODEL.gamma), abs=2)


def test_a_sun_patch_does_not_black_out_the_hallway() -> None:
    view = flat(20.0)
    view[40:, 20:30] = 20_000.0
    image = camera().expose(view)
    assert np.median(image) > 90


def test_metering_a_small_picture_is_as_good_as_a_large_one() -> None:
    ramp = np.linspace(1.0, 400.0, 640, dtype=np.float32) * np.ones((480, 1), np.float32)
    small = ramp.reshape(48, 10, 64, 10).mean(axis=(1, 3))
    assert wanted_exposure(MODEL, small) == pytest.approx(wanted_exposure(MODEL, ramp), rel=1e-5)


def test_the_centre_of_the_picture_counts_most() -> None:
    weights = centre_weights(48, 64)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[24, 32] > 2.5 * weights[24, 0]


def test_brighter_scenes_give_brighter_bytes_at_a_held_exposure() -> None:
    eye = camera(read_noise=0.0, blur=0.0)
    eye.adapt(flat(50.0), 0.0)
    means = [eye.expose(flat(level)).mean() for level in (0.0, 5.0, 20.0, 50.0, 100.0, 500.0)]
    assert (np.diff(means) > 1.0).all()
    assert means[0] == 0
    assert means[-1] == 255


def test_the_lens_spreads_a_point_and_loses_no_light() -> None:
    point = flat(0.0)
    point[24, 32] = 1000.0
    electrons = gather(CameraModel(read_noise=0.0), point, 1e-3, np.random.default_rng(0)).sum()
    eye = camera(read_noise=0.0, blur=1.0, gamma=1.0)
    eye.adapt(flat(250.0), 0.0)
    image = eye.expose(point)
    assert (image > 0).sum() > 9
    signal = image.sum() / 255 * MODEL.full_well / (MODEL.sensitivity * eye.exposure.shutter * eye.exposure.gain)
    assert signal == pytest.approx(1000.0, rel=0.1)
    assert electrons > 0


def test_the_same_seed_gives_the_same_images_and_another_seed_others() -> None:
    view = np.random.default_rng(9).uniform(1, 100, (480, 640)).astype(np.float32)
    first, again, other = (camera(seed).expose(view) for seed in (4, 4, 5))
    assert first.shape == (480, 640)
    assert first.dtype == np.uint8
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_taking_an_image_leaves_what_was_seen_as_it_was() -> None:
    view = flat(30.0)
    camera().expose(view)
    assert (view == 30.0).all()


def test_impossible_figures_are_named() -> None:
    with pytest.raises(SimError, match=r"^camera: full_well = -1\.0 is not > 0$"):
        CameraModel(full_well=-1.0)
    with pytest.raises(SimError, match=r"^camera: gain = \(4\.0, 2\.0\) is not 0 < least <= most$"):
        CameraModel(gain=(4.0, 2.0))
    with pytest.raises(SimError, match=r"^camera: dt = -1\.0 s is not >= 0$"):
        camera().adapt(flat(1.0), -1.0)
    with pytest.raises(SimError, match="no exposure before the first"):
        _ = camera().exposure
