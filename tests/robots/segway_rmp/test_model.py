"""The RMP's model against the figures it is made from, and the linear model against the simulated one."""

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.segway_rmp import PULSES_PER_TURN, WHEEL_JOINTS, get_spec
from refseq_bench.robots.segway_rmp.balance import LOADS, balancer, carrying, with_integral
from refseq_bench.robots.segway_rmp.firmware import PERIOD
from refseq_bench.robots.segway_rmp.plant import GRAVITY, Course, Plant, plant_of
from refseq_bench.robots.segway_rmp.protocol import GainSet
from tests.robots.balancing import Machine


@pytest.fixture(scope="module")
def plant() -> Plant:
    return plant_of(get_spec().compile(), WHEEL_JOINTS)


def test_it_weighs_what_the_sources_say_and_its_centre_is_where_they_say() -> None:
    model = get_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    base = model.body("base").id
    assert model.body_mass[base] == pytest.approx(80.0, abs=0.1)
    assert data.xipos[base] == pytest.approx([0.0, 0.0, 0.24 + 0.30], abs=0.005)
    for wheel in ("wheel-left", "wheel-right"):
        assert model.body_mass[model.body(wheel).id] == 5.0
        assert model.body_inertia[model.body(wheel).id] == pytest.approx([0.076, 0.144, 0.076])


def test_inertia_is_that_of_its_parts_and_less_than_the_sources() -> None:
    """24/24/8 cannot be had by 80 kg on this deck with their centre where it is (README)."""
    model = get_spec().compile()
    base = model.body("base").id
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[base])
    inertia = np.diag(turn.reshape(3, 3) @ np.diag(model.body_inertia[base]) @ turn.reshape(3, 3).T)
    assert inertia == pytest.approx([6.96, 6.75, 1.87], rel=0.01)
    assert (inertia < [24, 24, 8]).all()


def test_the_axle_is_where_the_drive_says() -> None:
    robot = robots.load("segway_rmp")
    left, right = (robot.spec.body(name).pos for name in ("wheel-left", "wheel-right"))
    assert left[1] - right[1] == pytest.approx(robot.drive.track) == 0.54
    assert left[2] == right[2] == robot.drive.wheel_radius == 0.24
    assert pytest.approx(2 * math.pi * 0.24 * 33215, abs=0.5) == PULSES_PER_TURN


def test_the_tail_carries_enough_to_brake_on_and_leaves_most_to_the_wheels() -> None:
    machine = Machine("segway_rmp-tractor").go(2.0, Twist())
    carried = {}
    for index, contact in enumerate(machine.data.contact):
        wrench = np.zeros(6)
        mujoco.mj_contactForce(machine.model, machine.data, index, wrench)
        carried[machine.model.geom(max(contact.geom)).name] = float(wrench[0])
    weight = float(machine.model.body_mass.sum()) * GRAVITY
    assert sum(carried.values()) == pytest.approx(weight, rel=2e-3)
    # What braking at 1 m/s² lifts off a support 0.5 m behind the axle by a centre 0.54 m up.
    assert carried["r/tail-caster"] > 80.0 * 1.0 * 0.54 / 0.5
    assert carried["r/tail-caster"] < 0.25 * weight


def _grows(machine: Machine, seconds: float) -> float:
    """Rate at which the pitch grows while it is between 1° and 4° [1/s]: ten times the start, so its cosh is an exp."""
    machine.go(seconds)
    track = np.array(machine.track)
    small = (np.abs(track[:, 4]) > math.radians(1.0)) & (np.abs(track[:, 4]) < math.radians(4.0))
    return float(np.polyfit(track[small, 0], np.log(np.abs(track[small, 4])), 1)[0])


def _let_go(machine: Machine, friction: float) -> None:
    """Tilt it by 0.1° with its wheels on the floor; from now on its motors give nothing."""
    dofs = [int(machine.model.joint("r/" + name).dofadr[0]) for name in WHEEL_JOINTS]
    machine.model.dof_frictionloss[dofs], machine.model.dof_damping[dofs] = friction, 0.0
    machine._hardware._friction[:] = friction
    machine.control.tick = lambda signals: robots.Actuation()
    tilted, radius = math.radians(0.1), 0.24
    joint = machine.data.joint("r/base")
    joint.qpos = (-radius * math.sin(tilted), 0, radius * (1 - math.cos(tilted)), math.cos(tilted / 2), 0, 0, 0)
    joint.qpos[5] = math.sin(tilted / 2)
    mujoco.mj_forward(machine.model, machine.data)


def test_let_go_it_falls_at_the_rate_of_the_linear_models_pole(plant: Plant) -> None:
    machine = Machine(timestep=0.001)
    _let_go(machine, friction=0.0)
    a, _ = plant.pitching()
    free = a.copy()
    free[1::2, 1::2] = 0.0  # no damping
    assert _grows(machine, 1.2) == pytest.approx(max(np.linalg.eigvals(free).real), rel=0.03)


def test_with_wheels_locked_it_rolls_over_as_one_body(plant: Plant) -> None:
    machine = Machine(timestep=0.001)
    _let_go(machine, friction=1e4)
    mass, height, radius = plant.body_mass, plant.height, plant.wheel_radius
    rolling = (mass + plant.wheel_mass) * radius**2 + plant.wheel_inertia
    inertia = rolling + 2 * mass * radius * height + plant.pitch_inertia + mass * height**2
    assert _grows(machine, 1.8) == pytest.approx(math.sqrt(mass * GRAVITY * height / inertia), rel=0.03)


def test_a_load_moves_centre_and_inertia_as_steiner_says(plant: Plant) -> None:
    loaded = plant.loaded(20.0, 1.0)
    assert loaded.body_mass == pytest.approx(100.0, abs=0.1)
    assert loaded.body_mass * loaded.height == pytest.approx(plant.body_mass * plant.height + 20.0)
    about_axle = plant.pitch_inertia + plant.body_mass * plant.height**2 + 20.0
    assert loaded.pitch_inertia + loaded.body_mass * loaded.height**2 == pytest.approx(about_axle)
    again = loaded.loaded(-20.0, 1.0)
    assert (again.height, again.pitch_inertia) == pytest.approx((plant.height, plant.pitch_inertia))


@given(rates=st.tuples(*[st.floats(-2.0, 2.0)] * 5))
@settings(max_examples=50, deadline=None)
def test_a_posture_is_what_the_linear_model_does_under_its_torque(plant: Plant, rates: tuple[float, ...]) -> None:
    """The flat output's course and its posture fulfil both lines of the model, damping left out."""
    course, flat = Course(*rates), plant.flatness()
    posture = flat.posture(course)
    a, b = plant.pitching()
    turning = flat.tilt * course.snap
    moved = a[:, 2] * posture.pitch + b[:, 0] * posture.torque
    assert moved[3] == pytest.approx(turning, abs=1e-9)
    assert moved[1] == pytest.approx(course.acceleration - flat.arm * turning, abs=1e-9)


@pytest.mark.parametrize("gain_set", GainSet)
def test_each_gain_set_balances_what_it_is_made_for(plant: Plant, gain_set: GainSet) -> None:
    system = with_integral(carrying(plant, gain_set).pitching().sampled(PERIOD), PERIOD)
    gains = balancer(plant, gain_set, PERIOD)
    assert np.abs(np.linalg.eigvals(system.a)).max() > 1.01, "it falls without"
    assert np.abs(np.linalg.eigvals(system.a - system.b @ gains[None])).max() < 0.999


def test_gain_sets_differ_in_load_and_gains(plant: Plant) -> None:
    assert len({balancer(plant, gain_set, PERIOD).tobytes() for gain_set in GainSet}) == len(LOADS) == 3


SLALOM_END: dict[float, tuple[float, float, float]] = {}


def slalom(timestep: float) -> tuple[float, float, float]:
    if timestep not in SLALOM_END:
        machine = Machine(timestep=timestep)
        machine.go(20.0, lambda time: Twist(1.0, 0.4 * math.sin(time)))
        machine.go(3.0, Twist())
        SLALOM_END[timestep] = (*machine.axle[:2], machine.turned)
    return SLALOM_END[timestep]


@pytest.mark.quick_cases("0.002-0.02")
@pytest.mark.parametrize(("timestep", "apart"), [(0.001, 0.01), (0.002, 0.02), (0.0025, 0.03)])
def test_where_a_drive_of_20_m_ends_hardly_depends_on_the_time_step(timestep: float, apart: float) -> None:
    fine, coarse = slalom(0.0005), slalom(timestep)
    assert math.dist(fine[:2], coarse[:2]) < apart
    assert fine[2] == pytest.approx(coarse[2], abs=apart / 10)
