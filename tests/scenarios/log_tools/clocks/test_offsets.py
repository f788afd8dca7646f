import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from refseq.planar import Pose
from refseq.view import Scan
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset, clock_offset
from refseq_bench.scenarios.log_tools.clocks.shifts import picture_turns, scan_turns
from tests.refseq.rooms import cast, rectangle

ROOM = [*rectangle(-6, -4, 7, 5), *rectangle(1, 2, 3, 3), (-4, -4, -2, -1)]
TIMES = np.arange(0.0, 20.0, 0.05)
HEADINGS = 1.2 * np.sin(0.9 * TIMES) + 0.4 * np.sin(2.3 * TIMES)
STAMPS = np.arange(2.0, 18.0, 0.1)


def scans(late: float, sign: int = 1) -> list[Scan]:
    """Scans of a laser whose stamps are ``late`` [s]; upside down with ``sign`` −1."""
    seen = np.interp(STAMPS - late, TIMES, HEADINGS)
    found = [cast(ROOM, Pose(0.0, 0.0, heading), beams=181) for heading in seen]
    return [Scan(scan.ranges[::sign], scan.start, scan.step) for scan in found]


@pytest.mark.parametrize("late", [-0.3, 0.0, 0.12])
def test_a_laser_s_offset_is_found_from_turns_alone(late):
    found = clock_offset(STAMPS, scan_turns(scans(late)), TIMES, HEADINGS)
    assert found.lag == pytest.approx(late, abs=0.015)
    assert found.correlation > 0.95
    assert found.gain == pytest.approx(1.0, abs=0.1)


def test_a_laser_that_is_upside_down_sees_the_turns_the_other_way():
    found = clock_offset(STAMPS, scan_turns(scans(0.0, sign=-1)), TIMES, HEADINGS)
    assert found.correlation < -0.95


def test_a_camera_s_offset_is_found_from_its_rows():
    scene = np.convolve(np.random.default_rng(0).random(4000), np.ones(9) / 9, mode="same")
    columns = 2000 - 150 * np.interp(STAMPS - 0.08, TIMES, HEADINGS)  # a camera that turns left looks at what is left
    rows = [np.interp(column + np.arange(160), np.arange(4000), scene) for column in columns]
    found = clock_offset(STAMPS, picture_turns(rows), TIMES, HEADINGS)
    assert found.lag == pytest.approx(0.08, abs=0.015)
    assert found.correlation > 0.95


def test_without_turns_there_is_nothing_to_tell():
    assert clock_offset(STAMPS, np.zeros(len(STAMPS) - 1), TIMES, np.zeros(len(TIMES))) is None


def test_sensors_that_see_other_turns_are_not_compared():
    turns = np.random.default_rng(1).normal(0, 0.1, len(STAMPS) - 1)
    assert clock_offset(STAMPS, turns, TIMES, HEADINGS) is None


def noisy(lag: float, noise: float, seed: int, period: float = 0.2) -> ClockOffset | None:
    """A minute of a robot that wanders, with ``noise`` [rad] in its heading, and a laser ``lag`` [s] late."""
    rng = np.random.default_rng(seed)
    fine = np.arange(-2.0, 62.0, 0.02)
    rate = np.convolve(rng.normal(size=len(fine)), np.exp(-0.5 * (np.arange(-150, 151) / 30) ** 2), "same")
    heading = np.cumsum(0.02 * 0.25 * rate / rate.std())
    odometer = np.arange(0.0, 60.0, 0.05)
    told = np.interp(odometer, fine, heading) + noise * rng.normal(size=len(odometer))
    stamps = np.arange(0.03, 59.0, period)
    seen = np.diff(np.interp(stamps - lag, fine, heading)) + 0.005 * rng.normal(size=len(stamps) - 1)
    return clock_offset(stamps, seen, stamps, np.interp(stamps, odometer, told))


@pytest.mark.parametrize("noise", [0.01, 0.03, 0.05])
def test_of_a_noisy_heading_no_offset_is_invented(noise: float) -> None:
    """Interpolated noise is weakest half a period beside the stamps; that was taken for an offset nine times in ten."""
    found = [noisy(0.0, noise, seed) for seed in range(25)]
    assert sum(one is not None and one.differs() for one in found) <= 1
    assert sum(one is None for one in found) <= 1


@pytest.mark.parametrize("lag", [0.1, 0.2, 0.3, -0.4])
def test_a_real_offset_is_found_in_noise_and_its_error_is_true(lag: float) -> None:
    found = [noisy(lag, 0.02, seed) for seed in range(15)]
    told = [one for one in found if one is not None and one.differs()]
    assert len(told) >= 14
    assert all(one.lag == pytest.approx(lag, abs=0.05) for one in told)
    off = np.sqrt(np.mean([(one.lag - lag) ** 2 for one in told]))
    assert 0.4 < np.median([one.error for one in told]) / off < 2.5


def test_an_offset_within_what_chance_gives_is_none() -> None:
    assert ClockOffset(0.2, 0.9, error=0.02).differs()
    assert not ClockOffset(0.2, 0.9, error=0.06).differs()
    assert not ClockOffset(0.04, 0.9, error=0.001).differs()
    assert not ClockOffset(3.71, 0.9, error=0.01).differs(3.7)


def test_turns_have_their_sign_and_size():
    left = [cast(ROOM, Pose(0.0, 0.0, math.radians(angle)), beams=181) for angle in (0, 3)]
    assert scan_turns(left) == pytest.approx([math.radians(3)], abs=math.radians(0.5))


def test_one_turn_whose_shape_is_seen_otherwise_tells_no_offset() -> None:
    """As a camera in a corridor sees a corner; all pieces of it are wrong alike, and four of these were told late."""
    heading = np.pi / 2 * ((TIMES_OF_A_TURN - 30.0) / 4.0 + 0.5).clip(0.0, 1.0)
    stamps = np.arange(2.0, 58.0, 0.2)
    turned = np.diff(np.interp(stamps, TIMES_OF_A_TURN, heading))
    for seed in range(40):
        other = gaussian_filter1d(np.random.default_rng(seed).standard_normal(len(turned)), 6)
        seen = turned + other * (1.1 * turned.std() / other.std())
        found = clock_offset(stamps, seen, TIMES_OF_A_TURN, heading)
        assert found is None or not found.differs()


TIMES_OF_A_TURN = np.arange(0.0, 60.0, 0.05)
