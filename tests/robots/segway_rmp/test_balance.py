"""The RMP balancing: it stands, is pushed, leans as physics asks, and goes back before it goes forward."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq_bench.robots import Cause, Signals, Twist
from refseq_bench.robots.segway_rmp.plant import GRAVITY, plant_of
from refseq_bench.sim.sensors.inertial import InertialModel
from tests.robots.balancing import Machine

STAND = Twist()


@pytest.mark.slow
def test_it_holds_its_place_for_a_minute_with_noise_and_bias() -> None:
    track = Machine(inertial=InertialModel(), seed=1).go(60.0, STAND).since(0.0)
    assert np.abs(track[:, 1:3]).max() < 0.02
    assert np.abs(track[:, 5]).max() < math.radians(1)


@pytest.mark.quick_cases("1.0")
@pytest.mark.parametrize("zero", [-1.0, 1.0])
def test_a_wrong_pitch_zero_makes_it_neither_lean_nor_creep(zero: float) -> None:
    machine = Machine()

    def tamper(signals: Signals) -> Signals:
        inertial = signals.inertial
        return replace(signals, inertial=inertial._replace(pitch=inertial.pitch + math.radians(zero)))

    machine.tamper = tamper
    track = machine.go(20.0, STAND).since(15.0)
    assert np.abs(track[:, 1]).max() < 0.02
    assert np.abs(track[:, 4]).max() < math.radians(0.3)


def test_a_load_off_the_centre_is_leant_against() -> None:
    """8 kg put 0.1 m ahead of the axle, 0.76 m over it: the centre of all is over the axle again."""

    def load(spec: mujoco.MjSpec) -> None:
        spec.body("base").add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05,) * 3, pos=(0.1, 0, 1.0), mass=8.0, contype=0, conaffinity=0
        )

    machine = Machine(change=load)
    track = machine.go(20.0, STAND).since(15.0)
    base = machine.data.body("r/base")
    assert np.abs(track[:, 1]).max() < 0.02
    assert track[-1, 4] < math.radians(-1)
    assert float(base.xipos[0]) == pytest.approx(machine.axle[0], abs=2e-3)


@pytest.mark.quick_cases("-250.0-0.2")
@pytest.mark.parametrize(("force", "seconds"), [(250.0, 0.2), (-250.0, 0.2), (500.0, 0.1), (100.0, 0.5)])
def test_a_push_of_50_newton_seconds_on_its_mast_does_not_fell_it(force: float, seconds: float) -> None:
    machine = Machine(inertial=InertialModel()).go(3.0, STAND)
    machine.push = force, 0.0, 0.0
    machine.go(seconds, STAND)
    machine.push = 0.0, 0.0, 0.0
    machine.go(10.0, STAND)
    pushed = machine.since(3.0)
    assert np.abs(pushed[:, 4]).max() < math.radians(30)
    assert np.abs(pushed[:, 1]).max() > 0.5, "it was a push"
    assert machine.control.state.free
    assert np.abs(machine.since(machine.data.time - 1.0)[:, 1]).max() < 0.02


def test_a_push_that_is_too_hard_fells_it_and_it_says_so() -> None:
    machine = Machine().go(1.0, STAND)
    machine.push = 1000.0, 0.0, 0.0
    machine.go(0.2, STAND)
    machine.push = 0.0, 0.0, 0.0
    machine.go(3.0, STAND)
    assert Cause.TIPPED in machine.causes
    assert machine.control.state.mode == "disabled"


def leaning(machine: Machine, acceleration: float) -> float:
    """Pitch at which gravity holds the moment of a steady acceleration, about the contact on the floor [rad]."""
    plant = plant_of(machine.model, ("r/wheel-left", "r/wheel-right"))
    mass, height, radius = plant.body_mass, plant.height, plant.wheel_radius
    spinning = (plant.wheel_inertia + plant.rotor_inertia) / radius
    low, high = 0.0, 1.0
    while high - low > 1e-6:
        pitch = (low + high) / 2
        held = mass * GRAVITY * height * math.sin(pitch)
        needed = acceleration * (mass * (radius + height * math.cos(pitch)) + plant.wheel_mass * radius + spinning)
        low, high = (pitch, high) if held < needed else (low, pitch)
    return low


def test_it_leans_as_its_acceleration_asks() -> None:
    machine = Machine().go(2.0, STAND).go(6.0, Twist(1.0, 0.0))
    speeding = machine.since(3.0)[:70]  # between the smoothed ends of a ramp of 2 s
    gained = (speeding[-1, 3] - speeding[0, 3]) / (speeding[-1, 0] - speeding[0, 0])
    assert gained == pytest.approx(0.5, rel=0.03)
    assert speeding[:, 4].mean() == pytest.approx(leaning(machine, gained), rel=0.03)
    machine.control.emergency_stop()
    machine.go(0.95, STAND)
    braking = machine.since(machine.data.time - 0.2)
    lost = (braking[0, 3] - braking[-1, 3]) / (braking[-1, 0] - braking[0, 0])
    assert lost == pytest.approx(1.0, rel=0.05)
    assert -braking[:, 4].mean() == pytest.approx(leaning(machine, lost), rel=0.05)


def test_wheels_go_back_first_as_far_as_the_linear_model_says() -> None:
    """The torques that the machine gave are given to the linear model, which does the same."""

    def smooth(spec: mujoco.MjSpec) -> None:
        for name in ("wheel-left", "wheel-right"):
            spec.joint(name).frictionloss = 0.0

    machine = Machine(change=smooth).go(2.0, STAND)
    plant = plant_of(machine.model, ("r/wheel-left", "r/wheel-right"))
    system = plant.pitching().sampled(0.01)
    state = np.array([machine.axle[0], machine.speed, machine.pitch, float(machine.data.joint("r/base").qvel[4])])
    start, least = state[0], 0.0
    for _ in range(60):
        machine.go(0.01, Twist(1.0, 0.0))
        torque = sum(float(machine.data.actuator("r/" + name).ctrl[0]) for name in machine.robot.wheel_actuators)
        state = system.a @ state + system.b[:, 0] * torque
        least = min(least, state[0] - start)
    truth = machine.since(2.0)[:, 1].min() - start
    assert truth < -0.02
    assert least == pytest.approx(truth, rel=0.1)


def test_then_it_is_faster_than_asked_before_it_goes_as_asked() -> None:
    speeds = Machine().go(8.0, Twist(1.0, 0.0)).since(0.0)[:, 3]
    assert 1.05 < speeds.max() < 1.3
    assert speeds[-100:] == pytest.approx(1.0, abs=0.02)


def _rest(seconds: float) -> tuple[float, float]:
    machine = Machine().go(10.0, STAND)
    energies = []
    for _ in range(round(seconds)):
        machine.go(1.0, STAND)
        energies.append(float(machine.data.energy.sum()))
    half = len(energies) // 2
    return float(np.mean(energies[:half])), float(np.mean(energies[half:]))


def test_at_rest_its_energy_does_not_grow() -> None:
    before, after = _rest(30.0)
    assert after <= before + 0.02


@pytest.mark.slow
def test_at_rest_its_energy_does_not_grow_for_ten_minutes() -> None:
    before, after = _rest(600.0)
    assert after <= before + 0.02
