import math

import numpy as np
import pytest

from refseq.planar import Pose
from refseq.view import Scan
from refseq_bench.scenarios.log_tools.offsets import clock_offset, picture_turns, scan_turns
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


def test_turns_have_their_sign_and_size():
    left = [cast(ROOM, Pose(0.0, 0.0, math.radians(angle)), beams=181) for angle in (0, 3)]
    assert scan_turns(left) == pytest.approx([math.radians(3)], abs=math.radians(0.5))
