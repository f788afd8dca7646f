import numpy as np
import pytest
from scipy.stats import kstest, kurtosis

from refseq_bench.sim.cameras.sensor import WHITE, Sensor
from refseq_bench.sim.errors import SimError

SENSOR = Sensor()
LEVELS = (0.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0)


def even(electrons: float, shape: tuple[int, int] = (480, 640)) -> np.ndarray:
    return np.full(shape, electrons, np.float32)


def test_photon_transfer_of_electrons_has_slope_one_and_the_read_noise_as_intercept() -> None:
    rng = np.random.default_rng(2)
    frames = [SENSOR.read(even(level), rng) for level in LEVELS]
    slope, intercept = np.polyfit([f.mean() for f in frames], [f.var() for f in frames], 1)
    assert slope == pytest.approx(1.0, abs=0.01)
    assert np.sqrt(intercept) == pytest.approx(SENSOR.read_noise, rel=0.05)


def test_noise_is_normal() -> None:
    noise = (SENSOR.read(even(2000.0), np.random.default_rng(2)) - 2000.0) / np.sqrt(2400.0)
    assert kstest(noise.ravel(), "norm").pvalue > 0.05
    assert kurtosis(noise.ravel()) == pytest.approx(0.0, abs=0.03)


def test_a_full_well_holds_no_more() -> None:
    electrons = SENSOR.read(even(1e6), np.random.default_rng(3))
    assert (electrons == SENSOR.full_well).all()


def test_there_is_no_light_below_none() -> None:
    dark = Sensor(read_noise=0.0).read(even(-100.0), np.random.default_rng(3))
    assert (dark == 0.0).all()


@pytest.mark.parametrize("gain", [1.0, 4.0])
def test_a_full_well_is_white_at_gain_one_and_numbers_are_rounded(gain: float) -> None:
    electrons = np.array([-50.0, 0.0, 0.1, 0.49, 0.51, 100.0, 1e9], np.float32) * np.float32(16_000 / WHITE)
    numbers = SENSOR.converted(electrons, gain)
    expected = np.clip(np.round(electrons.astype(float) * WHITE / 16_000 * gain), 0, WHITE)
    assert numbers.tolist() == expected.tolist()


def test_impossible_figures_are_named() -> None:
    with pytest.raises(SimError, match=r"^sensor\.full_well = -1\.0 is not > 0 and finite$"):
        Sensor(full_well=-1.0)
    with pytest.raises(SimError, match=r"^sensor\.quantum_efficiency = 1\.5 is not > 0 and <= 1$"):
        Sensor(quantum_efficiency=1.5)
    with pytest.raises(SimError, match=r"^sensor\.read_noise = nan is not >= 0 and finite$"):
        Sensor(read_noise=float("nan"))
    with pytest.raises(SimError, match=r"^sensor\.size = \(0, 480\) is not two of 16 to 8192 pixels$"):
        Sensor(size=(0, 480))
