import math
from functools import cached_property

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import DifferentialDrive, RobotsError
from refseq_bench.robots.odometry import Geometry, along_arc, true_geometry
from refseq_bench.sim.acceptance.umbmark import Direction, Point, Return, Umbmark, umbmark
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.errors import SimError

DRIVE = DifferentialDrive(track=0.62, wheel_radius=0.12, max_wheel_speed=8.0)
TRUE = true_geometry(DRIVE)
CW, CCW = Direction.CLOCKWISE, Direction.COUNTER_CLOCKWISE


def believing(wheel_ratio: float, track_ratio: float, size: float = 1.0) -> Geometry:
    """Wrong by these: the true right wheel over the left one, and the true track, in units of what is believed."""
    left, right = math.sqrt(wheel_ratio), 1 / math.sqrt(wheel_ratio)
    return Geometry(size * TRUE.left_radius * left, size * TRUE.right_radius * right, size * TRUE.track / track_ratio)


def without_slip(believed: Geometry, direction: Direction, side: float) -> Return:
    """Where wheels that do not slip get when the odometer shows a square; the odometer ends where it began."""
    pose = robots.PlanarPose()
    for _ in range(4):
        for length, turn in ((side, 0.0), (0.0, direction.value * math.pi / 2)):
            left = (length - turn * believed.track / 2) / believed.left_radius * TRUE.left_radius
            right = (length + turn * believed.track / 2) / believed.right_radius * TRUE.right_radius
            pose = along_arc(pose, (left + right) / 2, (right - left) / TRUE.track)
    return Return(direction, pose.x, pose.y, pose.heading - direction.value * 2 * math.pi)


def slip_free(believed: Geometry, side: float = 4.0) -> Umbmark:
    return Umbmark("wheels", side, believed, tuple(without_slip(believed, way, side) for way in Direction))


def test_the_truth_comes_back_to_where_it_began() -> None:
    found = slip_free(TRUE)
    assert found.worst == pytest.approx(0, abs=1e-9)
    assert (found.track_ratio, found.wheel_ratio) == pytest.approx((1, 1))


@given(st.floats(-0.02, 0.02))
def test_a_wrong_track_alone_is_a_type_a_error(excess: float) -> None:
    found = slip_free(believing(1.0, 1 + excess))
    assert found.track_ratio - 1 == pytest.approx(excess, rel=0.1, abs=1e-6)
    assert found.wheel_ratio - 1 == pytest.approx(0, abs=2e-5 + 0.02 * abs(excess))
    assert math.copysign(1, found.alpha) == math.copysign(1, excess) or abs(excess) < 1e-9


@given(st.floats(-0.005, 0.005), st.floats(0.5, 6.0))
def test_unequal_wheels_alone_are_a_type_b_error(excess: float, side: float) -> None:
    found = slip_free(believing(1 + excess, 1.0), side)
    bend = side * excess / TRUE.track
    assert found.beta == pytest.approx(bend, rel=0.02 + 4 * abs(bend), abs=1e-7)
    assert found.wheel_ratio - 1 == pytest.approx(excess, rel=0.02 + 4 * abs(bend), abs=1e-7)


@given(st.floats(-0.002, 0.002), st.floats(-0.01, 0.01), st.floats(0.99, 1.01))
def test_both_are_told_apart_whatever_the_size_of_the_wheels(wheels: float, track: float, size: float) -> None:
    """The theory is that of small errors: what is left is of second order. A wrong size scales the square."""
    found = slip_free(believing(1 + wheels, 1 + track, size))
    second = 20 * (4 * wheels / TRUE.track) ** 2 + 20 * track**2
    assert found.track_ratio - 1 == pytest.approx(track, abs=second + 0.02 * abs(track) + 1e-7)
    assert found.wheel_ratio - 1 == pytest.approx(wheels, abs=second * TRUE.track / 4 + 0.02 * abs(wheels) + 1e-7)


@given(st.floats(-0.003, 0.003), st.floats(-0.02, 0.02))
def test_what_is_corrected_returns_far_better(wheels: float, track: float) -> None:
    before = slip_free(believing(1 + wheels, 1 + track))
    after = slip_free(before.corrected)
    assert after.worst < 0.15 * before.worst + 1e-9


def test_correction_keeps_the_mean_size() -> None:
    wrong = believing(1.003, 1.02)
    right = slip_free(wrong).corrected
    assert right.left_radius + right.right_radius == pytest.approx(wrong.left_radius + wrong.right_radius)


def test_one_direction_alone_can_hide_both_errors() -> None:
    """The paper's reason for driving both ways: an error of each type that cancel clockwise."""
    turn_short = 0.02  # of a right angle [rad]
    wheels = 1 - turn_short * TRUE.track / 4
    found = slip_free(believing(wheels, 1 / (1 - turn_short * 2 / math.pi)))
    assert found.centre(CW).size < 0.1 * found.centre(CCW).size
    assert found.worst == found.centre(CCW).size > 0.25


def test_centres_and_spread_by_hand() -> None:
    runs = (Return(CW, 1, 2, 0), Return(CW, 3, 2, 0), Return(CCW, 0, 1, 0), Return(CCW, 0, 3, 0))
    found = Umbmark("wheels", 4.0, TRUE, runs)
    assert found.centre(CW) == Point(2, 2)
    assert found.centre(CCW) == Point(0, 2)
    assert found.worst == pytest.approx(math.sqrt(8))
    assert found.spread(CW) == found.spread(CCW) == 1
    assert found.alpha == pytest.approx((2 + 0 + 2 - 2) / -32)
    assert found.beta == pytest.approx((2 - 0 + 2 + 2) / -32)


class Driven:
    """Squares of 1 m that the Robuter drives on the floor, by wrong beliefs, by right ones, and by corrected ones."""

    planted = believing(1.01, 1.02)

    @cached_property
    def wrong(self) -> Umbmark:
        return umbmark("robuter", self.planted, side=1.0, runs=1)

    @cached_property
    def right(self) -> Umbmark:
        return umbmark("robuter", TRUE, side=1.0, runs=1)

    @cached_property
    def corrected(self) -> Umbmark:
        return umbmark("robuter", self.wrong.corrected, side=1.0, runs=1)


@pytest.fixture(scope="module")
def driven() -> Driven:
    return Driven()


def test_planted_errors_are_found(driven: Driven) -> None:
    """Beside what its tyres scrub off in turns, which shows as a track that is too narrow."""
    assert driven.wrong.wheel_ratio - 1 == pytest.approx(0.01, rel=0.05)
    assert driven.wrong.track_ratio / driven.right.track_ratio - 1 == pytest.approx(0.02, rel=0.1)


def test_a_right_belief_leaves_what_the_tyres_scrub_off(driven: Driven) -> None:
    assert driven.right.wheel_ratio == pytest.approx(1, abs=2e-4)
    assert 1.001 < driven.right.track_ratio < 1.006
    assert driven.right.worst < 0.05


@pytest.mark.slow
def test_correction_helps_on_the_floor(driven: Driven) -> None:
    assert driven.wrong.worst > 0.1
    assert driven.corrected.worst < driven.wrong.worst / 10
    assert driven.corrected.worst < driven.right.worst, "it makes up for the scrub, too"


def test_runs_go_both_ways(driven: Driven) -> None:
    assert [run.direction for run in driven.wrong.returns] == [CW, CCW]
    assert driven.wrong.believed == driven.planted
    assert driven.wrong.robot == "robuter"


def test_it_gives_up_on_a_robot_that_is_kept_from_going(monkeypatch: pytest.MonkeyPatch) -> None:
    place = Bench.place

    def placed(bench: Bench, pose: Pose) -> None:
        place(bench, pose)
        bench.control.emergency_stop()

    monkeypatch.setattr(Bench, "place", placed)
    with pytest.raises(SimError, match=r"^umbmark: robuter did not finish a side or a turn by .* s \(emergency stop: "):
        umbmark("robuter", TRUE, side=0.5, runs=1)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"side": 0.0}, "umbmark: side = 0.0 m must be above 0 and at most 15 m"),
        ({"side": 16.0}, "umbmark: side = 16.0 m must be above 0 and at most 15 m"),
        ({"side": math.nan}, "umbmark: side = nan m must be above 0 and at most 15 m"),
        ({"runs": 0}, "umbmark: runs = 0 must be 1 or more"),
    ],
)
def test_impossible_squares_are_refused(how: dict[str, float], message: str) -> None:
    with pytest.raises(SimError) as error:
        umbmark("robuter", TRUE, **how)
    assert str(error.value) == message


def test_an_unknown_robot_is_refused() -> None:
    with pytest.raises(RobotsError, match=r"^unknown robot 'scout'"):
        umbmark("scout", TRUE)
