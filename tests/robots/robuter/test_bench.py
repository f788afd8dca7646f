"""The Robuter on a bench: protocol, processor, motors and physics together, measured by its true path."""

import math
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Cause, Motors, Signals, Twist
from refseq_bench.robots.individual import RobotSpread
from refseq_bench.robots.odometry import CalibrationErrors
from refseq_bench.robots.robuter import LIMITS, SHAPE
from refseq_bench.robots.robuter.control import COMMAND_PERIOD
from refseq_bench.robots.robuter.firmware import HOLD
from refseq_bench.robots.robuter.regulator import SERVO_LAG
from refseq_bench.robots.robuter.sonars import FRONT_SONARS, SONARS
from refseq_bench.robots.robuter.watches import MARGIN, REACTION, ROUND
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.operator import Operator, OperatorStyle
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import box, in_the_open

PERFECT = BenchSettings(renderer=RendererKind.NONE, spread=RobotSpread(CalibrationErrors(0.0, 0.0, 0.0)))
WALL = 8.0
FACE = SHAPE.ahead
"""How far the front bumper is ahead of the axle [m]."""
SONARS_AHEAD = 0.275
"""How far the front sonars are."""


@pytest.fixture(scope="module")
def open_air() -> World:
    return build_world(parse_plan(in_the_open()), light_named("16:00"), pictured=False)


@pytest.fixture(scope="module")
def room() -> World:
    """8 m long, 4 m wide, a wall at its end."""
    return build_world(parse_plan(box(WALL, 4.0)), light_named("16:00"), pictured=False)


def bench_in(world: World, timestep: float | None = None) -> Bench:
    robot = robots.load("robuter")
    robot.spec.option.timestep = timestep or robot.spec.option.timestep
    return Bench(world, robot, settings=PERFECT)


def before_the_wall(room: World, away: float) -> Bench:
    """Front bumper so far from the wall [m]."""
    bench = bench_in(room)
    bench.place(Pose(WALL - FACE - away, 0.0, 0.0))
    return bench


def go(bench: Bench, seconds: float, twist: Twist | None, each: Callable[[], None] = lambda: None) -> None:
    for _ in range(round(seconds / CONTROL_PERIOD)):
        bench.wait() if twist is None else bench.drive(twist)
        each()


def speed(bench: Bench) -> float:
    return float(np.hypot(*bench.data.joint("robuter/base").qvel[:2]))


def causes(bench: Bench) -> set[Cause]:
    return {stop.cause for stop in bench.state.stops}


def test_the_processor_knows_its_sonars(open_air: World) -> None:
    with bench_in(open_air) as bench:
        assert BenchSettings().sonar.period < ROUND
        for number in FRONT_SONARS:
            site = bench.data.site(f"robuter/{SONARS[number]}")
            assert site.xpos[0] - bench.pose.x == pytest.approx(SONARS_AHEAD, abs=1e-3)


def test_ten_metres_straight_are_ten_metres(open_air: World) -> None:
    with bench_in(open_air) as bench:
        start = bench.pose
        go(bench, 25.0, Twist(0.4, 0.0))
        go(bench, 2.0, Twist())
        assert bench.pose.x - start.x == pytest.approx(10.0, abs=0.01)
        assert abs(bench.pose.y - start.y) < 0.005
        assert abs(bench.pose.heading - start.heading) < math.radians(0.1)
        assert bench.odometry.x == pytest.approx(10.0, abs=0.002)


@pytest.mark.quick_cases("0.5")
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_a_whole_turn_is_a_whole_turn(open_air: World, rate: float) -> None:
    with bench_in(open_air) as bench:
        start, turned = bench.pose, [0.0, bench.pose.heading]

        def count() -> None:
            turned[0] += math.remainder(bench.pose.heading - turned[1], 2 * math.pi)
            turned[1] = bench.pose.heading

        go(bench, 12.6, Twist(0.0, rate), count)  # whole command periods: 361°
        go(bench, 2.0, Twist(), count)
        assert turned[0] == pytest.approx(12.6 * rate, rel=0.004)  # the tyres slip
        assert bench.odometry.heading == pytest.approx(12.6 * rate, rel=0.0005)  # the wheels turn as they are told
        assert math.dist((bench.pose.x, bench.pose.y), (start.x, start.y)) < 0.01


def test_braking_takes_the_hold_and_half_v_squared_over_a(open_air: World) -> None:
    with bench_in(open_air) as bench:
        go(bench, 4.0, Twist(0.5, 0.0))
        start, top = bench.pose.x, speed(bench)
        go(bench, 3.0, Twist())
        way = bench.pose.x - start
        assert top == pytest.approx(0.5, rel=0.01)
        braking = top**2 / (2 * LIMITS.acceleration)
        # The stop is sent at once or after a command period; the motors follow with their lag.
        assert braking + top * SERVO_LAG - 0.02 < way < braking + top * (SERVO_LAG + COMMAND_PERIOD) + 0.02


def test_without_commands_it_stops_after_the_hold(open_air: World) -> None:
    with bench_in(open_air) as bench:
        go(bench, 3.0, Twist(0.4, 0.0))
        start, top = bench.pose.x, speed(bench)
        go(bench, 3.0, None)
        assert speed(bench) < 1e-3
        # The command of the last period is sent 3 s after the start, and holds from there.
        expected = top * (HOLD + SERVO_LAG) + top**2 / (2 * LIMITS.acceleration)
        assert bench.pose.x - start == pytest.approx(expected, abs=0.03)
        assert causes(bench) == {Cause.NO_COMMAND}


def test_no_command_is_driven_faster_than_the_limits(open_air: World) -> None:
    with bench_in(open_air) as bench:
        tops: list[tuple[float, float]] = []

        def note() -> None:
            tops.append((speed(bench), abs(float(bench.data.joint("robuter/base").qvel[5]))))

        go(bench, 3.0, Twist(3.0, 0.0), note)
        go(bench, 2.0, Twist(), note)
        go(bench, 3.0, Twist(0.0, -4.0), note)
        assert max(top for top, _ in tops) == pytest.approx(LIMITS.speed, rel=0.02)
        assert max(rate for _, rate in tops) == pytest.approx(LIMITS.turn_rate, rel=0.03)


def test_an_emergency_stop_locks_it_against_a_push_until_it_is_released(open_air: World) -> None:
    with bench_in(open_air) as bench:
        go(bench, 3.0, Twist(0.5, 0.0))
        start = bench.pose.x
        bench.control.emergency_stop()
        go(bench, 2.0, None)
        assert bench.pose.x - start < 0.08
        assert bench.state.motors is Motors.LOCKED
        stood = bench.pose
        bench.data.xfrc_applied[bench.model.body("robuter/base").id, 0] = 100.0
        go(bench, 10.0, Twist(0.5, 0.0))
        bench.data.xfrc_applied[:] = 0.0
        go(bench, 1.0, None)
        assert math.dist((bench.pose.x, bench.pose.y), (stood.x, stood.y)) < 0.002
        bench.control.release()
        go(bench, 2.0, Twist(0.5, 0.0))
        assert speed(bench) == pytest.approx(0.5, rel=0.02)
        assert bench.state.free


def test_a_push_moves_one_whose_brakes_are_open(open_air: World) -> None:
    with bench_in(open_air) as bench:
        go(bench, 1.0, Twist())
        start = bench.pose.x
        bench.data.xfrc_applied[bench.model.body("robuter/base").id, 0] = 100.0
        go(bench, 10.0, Twist())
        assert bench.pose.x - start > 0.004


def deaf(signals: Signals) -> Signals:
    """Sonars that hear nothing."""
    return replace(signals, sonar=np.full(24, 10.668))


def numb(signals: Signals) -> Signals:
    """Neither sonars nor bumpers."""
    return replace(deaf(signals), bumpers=frozenset())


@pytest.mark.quick_cases("twist1")
@pytest.mark.parametrize("twist", [Twist(0.1, 0.0), Twist(0.3, 0.0), Twist(0.5, 0.0)])
def test_the_front_sonars_stop_it_before_a_wall(room: World, twist: Twist) -> None:
    with before_the_wall(room, 3.0) as bench:
        reached: list[float] = []
        go(bench, 3.0 / twist.linear + 2.0, twist, lambda: reached.append(bench.pose.x))
        assert speed(bench) < 1e-3
        assert causes(bench) == {Cause.SONAR}
        left = WALL - SONARS_AHEAD - max(reached)
        # It brakes early or late by two deviations of a reading, and early by up to the way of its reaction.
        assert MARGIN - 0.1 < left < MARGIN + twist.linear * REACTION + 0.1
        assert WALL - FACE - max(reached) > 0.1
        start = bench.pose
        go(bench, 2.0, Twist(0.0, 0.4))
        assert bench.pose.heading - start.heading > 0.5, "turning on the spot stays possible"
        go(bench, 2.0, Twist(-0.2, 0.0))
        assert bench.pose.x < start.x - 0.2, "reversing as well"


def test_a_bumper_stops_it_and_lets_it_go_back(room: World) -> None:
    with before_the_wall(room, 0.5) as bench:
        bench.tamper = deaf
        reached: list[float] = []
        go(bench, 6.0, Twist(0.3, 0.0), lambda: reached.append(bench.pose.x))
        assert causes(bench) == {Cause.BUMPER}
        assert next(stop.detail for stop in bench.state.stops) == "front"
        assert max(reached) == pytest.approx(WALL - FACE, abs=0.01)
        assert speed(bench) < 1e-3
        assert bench.data.actuator("robuter/wheel-left").ctrl == 0.0
        go(bench, 2.0, Twist(-0.2, 0.0))
        assert bench.pose.x < max(reached) - 0.2
        assert bench.state.free


def test_pushing_against_a_wall_that_nothing_tells_of_is_a_stuck_wheel(room: World) -> None:
    with before_the_wall(room, 0.2) as bench:
        bench.tamper = numb
        go(bench, 6.0, Twist(0.2, 0.0))
        assert causes(bench) == {Cause.STUCK}
        assert bench.state.motors is Motors.LOCKED


def test_a_blocked_wheel_is_stuck(open_air: World) -> None:
    with bench_in(open_air) as bench:
        go(bench, 2.0, Twist(0.3, 0.0))
        joint = bench.model.joint("robuter/wheel-right")
        bench.model.dof_damping[joint.dofadr[0]] = 1e5
        go(bench, 4.0, Twist(0.3, 0.0))
        (stop,) = bench.state.stops
        assert stop.cause is Cause.STUCK
        assert stop.detail.startswith("right wheel")
        assert speed(bench) < 1e-3


def test_a_person_leads_it_by_a_route_with_a_bend_over_five_commands_a_second(open_air: World) -> None:
    route = np.array([[-10.0, 0.0], [-4.0, 0.0], [-4.0, 6.0]])
    with bench_in(open_air) as bench:
        operator, strayed = Operator(route, OperatorStyle(), np.random.default_rng(1)), []
        while not operator.finished and bench.time < 60.0:
            bench.drive(operator.command(bench.time, bench.pose))
            x, y = bench.pose.x, bench.pose.y
            strayed.append(min(abs(y) if x < -4.0 else math.inf, abs(x + 4.0) if y > 0.0 else math.hypot(x + 4.0, y)))
        assert operator.finished
        assert max(strayed) < 0.3


@pytest.mark.slow  # the same of the physics alone is in test_robuter.py; this adds the protocol's times
def test_twenty_metres_of_bends_converge_with_the_time_step(open_air: World) -> None:
    ends = {}
    for timestep in (0.001, 0.002, 0.004):
        with bench_in(open_air, timestep) as bench:
            for step in range(1250):
                bench.drive(Twist(0.4, 0.3 * math.sin(step * CONTROL_PERIOD / 2)))
            go(bench, 2.0, Twist())
            ends[timestep] = np.array([bench.pose.x, bench.pose.y, bench.pose.heading])
    coarse, middle = (np.abs(ends[step] - ends[0.001]) for step in (0.004, 0.002))
    assert coarse.max() < 0.01
    assert middle.max() < 0.6 * coarse.max()


@pytest.mark.slow  # ten minutes of simulated time take about 20 s
def test_energy_does_not_grow_at_rest(open_air: World) -> None:
    with bench_in(open_air) as bench:
        bench.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        go(bench, 5.0, Twist())
        start, energy, kinetic = bench.pose, bench.data.energy.sum(), []
        go(bench, 600.0, Twist(), lambda: kinetic.append(bench.data.energy.sum() - energy))
        assert max(kinetic) < 1e-3
        assert math.dist((bench.pose.x, bench.pose.y), (start.x, start.y)) < 1e-3
        assert bench.data.energy[1] < 1e-6
