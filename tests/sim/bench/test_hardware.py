import math

import mujoco
import numpy as np
import pytest

from refseq_bench.robots import Actuation, Twist
from refseq_bench.robots.rolling import UnevenRolling
from refseq_bench.sim.bench.hardware import BRAKE_TORQUE, Hardware
from refseq_bench.sim.sensors.inertial import InertialModel
from refseq_bench.sim.sensors.sonar import SonarModel
from tests.robots.driving import PREFIX, Driven, add_wall, flat_world

FRONT, REAR = 0.335, -0.74
"""How far the bumpers' faces are from the axle [m]."""


def hardware_of(driven: Driven) -> Hardware:
    noise = np.random.default_rng(0)
    rolling = UnevenRolling(0.0, driven.robot.drive, noise)
    models = (SonarModel(), noise), (InertialModel(), noise)
    return Hardware(driven.model, driven.data, driven.robot, PREFIX, *models, rolling)


def pressed(driven: Driven) -> frozenset[str]:
    mujoco.mj_forward(driven.model, driven.data)
    return hardware_of(driven).signals(None).bumpers


def between_walls(ahead: float, behind: float) -> Driven:
    world = flat_world()
    add_wall(world, (ahead + 0.1, 0.0), (0.1, 2.0))
    add_wall(world, (behind - 0.1, 0.0), (0.1, 2.0))
    return Driven(world)


@pytest.mark.parametrize(
    ("x", "told"),
    [
        (0.0, set()),
        (0.0099, set()),
        (0.0101, {"front"}),
        (-0.0099, set()),
        (-0.0101, {"rear"}),
    ],
)
def test_a_bumper_is_pressed_when_its_face_is_at_the_wall_and_not_before(x: float, told: set[str]) -> None:
    driven = between_walls(FRONT + 0.01, REAR - 0.01)
    driven.place(x, 0.0, 0.0)
    assert pressed(driven) == told


def test_both_can_be_pressed_at_once() -> None:
    assert pressed(between_walls(FRONT - 0.001, REAR + 0.001)) == {"front", "rear"}


@pytest.mark.parametrize("speed", [0.1, 0.4])
def test_driving_into_a_wall_presses_the_front_bumper_there(speed: float) -> None:
    driven = between_walls(1.0, -3.0)
    hardware, places = hardware_of(driven), []
    driven.drive(1.5 / speed, lambda _: Twist(speed, 0.0), lambda: places.append(driven.pose.x))
    assert hardware.signals(None).bumpers == {"front"}
    assert max(places) == pytest.approx(1.0 - FRONT, abs=0.01)
    driven.drive(0.3 / speed, lambda _: Twist(-speed, 0.0))
    assert hardware.signals(None).bumpers == frozenset()


def test_it_is_told_at_the_first_touch() -> None:
    driven = between_walls(1.0, -3.0)
    hardware, told = hardware_of(driven), []
    driven.drive(4.0, lambda _: Twist(0.3, 0.0), lambda: told.append((driven.pose.x, hardware.signals(None).bumpers)))
    first = next(x for x, bumpers in told if bumpers)
    # Contacts are those of the last physics step's beginning: 4 ms of 0.3 m/s old, seen every 20 ms.
    assert first == pytest.approx(1.0 - FRONT, abs=0.3 * 0.024 + 0.001)


@pytest.mark.parametrize(
    ("centre", "half"),
    [
        ((-0.2, 0.365), (0.05, 0.1)),  # the shell's left side
        ((0.0, -0.45), (0.05, 0.1)),  # the right drive wheel
    ],
)
def test_what_touches_another_part_presses_no_bumper(centre: tuple[float, float], half: tuple[float, float]) -> None:
    world = flat_world()
    world.worldbody.add_geom(name="thing", type=mujoco.mjtGeom.mjGEOM_BOX, pos=(*centre, 0.3), size=(*half, 0.29))
    driven = Driven(world)
    thing = driven.model.geom("thing").id
    assert (driven.data.contact.geom == thing).any(), "it does touch"
    assert pressed(driven) == frozenset()


def test_a_board_above_the_front_bumper_meets_the_laser_and_does_not_press_it() -> None:
    world = flat_world()
    world.worldbody.add_geom(name="board", type=mujoco.mjtGeom.mjGEOM_BOX, pos=(0.42, 0.0, 0.35), size=(0.1, 0.1, 0.05))
    driven = Driven(world)
    assert (driven.data.contact.geom == driven.model.geom("board").id).any()
    assert pressed(driven) == frozenset()


def test_readings_are_those_of_the_simulation() -> None:
    driven = Driven()
    driven.drive(2.0, lambda _: Twist(0.3, 0.2))
    signals = hardware_of(driven).signals(None)
    assert signals.time == driven.data.time
    turns = np.array(driven.wheel_angles) / (2 * math.pi)
    assert signals.pulses == tuple(np.floor(turns * driven.robot.pulses_per_turn))
    forces = [driven.data.actuator(PREFIX + name).force[0] for name in driven.robot.wheel_actuators]
    assert signals.torques == tuple(forces)
    assert signals.sonar is not None
    assert signals.sonar.shape == (24,)


def test_it_moves_the_left_and_the_right_motor() -> None:
    driven = Driven()
    hardware_of(driven).apply(Actuation(1.0, -2.0))
    left, right = (driven.data.actuator(PREFIX + name).ctrl[0] for name in driven.robot.wheel_actuators)
    assert (left, right) == (1.0, -2.0)


def test_no_motor_of_one_that_brakes_turns_a_braked_wheel() -> None:
    driven = Driven()
    for name in driven.robot.wheel_actuators:
        assert driven.model.actuator(PREFIX + name).forcerange[1] < BRAKE_TORQUE


def test_brakes_hold_on_a_slope_where_free_wheels_roll_away() -> None:
    """On 5° with the motors without power: 154 kg are drawn by 132 N, 16 N·m at the axle."""
    rolled = {}
    for braked in (True, False):
        driven = Driven()
        driven.model.opt.gravity[:] = 9.81 * np.array([math.sin(math.radians(5)), 0.0, -math.cos(math.radians(5))])
        driven.model.actuator_gainprm[:, 0], driven.model.actuator_biasprm[:, 2] = 0.0, 0.0
        hardware = hardware_of(driven)
        hardware.apply(Actuation(braked=braked))
        mujoco.mj_step(driven.model, driven.data, nstep=500)
        rolled[braked] = driven.pose.x
        if braked:
            hardware.apply(Actuation())
            mujoco.mj_step(driven.model, driven.data, nstep=500)
            assert driven.pose.x > rolled[True] + 0.5, "released, they roll"
    assert abs(rolled[True]) < 0.02
    assert rolled[False] > 0.5


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
def test_a_state_that_is_no_number_is_read_without_an_error(bad: float) -> None:
    driven = Driven()
    hardware = hardware_of(driven)
    driven.data.qpos[:], driven.data.qvel[:] = bad, bad
    driven.data.site_xpos[:], driven.data.site_xmat[:] = bad, bad
    driven.data.time = 1.0
    with np.errstate(all="ignore"):
        signals = hardware.signals(None)
    assert len(signals.pulses) == 2
    assert not signals.inertial.finite or bad == 1e300
