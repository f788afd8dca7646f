import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from refseq_bench.robots import Inertial, Twist
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.inertial import InertialModel, InertialSensors, tilt
from tests.robots.driving import PREFIX, Driven, ramped

EXACT = InertialModel(0.0, 0.0, 0.0, 0.0)
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
STILL = np.zeros(3)

headings = st.floats(-math.pi, math.pi)
slants = st.floats(-math.radians(89), math.radians(89))


def turned(heading: float, pitch: float, roll: float) -> np.ndarray:
    """Quaternion of a body that was rolled first, then pitched, then headed."""
    return np.asarray(Rotation.from_euler("ZYX", (heading, pitch, roll)).as_quat(scalar_first=True))


@given(headings, slants, slants)
def test_tilt_is_that_of_the_rotation_whatever_the_heading(heading: float, pitch: float, roll: float) -> None:
    assert tilt(turned(heading, pitch, roll)) == pytest.approx((pitch, roll), abs=1e-6)


@given(headings, st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_tilt_tells_the_heights_of_nose_left_side_and_top_at_every_attitude(
    heading: float, first: float, second: float
) -> None:
    rotation = turned(heading, first, second)
    nose, left, top = Rotation.from_quat(rotation, scalar_first=True).as_matrix()[2]
    pitch, roll = tilt(rotation)
    assert math.sin(pitch) == pytest.approx(-nose, abs=1e-9)
    assert math.sin(roll) * math.hypot(left, top) == pytest.approx(left, abs=1e-9)
    assert (abs(pitch) > math.pi / 2) == (top < 0) or abs(top) < 1e-9
    assert abs(roll) <= math.pi / 2 + 1e-9


def test_the_signs_are_nose_down_and_left_side_up() -> None:
    nose_down, left_up = Rotation.from_euler("y", 0.2), Rotation.from_euler("x", 0.3)
    assert nose_down.apply((1, 0, 0))[2] < 0
    assert left_up.apply((0, 1, 0))[2] > 0
    assert tilt(nose_down.as_quat(scalar_first=True)) == pytest.approx((0.2, 0.0))
    assert tilt(left_up.as_quat(scalar_first=True)) == pytest.approx((0.0, 0.3))


def test_a_quaternion_and_its_negative_are_one_attitude() -> None:
    rotation = turned(0.4, 0.5, -0.6)
    assert tilt(rotation) == pytest.approx(tilt(-rotation))


def test_without_errors_it_reads_the_truth() -> None:
    read = InertialSensors(EXACT, np.random.default_rng(0)).read(turned(1.0, 0.1, 0.2), np.array((9.0, 0.3, -0.4)))
    assert read == pytest.approx(Inertial(0.1, 0.2, 0.3, -0.4))


def readings(seed: int, count: int, model: InertialModel | None = None) -> np.ndarray:
    sensors = InertialSensors(model or InertialModel(), np.random.default_rng(seed))
    return np.array([sensors.read(LEVEL, STILL) for _ in range(count)])


def test_noise_is_drawn_at_every_reading() -> None:
    model = InertialModel()
    expected = [model.angle_noise, model.angle_noise, model.rate_noise, model.rate_noise]
    np.testing.assert_allclose(readings(0, 4000).std(axis=0), expected, rtol=0.05)


def test_bias_is_drawn_once_for_a_drive() -> None:
    model = InertialModel(angle_noise=0.0, rate_noise=0.0)
    assert np.ptp(readings(0, 20, model), axis=0) == pytest.approx(np.zeros(4), abs=1e-15)
    biases = np.array([readings(seed, 1, model)[0] for seed in range(3000)])
    expected = [model.angle_bias, model.angle_bias, model.rate_bias, model.rate_bias]
    np.testing.assert_allclose(biases.std(axis=0), expected, rtol=0.05)
    np.testing.assert_allclose(np.corrcoef(biases.T), np.eye(4), atol=0.08)


def test_readings_repeat_by_seed() -> None:
    np.testing.assert_array_equal(readings(1, 5), readings(1, 5))
    assert (readings(1, 5) != readings(2, 5)).all()


def test_the_yaw_rate_of_a_driven_robot_adds_up_to_its_turn() -> None:
    driven, sensors = Driven(), InertialSensors(EXACT, np.random.default_rng(0))
    base, rates = driven.data.joint(PREFIX + driven.robot.base), []

    def look() -> None:
        rates.append(sensors.read(base.qpos[3:], base.qvel[3:]).yaw_rate)

    driven.drive(12.0, ramped(Twist(0.2, 0.5), 11.0), look)
    assert driven.turned == pytest.approx(5.0, rel=0.05)
    assert 0.02 * sum(rates) == pytest.approx(driven.turned, abs=0.01)


def test_a_biased_gyroscope_drifts_by_its_bias() -> None:
    """Standing for 100 s: what adds up is the bias times the time, give or take √n of the noise."""
    model, count = InertialModel(), 5000
    sensors = InertialSensors(model, np.random.default_rng(5))
    quiet = InertialSensors(InertialModel(angle_noise=0.0, rate_noise=0.0), np.random.default_rng(5))
    bias = quiet.read(LEVEL, STILL).yaw_rate
    drift = 0.02 * sum(sensors.read(LEVEL, STILL).yaw_rate for _ in range(count))
    assert abs(drift - 100 * bias) < 4 * 0.02 * math.sqrt(count) * model.rate_noise
    assert abs(100 * bias) > 4 * 0.02 * math.sqrt(count) * model.rate_noise, "a bias that shows"


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
def test_a_body_that_is_nowhere_is_read_without_an_error(bad: float) -> None:
    sensors = InertialSensors(InertialModel(), np.random.default_rng(0))
    with np.errstate(all="ignore"):
        read = sensors.read(np.full(4, bad), np.full(3, bad))
    assert not read.finite or bad == 1e300


@pytest.mark.parametrize("key", ["angle_bias", "angle_noise", "rate_bias", "rate_noise"])
@pytest.mark.parametrize("value", [-0.01, 0.2, math.nan])
def test_impossible_figures_are_refused(key: str, value: float) -> None:
    with pytest.raises(SimError) as error:
        InertialModel(**{key: value})
    assert str(error.value) == f"inertial sensors: {key} = {value} must be in [0, 0.2)"
