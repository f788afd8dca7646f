"""What keeps people, walls and the robot itself whole, on every robot: driven in a corridor where somebody stands."""

import math
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Cause, Inertial, Signals, Twist
from refseq_bench.robots.odometry import Pulses
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

BLIND = BenchSettings(renderer=RendererKind.NONE)
WALKABLE = ("robuter", "segway_rmp")
every_robot = pytest.mark.parametrize("name", WALKABLE)

PERSON = """
[[person]]
name = "ana"
at = [6.0, {aside}]
heading = 90
"""


def corridor(end: str = "") -> World:
    """8 m long and 2.4 m wide; robots start at x = 1 m and head along it."""
    return build_world(parse_plan(SMALL.format(top="", end=end)), light_named("16:00"), pictured=False)


@pytest.fixture(scope="module")
def empty() -> World:
    return corridor()


class Watched:
    """A bench that notes what other than the floor the robot has touched."""

    def __init__(self, world: World, name: str) -> None:
        self.bench = Bench(world, robots.load(name), seed=1, settings=BLIND)
        model = self.bench.model
        self._own = np.array([model.body(body).name.startswith(f"{name}/") for body in model.geom_bodyid])
        self._floor = model.geom("floor").id
        self.touched: set[str] = set()

    def __enter__(self) -> "Watched":
        return self

    def __exit__(self, *_: object) -> None:
        self.bench.close()

    def go(self, seconds: float, twist: Twist | None, push: Callable[[Bench], None] = lambda _: None) -> None:
        """Drive on under a command, or without one."""
        for _ in range(round(seconds / CONTROL_PERIOD)):
            push(self.bench)
            self.bench.wait() if twist is None else self.bench.drive(twist)
            for pair in self.bench.data.contact.geom:
                if self._own[pair].sum() == 1 and self._floor not in pair:
                    self.touched.add(self.bench.model.geom(int(pair[~self._own[pair]][0])).name)

    @property
    def causes(self) -> set[Cause]:
        return {stop.cause for stop in self.bench.state.stops}

    @property
    def speed(self) -> float:
        """The true speed of the wheels' axle [m/s]."""
        joint = self.bench.data.joint(f"{self.bench.robot.name}/{self.bench.robot.base}")
        return math.hypot(*joint.qvel[:2])


@pytest.mark.quick_cases("1.0-0.0-robuter", "0.5--0.2-segway_rmp")
@every_robot
@pytest.mark.parametrize("aside", [-0.2, 0.0, 0.15])
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_it_stops_before_somebody_who_stands_in_its_way(name: str, aside: float, share: float) -> None:
    with Watched(corridor(PERSON.format(aside=aside)), name) as watched:
        speed = share * watched.bench.robot.limits.speed
        watched.go(7.0 / speed, Twist(speed, 0.0))
        shape = watched.bench.robot.shape
        assert watched.touched == set()
        assert watched.causes & {Cause.SONAR, Cause.LASER}
        assert watched.speed < 0.03
        gap = 6.0 - (watched.bench.pose.x + shape.ahead)
        assert 0.15 < gap < 1.5, "it comes near enough to be of use"


@pytest.mark.quick_cases("robuter")
@every_robot
def test_it_goes_on_when_the_way_is_free_again(name: str) -> None:
    walker = PERSON.format(aside=0.0) + "walk = [[6.0, 0.9]]\nspeed = 0.1\n"
    with Watched(corridor(walker), name) as watched:
        watched.go(30.0, Twist(0.3, 0.0))
        assert watched.touched <= {"end"}
        assert watched.bench.pose.x > 6.0


@every_robot
def test_without_commands_it_stops_and_says_so(name: str, empty: World) -> None:
    with Watched(empty, name) as watched:
        watched.go(3.0, Twist(0.4, 0.0))
        assert watched.speed > 0.3
        watched.go(3.0, None)
        assert watched.speed < 0.03
        assert Cause.NO_COMMAND in watched.causes
        watched.go(2.0, Twist(0.4, 0.0))
        assert Cause.NO_COMMAND not in watched.causes
        assert watched.speed > 0.3


@every_robot
def test_an_emergency_stop_holds_until_it_is_released(name: str, empty: World) -> None:
    with Watched(empty, name) as watched:
        watched.go(2.0, Twist(0.4, 0.0))
        watched.bench.control.emergency_stop()
        watched.go(3.0, Twist(0.4, 0.0))
        assert watched.speed < 0.03
        assert watched.causes == {Cause.EMERGENCY}
        watched.bench.control.release()
        watched.go(2.0, Twist(0.4, 0.0))
        assert watched.speed > 0.3
        assert watched.bench.state.free


@every_robot
def test_one_that_has_tipped_over_says_so_and_its_motors_rest(name: str, empty: World) -> None:
    def push(bench: Bench) -> None:
        base = bench.model.body(f"{name}/base").id
        bench.data.xfrc_applied[base, 3] = 1500.0  # N·m about its length: over its side

    with Watched(empty, name) as watched:
        watched.go(1.0, Twist())
        watched.go(3.0, Twist(0.3, 0.0), push)
        watched.bench.data.xfrc_applied[:] = 0.0
        watched.go(1.0, Twist(0.3, 0.0))
        assert Cause.TIPPED in watched.causes
        assert np.abs([motor.ctrl[0] for motor in _motors(watched.bench)]).max() == 0.0


def _motors(bench: Bench) -> list[mujoco.MjData]:
    return [bench.data.actuator(f"{bench.robot.name}/{name}") for name in bench.robot.wheel_actuators]


@every_robot
def test_a_stuck_wheel_is_told(name: str, empty: World) -> None:
    with Watched(empty, name) as watched:
        joint = watched.bench.model.joint(f"{name}/{watched.bench.robot.wheel_joints[0]}")
        watched.bench.model.dof_damping[joint.dofadr[0]] = 1e5  # as if something were wound about the axle
        watched.go(6.0, Twist(0.4, 0.0))
        assert Cause.STUCK in watched.causes
        assert "left wheel" in next(s.detail for s in watched.bench.state.stops if s.cause is Cause.STUCK)


FAULTS = {
    "inertial": lambda signals: replace(signals, inertial=Inertial(*[math.nan] * 4)),
    "encoders": lambda signals: replace(signals, pulses=Pulses(math.nan, math.nan)),  # type: ignore[arg-type]
    "sonar": lambda signals: replace(signals, sonar=np.full(24, np.nan) if signals.sonar is not None else None),
    "laser": lambda signals: replace(signals, scan=_blinded(signals)),
}


def _blinded(signals: Signals) -> object:
    if signals.scan is None:
        return None
    return replace(signals.scan, ranges=np.full_like(signals.scan.ranges, np.nan))  # type: ignore[type-var]


@pytest.mark.quick_cases("inertial-segway_rmp", "laser-segway_rmp", "sonar-robuter", "encoders-robuter")
@every_robot
@pytest.mark.parametrize("sensor", FAULTS)
def test_a_sensor_that_gives_no_numbers_stops_it_and_nothing_is_raised(name: str, sensor: str, empty: World) -> None:
    with Watched(empty, name) as watched:
        if (sensor == "sonar" and not watched.bench.robot.sonars) or (
            sensor == "laser" and not watched.bench.control.needs_scan
        ):
            pytest.skip(f"the Control layer of {name} has no {sensor}")
        watched.go(2.0, Twist(0.4, 0.0))
        watched.bench.tamper = FAULTS[sensor]
        watched.go(4.0, Twist(0.4, 0.0))
        assert Cause.SENSOR in watched.causes
        assert watched.speed < 0.05


@every_robot
def test_being_carried_is_no_motion_for_the_odometer(name: str, empty: World) -> None:
    with Watched(empty, name) as watched:
        watched.go(1.0, Twist())
        before = watched.bench.control.odometry
        watched.bench.place(Pose(4.0, 0.0, 1.0))
        assert watched.bench.control.odometry == before
        watched.go(2.0, Twist())  # the odometer counts in ticks: whatever turned the wheels shows only now
        after = watched.bench.control.odometry
        assert math.hypot(after.x - before.x, after.y - before.y) < 0.01
        assert abs(after.heading - before.heading) < 0.01
        assert watched.speed < 0.03
        assert watched.touched == set()
