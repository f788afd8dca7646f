"""The RMP when something is wrong: sensors without numbers, falls, wheels that jam, a place too far off."""

import math
from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from refseq_bench import robots
from refseq_bench.robots import Cause, Signals, Twist
from refseq_bench.robots.odometry import Pulses, true_geometry
from refseq_bench.robots.segway_rmp import DRIVE, LIMITS, MOUNTING, SHAPE, build
from refseq_bench.robots.segway_rmp.balance import balancer
from refseq_bench.robots.segway_rmp.control import MARGIN, SegwayControl
from refseq_bench.robots.segway_rmp.firmware import PERIOD, POSITION_ERROR, SegwayFirmware
from refseq_bench.robots.segway_rmp.protocol import Config, GainSet, Mode, SegwayCommand, StatusBits, StatusFrame
from refseq_bench.robots.segway_rmp.sensors import LOST_AFTER
from refseq_bench.robots.signals import Inertial
from refseq_bench.sim.sensors.inertial import InertialModel
from tests.robots.balancing import Machine

STAND = Twist()
NAN = math.nan

WITHOUT: dict[str, Callable[[Signals], Signals]] = {
    "pitch": lambda signals: replace(signals, inertial=signals.inertial._replace(pitch=NAN)),
    "all inertial": lambda signals: replace(signals, inertial=Inertial(NAN, NAN, NAN, NAN)),
    "huge": lambda signals: replace(signals, inertial=signals.inertial._replace(pitch_rate=1e300)),
    "left encoder": lambda signals: replace(signals, pulses=Pulses(NAN, signals.pulses.right)),
    "right encoder": lambda signals: replace(signals, pulses=Pulses(signals.pulses.left, NAN)),
    "encoders": lambda signals: replace(signals, pulses=Pulses(NAN, NAN)),
    "jump": lambda signals: replace(signals, pulses=Pulses(signals.pulses.left + 50000, signals.pulses.right)),
}


def now_and_then(fault: Callable[[Signals], Signals], lasting: int) -> Callable[[Signals], Signals]:
    """``fault`` in ``lasting`` ticks of every twenty."""
    return lambda signals: fault(signals) if round(signals.time / PERIOD) % 20 < lasting else signals


@pytest.mark.quick_cases("encoders")
@pytest.mark.parametrize("sensor", WITHOUT)
def test_readings_that_fail_now_and_then_do_not_matter(sensor: str) -> None:
    machine = Machine(inertial=InertialModel(), seed=3).go(3.0, STAND)
    machine.tamper = now_and_then(WITHOUT[sensor], LOST_AFTER - 1)
    standing = machine.go(5.0, STAND).since(3.0)
    assert np.abs(standing[:, 1]).max() < 0.02
    going = machine.go(6.0, Twist(0.5, 0.0)).since(12.0)
    assert going[:, 3] == pytest.approx(0.5, abs=0.05)
    assert machine.control.state.free


@pytest.mark.quick_cases("pitch")
@pytest.mark.parametrize("sensor", WITHOUT)
def test_a_sensor_that_is_lost_stops_it_on_its_wheels(sensor: str) -> None:
    """It brakes and goes on balancing on what is left; without any encoder it cannot tell how fast it creeps."""
    machine = Machine(inertial=InertialModel(), seed=3).go(5.0, Twist(1.0, 0.0))
    machine.tamper = WITHOUT[sensor]
    way = machine.go(9.0, Twist(1.0, 0.0)).since(5.0)
    assert Cause.SENSOR in machine.causes
    assert machine.control.state.mode == "balance"
    assert np.abs(way[:, 4]).max() < math.radians(20)
    assert way[-1, 1] - way[0, 1] < (2.5 if sensor == "encoders" else 1.0)
    assert np.ptp(way[-300:, 1]) < (0.5 if sensor == "encoders" else 0.1)
    machine.tamper = lambda signals: signals
    machine.go(1.0, STAND)
    assert Cause.SENSOR in machine.causes, "it holds until somebody releases it"
    machine.control.release()
    machine.go(4.0, Twist(0.5, 0.0))
    assert machine.control.state.free
    assert machine.speed == pytest.approx(0.5, abs=0.05)


def test_without_encoders_it_gives_up_after_ten_seconds() -> None:
    machine = Machine(inertial=InertialModel(), seed=3).go(2.0, STAND)
    machine.tamper = WITHOUT["encoders"]
    assert machine.go(9.5, STAND).control.state.mode == "balance"
    assert machine.go(1.0, STAND).control.state.mode == "disabled"


def test_without_both_kinds_of_sensors_its_motors_rest() -> None:
    machine = Machine().go(2.0, STAND)
    machine.tamper = lambda signals: WITHOUT["encoders"](WITHOUT["pitch"](signals))
    machine.go(1.0, STAND)
    assert machine.control.state.mode == "disabled"
    assert machine.control.state.motors is robots.Motors.OFF
    assert [float(machine.data.actuator("r/" + name).ctrl[0]) for name in machine.robot.wheel_actuators] == [0, 0]


def fed(firmware: SegwayFirmware, time: float, **inertial: float) -> StatusFrame:
    firmware.tick(Signals(time=time, pulses=Pulses(0, 0), inertial=Inertial(**inertial)))
    return firmware.status


@pytest.mark.parametrize(
    ("reading", "limit", "word"), [("pitch", 45.0, StatusBits.PITCH_LIMIT), ("roll", 60.0, StatusBits.ROLL_LIMIT)]
)
@pytest.mark.parametrize("side", [1, -1])
def test_its_power_goes_off_beyond_its_limits_and_not_before(
    reading: str, limit: float, word: StatusBits, side: int
) -> None:
    status = fed(SegwayFirmware(build(tail=False)), 0.0, **{reading: side * math.radians(limit - 0.1)})
    assert status.mode is Mode.BALANCE
    assert StatusBits.MOTORS_ENABLED in status.words
    status = fed(SegwayFirmware(build(tail=False)), 0.0, **{reading: side * math.radians(limit + 0.1)})
    assert status.mode is Mode.DISABLED
    assert word in status.words
    assert StatusBits.MOTORS_ENABLED not in status.words
    assert (status.left_torque, status.right_torque) == (0, 0)


def test_one_that_fell_stays_off_until_it_is_set_up_and_released() -> None:
    machine = Machine().go(1.0, STAND)
    machine.push = 1000.0, 0.0, 0.0
    machine.go(0.2, STAND)
    machine.push = 0.0, 0.0, 0.0
    machine.go(3.0, STAND)
    machine.control.release()
    machine.go(0.2, STAND)
    assert Cause.TIPPED in machine.causes, "it lies there still"
    machine.data.joint("r/base").qpos[2:] = (0.0, 1.0, 0.0, 0.0, 0.0)
    machine.data.qvel[:] = 0.0
    mujoco.mj_forward(machine.model, machine.data)
    machine.control.rest()
    machine.control.release()
    machine.go(6.0, Twist(0.5, 0.0))
    assert machine.control.state.free
    assert machine.speed == pytest.approx(0.5, abs=0.05)


def bodiless(*, tail: bool) -> SegwayControl:
    """The Control layer of a machine whose signals a test makes up."""
    return SegwayControl(build(tail=tail), LIMITS, SHAPE, MOUNTING, true_geometry(DRIVE))


@pytest.mark.parametrize("ticks", range(20, 24))
@pytest.mark.parametrize("fault", [Inertial(pitch=math.radians(70)), Inertial(roll=math.radians(70)), Inertial(NAN)])
def test_a_release_works_in_every_tick(fault: Inertial, ticks: int) -> None:
    """Commands go down every second tick: until then the machine tells of what it is about to forget."""
    control, time = bodiless(tail=False), 0.0
    for inertial in [Inertial()] * 20 + [fault] * 20 + [Inertial()] * ticks:
        time += PERIOD
        control.command(STAND)
        control.tick(Signals(time=time, pulses=Pulses(0, 0), inertial=inertial))
    assert not control.state.free, "it holds until somebody releases it"
    control.release()
    for _ in range(6):
        time += PERIOD
        control.tick(Signals(time=time, pulses=Pulses(0, 0)))
        assert control.state.free
    assert control.state.mode == "balance"


@pytest.mark.parametrize("ticks", [20, 21])
def test_a_release_of_what_still_lies_there_does_not_help(ticks: int) -> None:
    control, time = bodiless(tail=False), 0.0
    for _ in range(ticks):
        time += PERIOD
        control.release()
        control.tick(Signals(time=time, pulses=Pulses(0, 0), inertial=Inertial(pitch=math.radians(70))))
    control.tick(Signals(time=time + PERIOD, pulses=Pulses(0, 0), inertial=Inertial(pitch=math.radians(70))))
    assert Cause.TIPPED in {stop.cause for stop in control.state.stops}


def test_released_after_a_fall_it_has_forgotten_what_it_leaned_against() -> None:
    """A long push sums up errors of place, and the lean against it; nobody tells the machine that it was set up."""
    machine = Machine(inertial=InertialModel()).go(2.0, STAND)
    machine.push = -25.0, 0.0, 0.0
    machine.go(20.0, STAND)
    assert machine.pitch > math.radians(5), "it leans against the push"
    machine.push = -400.0, 0.0, 0.0
    machine.go(0.6, STAND)
    machine.push = 0.0, 0.0, 0.0
    machine.go(2.0, STAND)
    assert machine.causes == {Cause.TIPPED}
    for _ in range(200):  # it is held upright for 2 s, in which its estimate of the pitch comes after
        machine.data.joint("r/base").qpos[2:] = (0.0, 1.0, 0.0, 0.0, 0.0)
        machine.data.qvel[:] = 0.0
        mujoco.mj_forward(machine.model, machine.data)
        machine.go(PERIOD, STAND)
    released, place = machine.data.time, machine.axle[0]
    machine.control.release()
    way = machine.go(6.0, STAND).since(released)
    assert machine.control.state.free
    assert np.abs(way[:, 4]).max() < math.radians(4)
    assert np.abs(way[:, 1] - place).max() < 0.08


def test_twelve_feet_off_its_place_it_goes_into_tractor_mode() -> None:
    firmware = SegwayFirmware(build(tail=False))
    place, time = 0.0, 0.0
    while firmware.status.mode is not Mode.TRACTOR and time < 30.0:
        time += PERIOD
        place += 1.0 * PERIOD  # carried away at 1 m/s, upright
        pulses = Pulses(*[place / 0.24 / (2 * math.pi) * build(tail=False).pulses_per_turn] * 2)
        firmware.receive(SegwayCommand(), time)
        firmware.tick(Signals(time=time, pulses=pulses))
    assert place == pytest.approx(12 * 0.3048, abs=0.15)
    assert POSITION_ERROR == 12 * 0.3048
    assert StatusBits.POSITION_ERROR in firmware.status.words


def test_gain_sets_are_latched_until_it_begins_to_balance_again() -> None:
    plain = build(tail=False)
    firmware = SegwayFirmware(plain)

    def told(config: Config, parameter: int) -> StatusFrame:
        firmware.receive(SegwayCommand(0, 0, config, parameter), 0.0)
        return fed(firmware, 0.0)

    assert told(Config.GAIN_SET, GainSet.HEAVY).gain_set is GainSet.TALL
    assert firmware._balancing == pytest.approx(balancer(plain.plant, GainSet.TALL, PERIOD))
    assert told(Config.MODE, Mode.BALANCE).gain_set is GainSet.TALL, "it was balancing already"
    assert told(Config.MODE, Mode.TRACTOR).mode is Mode.TRACTOR
    assert told(Config.MODE, Mode.BALANCE).gain_set is GainSet.HEAVY
    assert firmware._balancing == pytest.approx(balancer(plain.plant, GainSet.HEAVY, PERIOD))


def test_the_gains_for_a_heavy_machine_balance_one() -> None:
    def load(spec: mujoco.MjSpec) -> None:
        spec.body("base").add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.1,) * 3, pos=(0, 0, 0.54), mass=45.0, contype=0, conaffinity=0
        )

    machine = Machine(change=load)
    heavy = replace(build(tail=False), gain_set=GainSet.HEAVY)
    machine.control = SegwayControl(heavy, LIMITS, SHAPE, MOUNTING, true_geometry(machine.robot.drive))
    track = machine.go(4.0, STAND).go(6.0, Twist(1.0, 0.0)).go(6.0, STAND).since(0.0)
    assert np.abs(track[:, 4]).max() < math.radians(10)
    assert abs(machine.speed) < 0.02


def test_a_jammed_wheel_is_told_before_the_machine_falls() -> None:
    machine = Machine(inertial=InertialModel()).go(2.0, STAND)
    machine.model.dof_damping[int(machine.model.joint("r/wheel-right").dofadr[0])] = 1e5
    machine.go(3.0, Twist(0.5, 0.0))
    assert Cause.STUCK in machine.causes
    assert "right wheel" in machine.control.state.stops[0].detail
    assert np.abs(machine.since(0.0)[:, 4]).max() < math.radians(15)


def test_held_back_by_a_wall_it_gives_up_and_stands() -> None:
    """No laser turns here: it runs against the wall, leans on it, tells so, and comes upright again."""
    machine = Machine(inertial=InertialModel(), boxes=(((2.4, 0.0, 1.0), (0.1, 1.0, 1.0)),)).go(3.0, Twist(1.0, 0.0))
    for _ in range(50):
        machine.go(0.1, Twist(1.0, 0.0))
        assert abs(machine.control._firmware._known.zero) <= math.radians(2.01), "leaning is not upright"
    assert machine.causes == {Cause.STUCK}
    assert "told to go" in machine.control.state.stops[0].detail
    machine.go(3.0, Twist(1.0, 0.0))
    assert machine.control.state.mode == "balance"
    assert abs(machine.pitch) < math.radians(2)
    assert machine.axle[0] < 2.3 - MARGIN


def against_an_edge() -> Machine:
    """The machine on its tail, stuck at an edge as high as its deck; nothing sways there: no wheel turns by itself."""
    edge = ((2.4, 0.0, 0.49), (0.1, 1.0, 0.05))
    machine = Machine("segway_rmp-tractor", inertial=InertialModel(), boxes=(edge,)).go(8.0, Twist(0.8, 0.0))
    assert machine.causes == {Cause.STUCK}
    return machine


def test_stuck_on_its_tail_it_drives_back_once_released() -> None:
    machine = against_an_edge()
    stood = machine.axle[0]
    machine.go(2.0, Twist(-0.3, 0.0))
    assert Cause.STUCK in machine.causes, "it holds until somebody releases it"
    assert machine.axle[0] == pytest.approx(stood, abs=0.01)
    machine.control.release()
    machine.go(3.0, Twist(-0.3, 0.0))
    assert machine.control.state.free
    assert stood - machine.axle[0] > 0.5


def test_stuck_on_its_tail_it_is_stuck_again_where_nothing_was_taken_away() -> None:
    machine = against_an_edge()
    machine.control.release()
    machine.go(3.0, Twist(0.8, 0.0))
    assert Cause.STUCK in machine.causes


def test_a_push_before_it_was_set_down_does_not_count() -> None:
    control, time = bodiless(tail=True), 0.0

    def pushed() -> bool:
        """8 ticks at 60 N·m, most of the impulse that a jammed wheel takes."""
        nonlocal time
        for _ in range(8):
            time += PERIOD
            control.command(STAND)
            control.tick(Signals(time=time, pulses=Pulses(0, 0), torques=(60.0, 60.0)))
        return any(stop.cause is Cause.STUCK for stop in control.state.stops)

    assert not pushed()
    control.rest()
    assert not pushed()
    assert pushed(), "both together are a jam"


def test_set_down_elsewhere_it_stands_there_and_its_odometer_has_not_noticed() -> None:
    machine = Machine(inertial=InertialModel()).go(4.0, Twist(1.0, 0.0))
    before = machine.control.odometry
    machine.data.joint("r/base").qpos = (7.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    machine.data.qvel[:] = 0.0
    mujoco.mj_forward(machine.model, machine.data)
    machine.control.rest()
    assert machine.control.odometry == before
    machine.go(3.0, STAND)
    assert math.dist(machine.axle[:2], (7.0, 1.0)) < 0.05
    assert abs(machine.speed) < 0.02


def test_status_frames_of_a_drive_can_be_sent() -> None:
    machine = Machine(inertial=InertialModel())
    for _ in range(50):
        machine.go(0.1, Twist(1.0, 0.3))
        status = machine.control.status
        assert StatusFrame.decode(status.encode()) == status
    assert status.forward / 33215 == pytest.approx(machine.control.state.distance, abs=0.01)
    assert status.yaw / 112644 * 2 * math.pi == pytest.approx(machine.control.odometry.heading, abs=0.01)
    assert true_geometry(machine.robot.drive).track == 0.54
