"""Measurements of the acceptance trials, against motions that are known."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Limits, Twist
from refseq_bench.sim.acceptance import trials
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World


@pytest.fixture(scope="module")
def floor() -> World:
    return empty_floor()


def bench_on(floor: World, name: str = "robuter") -> Bench:
    return Bench(floor, robots.load(name), settings=BenchSettings(renderer=RendererKind.NONE, cameras=()))


@given(amount=st.floats(0.05, 50), speed=st.floats(0.05, 3), acceleration=st.floats(0.1, 5))
def test_a_ramp_covers_its_amount_within_its_limits(amount: float, speed: float, acceleration: float) -> None:
    ramp = trials.Ramp(amount, speed, acceleration)
    times = np.linspace(0.0, ramp.seconds, 4001)
    speeds = np.array([ramp.at(t) for t in times])
    assert np.trapezoid(speeds, times) == pytest.approx(amount, rel=1e-3)
    assert speeds.max() <= speed * (1 + 1e-9)
    assert np.abs(np.diff(speeds)).max() <= acceleration * (times[1] + 1e-12)
    assert speeds[0] == 0.0
    assert speeds[-1] == pytest.approx(0.0, abs=1e-9)


@given(speed=st.floats(0.05, 3), deceleration=st.floats(0.1, 5))
def test_braking_distance_is_what_stopping_evenly_takes(speed: float, deceleration: float) -> None:
    times = np.linspace(0.0, speed / deceleration, 1001)
    along = np.trapezoid(speed - deceleration * times, times)
    limits = Limits(speed=3.0, turn_rate=1.0, acceleration=deceleration, angular_acceleration=1.0)
    assert trials.braking_distance(limits, speed) == pytest.approx(along)


@pytest.mark.parametrize("heading", [0.0, 2.0, -2.5])
def test_a_track_is_told_from_where_the_robot_stood(floor: World, heading: float) -> None:
    with bench_on(floor) as bench:
        bench.place(Pose(3.0, -2.0, heading))
        track = trials.follow(bench, lambda _: Twist(0.4, 0.2), 4.0)
        at = bench.pose
    end = track.points[-1]
    assert track.along > 0.8
    assert track.aside > 0.2
    x = 3.0 + math.cos(heading) * end[0] - math.sin(heading) * end[1]
    y = -2.0 + math.sin(heading) * end[0] + math.cos(heading) * end[1]
    assert (x, y) == pytest.approx((at.x, at.y), abs=2e-3)
    assert track.turned == pytest.approx(math.remainder(at.heading - heading, 2 * math.pi), abs=1e-9)
    assert len(track.times) == round(4.0 / CONTROL_PERIOD) + 1


@pytest.mark.parametrize("pitch", [-0.2, 0.1])
def test_a_pitch_is_positive_where_the_nose_is_down(floor: World, pitch: float) -> None:
    """A turn about the axis to the left, by the right-hand rule, takes what is ahead down."""
    with bench_on(floor) as bench:
        bench.data.joint("robuter/base").qpos[3:] = (math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
        mujoco.mj_forward(bench.model, bench.data)
        track = trials.follow(bench, trials.stand, 0.0)
    assert track.pitches == pytest.approx([pitch])


def test_a_whole_turn_is_counted_on(floor: World) -> None:
    with bench_on(floor) as bench:
        asked, track = trials.turn(bench, 2 * math.pi)
    assert asked == pytest.approx(2 * math.pi, rel=1e-3)
    assert track.turned == pytest.approx(asked, rel=0.02)


def test_a_push_gives_the_impulse_that_was_asked_for(floor: World) -> None:
    with bench_on(floor) as bench:
        body = bench.model.body("robuter/base").id
        given: list[float] = []
        step, before = bench.wait, bench.time

        def noting() -> None:
            given.append(float(bench.data.xfrc_applied[body, 0]) * CONTROL_PERIOD)
            step()

        bench.wait = noting
        trials.push(bench, 12.0, 1.0, height=1.0, duration=0.1)  # two and a half periods
        assert bench.time > before
    assert sum(given) == pytest.approx(12.0)


@pytest.mark.parametrize("above", [0.0, 0.4])
def test_a_push_turns_by_its_height_over_the_centre_of_mass(floor: World, above: float) -> None:
    with bench_on(floor) as bench:
        body = bench.model.body("robuter/base").id
        centre = float(bench.data.xipos[body, 2] - bench.data.xpos[body, 2])
        wrenches: list[np.ndarray] = []
        step = bench.wait

        def noting() -> None:
            wrenches.append(bench.data.xfrc_applied[body].copy())
            step()

        bench.wait = noting
        trials.push(bench, 12.0, 0.5, height=centre + above)
    force, _, _, roll, pitch, _ = max(wrenches, key=lambda wrench: wrench[0])
    # Nose down is positive about the axis to the left.
    assert pitch == pytest.approx(above * force, abs=0.01 * force)
    assert abs(roll) < 0.01 * force


def test_only_the_one_on_two_wheels_balances(floor: World) -> None:
    for name, balancing in (("robuter", False), ("segway_rmp", True), ("segway_rmp-tractor", False)):
        with bench_on(floor, name) as bench:
            assert trials.balances(bench) is balancing, name


def test_energy_that_is_fed_in_shows(floor: World) -> None:
    with bench_on(floor) as bench:
        quiet = trials.energy_growth(bench, 3.0)
    with bench_on(floor) as bench:
        step = bench.wait

        def fed() -> None:
            bench.data.qvel[2] += 1e-4 * bench.time  # a floor that shakes more and more
            step()

        bench.wait = fed
        shaken = trials.energy_growth(bench, 3.0)
    assert abs(quiet) < 1e-6
    assert abs(shaken) > 10 * max(abs(quiet), 1e-9)
