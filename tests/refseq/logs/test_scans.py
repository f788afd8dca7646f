import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.errors import LogError
from refseq.features.doors import DoorSettings, find_doors
from refseq.features.sectors import sector_ranges
from refseq.logs.scans import mounted, scan_of
from refseq.logs.transforms import Mount
from refseq.planar import Pose
from refseq.view import Scan
from tests.refseq.rooms import rays


def seen(scan: Scan) -> dict[int, float]:
    """Range by bearing [millirad], in (−π, π]."""
    turned = np.remainder(scan.bearings + math.pi, 2 * math.pi) - math.pi
    return dict(zip(np.round(1000 * turned).astype(int).tolist(), scan.ranges.tolist(), strict=True))


def test_ranges_that_are_none_came_from_nowhere() -> None:
    scan = scan_of([math.nan, math.inf, 0.0, -1.0, 0.05, 0.2, 29.9, 30.0, 31.0], -1.0, 0.25, 0.1, 30.0)
    assert np.flatnonzero(np.isfinite(scan.ranges)).tolist() == [5, 6]
    assert scan.max_range == 30.0


@pytest.mark.parametrize("untold", [None, 0.0, math.inf, math.nan, -1.0])
def test_a_farthest_range_that_is_not_told_takes_no_range_away(untold: float | None) -> None:
    scan = scan_of([1.0, 500.0], 0.0, 0.1, 0.0, untold)
    assert scan.ranges.tolist() == [1.0, 500.0]


@given(st.integers(2, 400), st.floats(-3, 3), st.floats(1e-3, 1e-2))
def test_a_scanner_that_turns_clockwise_sees_the_same_in_the_same_directions(
    beams: int, start: float, step: float
) -> None:
    ranges = np.arange(1, beams + 1)
    forwards = scan_of(ranges, start, step)
    backwards = scan_of(ranges[::-1], start + step * (beams - 1), -step)
    assert backwards.step > 0
    np.testing.assert_array_equal(forwards.ranges, backwards.ranges)
    np.testing.assert_allclose(forwards.bearings, backwards.bearings, atol=1e-9)


@pytest.mark.parametrize("beams", [181, 361, 720, 1081])
def test_a_laser_upside_down_sees_left_what_it_takes_for_right(beams: int) -> None:
    bearings = np.linspace(-2.3, 1.1, beams)
    scan = scan_of(3 + np.sin(bearings), -2.3, 3.4 / (beams - 1))
    robot = mounted(scan, Mount(upside_down=True))
    np.testing.assert_allclose(robot.ranges, 3 - np.sin(robot.bearings), rtol=1e-5)
    assert robot.bearings[[0, -1]] == pytest.approx([-1.1, 2.3])


@given(st.floats(-10, 10))
def test_a_mount_s_yaw_turns_the_bearings(yaw: float) -> None:
    scan = scan_of(np.arange(1, 62), -0.3, 0.01)
    robot = mounted(scan, Mount(0.3, 0.0, yaw))
    np.testing.assert_array_equal(robot.ranges, scan.ranges)
    turned = robot.bearings - scan.bearings - yaw
    np.testing.assert_allclose(np.cos(turned), 1, atol=1e-9)
    assert abs(float(robot.bearings.mean())) <= math.pi + 1e-9


def test_upside_down_and_turned_agree_with_the_rotation_in_space() -> None:
    bearings = np.linspace(-1, 2, 7)
    robot = mounted(scan_of(np.arange(1, 8), -1.0, 0.5), Mount(yaw=0.7, upside_down=True))
    # Yaw after half a turn about the laser's x axis: (cos b, sin b) → Rz(yaw) (cos b, −sin b).
    expected = {round(1000 * (0.7 - b)): r for b, r in zip(bearings, range(1, 8), strict=True)}
    assert seen(robot) == pytest.approx(expected)


ANGLES = "valid are angles within two turns, and steps not of 0"


@pytest.mark.parametrize(
    ("start", "step", "count", "message"),
    [
        (
            1e30,
            0.1,
            3,
            f"a scan starts at 1e+30 rad with steps of 0.1 rad; {ANGLES}",
        ),
        (
            math.nan,
            0.1,
            3,
            f"a scan starts at nan rad with steps of 0.1 rad; {ANGLES}",
        ),
        (
            0.0,
            0.0,
            3,
            f"a scan starts at 0.0 rad with steps of 0.0 rad; {ANGLES}",
        ),
        (
            -90.0,
            1.0,
            181,
            f"a scan starts at -90.0 rad with steps of 1.0 rad: are they in degrees?; {ANGLES}",
        ),
        (
            0.0,
            1.0,
            30,
            "a scan of 30 beams with steps of 1 rad is more than one turn: are they in degrees?; valid is one turn at "
            "most",
        ),
        (0.0, 0.3, 30, "a scan of 30 beams with steps of 0.3 rad is more than one turn; valid is one turn at most"),
        (0.0, 30.0, 30, "a scan of 30 beams with steps of 30 rad is more than one turn; valid is one turn at most"),
        (0.0, 1e-9, 100_001, "a message has 100001 ranges in a scan; valid are at most 100000"),
    ],
)
def test_scans_that_are_none(start: float, step: float, count: int, message: str) -> None:
    with pytest.raises(LogError) as caught:
        scan_of(np.ones(count), start, step)
    assert str(caught.value) == message


@pytest.mark.parametrize("beams", [720, 721])
@pytest.mark.parametrize("start", [0.0, -math.pi, math.pi / 3])
def test_a_scanner_that_sees_all_around_may_begin_anywhere(start: float, beams: int) -> None:
    """A room with a door ahead: its features, walls and doors are the same, the first beam repeated or not."""
    walls = [(2, -3, 2, -0.45), (2, 0.45, 2, 3), (-2, -3, 2, -3), (-2, 3, 2, 3), (-2, -3, -2, 3), (5, -3, 5, 3)]
    step = math.radians(0.5)
    seen = scan_of(rays(walls, Pose(0.0, 0.0, 0.0), start + step * np.arange(beams)), start, step)
    assert seen.start == pytest.approx(-math.pi, abs=step)
    assert len(seen.ranges) == beams
    behind = scan_of(rays(walls, Pose(0.0, 0.0, 0.0), -math.pi + step * np.arange(720)), -math.pi, step)
    (door,) = find_doors(seen, DoorSettings())
    assert door.centre == pytest.approx((2.0, 0.0), abs=0.02)
    np.testing.assert_allclose(sector_ranges(seen, 24), sector_ranges(behind, 24), atol=0.05)


def test_360_beams_of_which_the_last_repeats_the_first_begin_behind() -> None:
    """From 0 to 6.28 rad, as simulated TurtleBots have them: each beam but the last is seen where it was."""
    step = 6.28 / 359
    told = np.arange(1, 361)
    scan = scan_of(told, 0.0, step, max_range=400.0)
    assert scan.start == pytest.approx(-math.pi, abs=step)
    assert scan.ranges[0] == scan.ranges[-1]
    before = dict(zip(told[:-1].tolist(), (step * np.arange(359)).tolist(), strict=True))
    for ranged, bearing in zip(scan.ranges[:-1].tolist(), scan.bearings[:-1].tolist(), strict=True):
        apart = (bearing - before[int(ranged)] + math.pi) % (2 * math.pi) - math.pi
        assert abs(apart) <= step / 2
