import math
from dataclasses import replace

import numpy as np
import pytest

from refseq.view import LASER, Scan, View


def test_bearings_and_points_of_a_scan() -> None:
    scan = Scan(np.array([1, 2, np.inf, 3, 4], np.float32), -math.pi / 2, math.pi / 4, max_range=10.0)
    assert scan.bearings == pytest.approx(np.radians([-90, -45, 0, 45, 90]))
    half = math.sqrt(0.5)
    expected = np.array([[0, -1], [2 * half, -2 * half], [10, 0], [3 * half, 3 * half], [0, 4]])
    assert scan.points == pytest.approx(expected, abs=1e-12)


def test_a_scan_by_default_covers_the_half_turn_in_front() -> None:
    bearings = Scan(np.ones(361, np.float32)).bearings
    assert (bearings[0], bearings[180], bearings[-1]) == pytest.approx((-math.pi / 2, 0.0, math.pi / 2), abs=1e-12)


def test_sensors_are_the_cameras_and_the_laser_that_are_there() -> None:
    image, scan = np.zeros((2, 2), np.uint8), Scan(np.ones(3, np.float32))
    assert View(0.0).sensors == frozenset()
    assert View(0.0, {"camera-1": image}).sensors == {"camera-1"}
    assert View(0.0, {"camera-1": image}, scan).sensors == {"camera-1", LASER}


def test_views_are_equal_whose_values_are() -> None:
    def seen(grey: int, reach: float = 5.0) -> View:
        return View(1.0, {"camera": np.full((2, 2), grey, np.uint8)}, Scan(np.full(3, reach, np.float32)))

    assert seen(3) == seen(3)
    assert seen(3) != seen(4)
    assert seen(3) != seen(3, 6.0)
    assert seen(3) != View(1.0, {"other": np.full((2, 2), 3, np.uint8)}, seen(3).scan)
    assert seen(3) != replace(seen(3), scan=None)
    assert seen(3) != "view"
