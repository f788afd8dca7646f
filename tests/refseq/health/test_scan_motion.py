"""Two scans against the odometer between them: a robot that drove, and one that was carried."""

import numpy as np
import pytest

from refseq.health.scan_motion import FOLLOWS, SILENT, MotionWatch, motion_ratios
from refseq.planar import Pose, after_motion
from refseq.view import View
from tests.refseq.rooms import Wall, cast, rectangle

ROOMS: list[Wall] = [
    *rectangle(0, 0, 8, 5), *rectangle(2, 1, 3, 1.4), *rectangle(5, 4, 6.5, 5), *rectangle(7, 0, 8, 2),
    *rectangle(20, 0, 26, 9), *rectangle(22, 6, 23, 7), *rectangle(24, 1, 25, 1.5),
]  # fmt: skip
BARE: list[Wall] = rectangle(0, 0, 60, 2.4)


def carried(walls: list[Wall], before: Pose, after: Pose, distance: float, turn: float) -> float:
    rng = np.random.default_rng(1)
    return motion_ratios(cast(walls, before, rng=rng), cast(walls, after, rng=rng), distance, turn).carried


@pytest.mark.parametrize(("distance", "turn"), [(0.85, 0.0), (0.85, 0.3), (0.5, -0.2), (-0.6, 0.1)])
def test_a_robot_that_drove_was_not_carried(distance: float, turn: float) -> None:
    before = Pose(3.5, 2.5, 0.4)
    assert carried(ROOMS, before, after_motion(before, distance, turn), distance, turn) < -2


@pytest.mark.parametrize("after", [Pose(22, 3, 0.4), Pose(6, 3, 2.5)], ids=["other room", "same room"])
def test_a_robot_that_is_elsewhere_was_carried(after: Pose) -> None:
    assert carried(ROOMS, Pose(3.5, 2.5, 0.4), after, 0.85, 0.0) > 2


@pytest.mark.parametrize("walls", [ROOMS, BARE], ids=["room", "corridor"])
@pytest.mark.parametrize("way", [0.85, 0.0], ids=["drove on", "stood"])
def test_a_wheel_that_spins_is_no_turn(walls: list[Wall], way: float) -> None:
    """The odometer tells of 46°, and the walls are where they were: a corridor's tell that as well as any."""
    before = Pose(4.0, 1.3, 0.0)
    assert carried(walls, before, after_motion(before, way, 0.0), 0.85, 0.8) > 2


@pytest.mark.parametrize("turn", [0.8, -1.2, 1.5, 1.8, 3.1])
@pytest.mark.parametrize("walls", [ROOMS, BARE], ids=["room", "corridor"])
def test_a_large_turn_that_was_made_tells_next_to_nothing(walls: list[Wall], turn: float) -> None:
    """On an arc, or on the spot before the way or after it: nobody knows which."""
    before = Pose(4.0, 1.3, 0.1)
    for after in (
        after_motion(before, 0.85, turn),
        after_motion(after_motion(before, 0.0, turn), 0.85, 0.0),
        after_motion(after_motion(before, 0.85, 0.0), 0.0, turn),
    ):
        assert carried(walls, before, after, 0.85, turn) < 2


def test_in_a_bare_corridor_nobody_can_tell() -> None:
    """Thirty metres on it looks the same as a step ahead: nothing is said of either."""
    for x in (15.85, 45.0):
        assert carried(BARE, Pose(15, 1.2, 0), Pose(x, 1.2, 0), 0.85, 0.0) == pytest.approx(0.0, abs=1.0)


def test_two_scans_say_no_more_than_the_most() -> None:
    assert carried(ROOMS, Pose(3.5, 2.5, 0.4), Pose(22, 3, 2.4), 0.85, 0.0) <= FOLLOWS
    before = Pose(3.5, 2.5, 0.4)
    assert carried(ROOMS, before, after_motion(before, 0.85, 0.0), 0.85, 0.0) >= -FOLLOWS


def test_a_robot_that_stands_after_a_view_without_odometry_is_compared_with_it() -> None:
    """A scan was missing before, which is not missing between these two."""
    scan = cast(ROOMS, Pose(3.5, 2.5, 0.4), rng=np.random.default_rng(1))
    watch = MotionWatch()
    for seen, view in ((scan, View(0.0)), (None, View(1.0, distance=0.1)), (scan, View(2.0, has_odometry=False))):
        assert watch.update(seen, view) == SILENT
    assert watch.update(scan, View(3.0)) == motion_ratios(scan, scan, 0.0, 0.0) != SILENT
