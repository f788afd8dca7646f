"""The program on the robot's computer and its line to the robot, without physics: the wheels turn as they are told."""

import math

import numpy as np
import pytest

from refseq_bench.robots import Cause, Motors, Signals, Twist
from refseq_bench.robots.odometry import Geometry, Pulses, true_geometry
from refseq_bench.robots.robuter import DRIVE, LIMITS, PULSES_PER_TURN
from refseq_bench.robots.robuter.control import COMMAND_PERIOD, PATIENCE, STATE_PERIOD, RobuterControl
from refseq_bench.robots.robuter.regulator import SERVO_LAG
from refseq_bench.robots.robuter.sonars import FRONT_SONARS
from tests.robots.rolling import Wheels

PERIOD = RobuterControl.period


class Desk:
    """A control layer on wheels without mass, and all that passes over its line."""

    def __init__(self, believed: Geometry | None = None) -> None:
        believed = believed or true_geometry(DRIVE)
        self.control = RobuterControl(DRIVE, LIMITS, PULSES_PER_TURN, FRONT_SONARS, believed)
        self.time, self.wheels = 0.0, Wheels()
        self.sent: list[tuple[float, str]] = []
        self.heard: list[tuple[float, str]] = []
        self.cut = False
        self._tap(self.control.line.to_robot, self.sent)
        self._tap(self.control.line.to_host, self.heard)

    def _tap(self, wire: object, notes: list[tuple[float, str]]) -> None:
        put = wire.put  # type: ignore[attr-defined]

        def noted(data: bytes) -> None:
            if not self.cut:
                notes.extend((self.time, line) for line in data.decode("latin-1").splitlines())
                put(data)

        wire.put = noted  # type: ignore[attr-defined]

    def run(self, seconds: float, twist: Twist | None = None) -> None:
        """Let time pass; under a command it is given at every other tick, as a bench does."""
        for tick in range(round(seconds / PERIOD)):
            if twist is not None and tick % 2 == 0:
                self.control.command(twist)
            signals = Signals(self.time, self.wheels.pulses, sonar=np.full(24, 5.0))
            self.wheels.roll(self.control.tick(signals))
            self.time += PERIOD

    def times(self, verb: str, notes: list[tuple[float, str]] | None = None) -> np.ndarray:
        return np.array([time for time, line in (self.sent if notes is None else notes) if line.split()[0] == verb])

    @property
    def causes(self) -> set[Cause]:
        return {stop.cause for stop in self.control.state.stops}


@pytest.fixture
def desk() -> Desk:
    return Desk()


def test_commands_go_at_five_hertz_each_acknowledged_and_states_come_at_ten(desk: Desk) -> None:
    desk.run(20.0, Twist(0.3, 0.1))
    commands, acks = desk.times("AM"), desk.times("ack", desk.heard)
    assert len(commands) == len(acks) == 100
    assert np.diff(commands) == pytest.approx(COMMAND_PERIOD)
    assert acks.tolist() == commands.tolist()
    asked, told = desk.times("ST"), desk.times("st", desk.heard)
    assert len(asked) == len(told) == 200
    assert np.diff(asked) == pytest.approx(STATE_PERIOD)
    assert not desk.times("nak", desk.heard).size


def test_the_words_of_the_table(desk: Desk) -> None:
    for twist in (Twist(0.4, 0.0), Twist(0.25, 0.2), Twist(-0.2, 0.0), Twist()):
        desk.run(0.4, twist)
    desk.control.emergency_stop()
    desk.run(PERIOD)
    desk.control.release()
    desk.run(PERIOD)
    said = [line for _, line in desk.sent if line != "ST"]
    assert said == [
        *["AM 400 400"] * 2,
        *["AM 188 312"] * 2,
        *["AM -200 -200"] * 2,
        *["AM 0 0"] * 2,
        "AM 0 0",
        "SERV OFF",
        "SERV ON",
    ]


def test_what_goes_over_the_line_is_velocity_limited(desk: Desk) -> None:
    desk.run(1.0, Twist(5.0, 1.0))
    assert desk.sent[0][1] == "AM 469 531"  # 0.5 m/s and 0.1 rad/s, on the same arc


def test_a_command_on_an_idle_line_goes_at_the_next_tick_and_the_rate_still_holds(desk: Desk) -> None:
    desk.run(1.06)
    desk.control.command(Twist(0.1, 0.0))
    desk.run(0.06)
    desk.control.command(Twist(0.2, 0.0))
    desk.control.command(Twist(0.3, 0.0))
    desk.run(0.6)
    assert [(round(time, 2), line) for time, line in desk.sent if line != "ST"] == [
        (1.06, "AM 100 100"),
        (1.26, "AM 300 300"),
    ]


def test_when_those_above_fall_silent_so_does_the_line_and_the_robot_stops(desk: Desk) -> None:
    desk.run(3.0, Twist(0.4, 0.0))
    silent = desk.time
    desk.run(0.7)
    assert desk.times("AM").max() < silent + COMMAND_PERIOD
    assert desk.causes == {Cause.NO_COMMAND}
    desk.run(2.0)
    assert desk.control.state.twist == Twist()
    desk.run(1.0, Twist(0.4, 0.0))
    assert desk.control.state.free


def test_an_emergency_stop_waits_for_no_rate(desk: Desk) -> None:
    desk.run(2.04, Twist(0.4, 0.0))
    told = desk.time
    desk.control.emergency_stop()
    desk.run(PERIOD)
    assert desk.times("SERV") == pytest.approx([told])
    assert desk.times("AM")[-1] == pytest.approx(told)
    desk.run(0.2, Twist(0.4, 0.0))
    assert desk.causes == {Cause.EMERGENCY}
    assert desk.control.state.motors is Motors.LOCKED


def test_a_robot_that_does_not_answer_is_told_and_not_moved(desk: Desk) -> None:
    desk.run(2.0, Twist(0.4, 0.0))
    put = desk.control.line.to_host.put
    desk.control.line.to_host.put = lambda data: None  # it hears, but it cannot be heard
    desk.run(PATIENCE * COMMAND_PERIOD - PERIOD, Twist(0.4, 0.0))
    desk.run(2 * PERIOD, Twist(0.4, 0.0))
    assert Cause.NO_ANSWER in desk.causes
    (stop,) = desk.control.state.stops
    assert "\n" not in stop.detail
    desk.run(1.5, Twist(0.4, 0.0))
    assert desk.sent[-1][1] in ("AM 0 0", "ST")
    before = desk.wheels.angles.copy()
    desk.run(0.5, Twist(0.4, 0.0))
    np.testing.assert_allclose(desk.wheels.angles, before, atol=1e-5)
    desk.control.line.to_host.put = put
    desk.run(1.5, Twist(0.4, 0.0))
    assert desk.control.state.free
    assert desk.control.state.twist.linear == pytest.approx(0.4, abs=0.002)


def test_when_the_line_is_cut_the_robot_stops_by_itself_and_the_host_tells(desk: Desk) -> None:
    desk.run(2.0, Twist(0.4, 0.0))
    desk.cut = True
    desk.run(2.0, Twist(0.4, 0.0))
    before = desk.wheels.angles.copy()
    desk.run(0.5, Twist(0.4, 0.0))
    np.testing.assert_allclose(desk.wheels.angles, before, atol=1e-5)
    assert Cause.NO_ANSWER in desk.causes
    desk.cut = False
    desk.run(2.0, Twist(0.4, 0.0))
    assert desk.control.state.free


def test_noise_on_the_line_is_not_believed(desk: Desk) -> None:
    desk.run(1.02, Twist(0.3, 0.0))
    before = desk.control.state
    # Among it a state of which the provisions were lost.
    desk.control.line.to_host.put(b"\xff\x00\nst 0 0 0 0 0 ON - 3 -\nem what\nAM 1 1\nst 1\n")
    desk.run(PERIOD)  # in this one the robot is not asked
    assert desk.control.state is before
    desk.run(1.0, Twist(0.3, 0.0))
    assert desk.control.state.free
    assert desk.control.state.time > before.time


def test_the_state_is_what_the_robot_measured(desk: Desk) -> None:
    desk.run(4.01, Twist(0.3, 0.2))
    state = desk.control.state
    assert desk.time - state.time <= STATE_PERIOD + 1e-9
    assert (state.twist.linear, state.twist.angular) == pytest.approx((0.3, 0.2), abs=0.005)
    assert state.sonar == pytest.approx(np.full(24, 5.0))
    assert state.motors is Motors.ON
    assert state.distance == pytest.approx(0.3 * (state.time - 0.3 - SERVO_LAG), abs=0.005)


def test_the_odometer_is_of_this_tick_and_of_the_believed_geometry() -> None:
    desk = Desk(Geometry(0.12 * 1.01, 0.12 * 1.01, 0.62))
    desk.run(5.0, Twist(0.4, 0.0))
    desk.run(PERIOD)  # the counters of the last tick are read in this one
    rolled = float(desk.wheels.angles.mean()) * 0.12
    assert desk.control.odometry.x == pytest.approx(1.01 * rolled, abs=0.4 * PERIOD + 1e-3)
    assert desk.control.state.pose.x == pytest.approx(1.01 * rolled, abs=0.4 * (STATE_PERIOD + PERIOD) + 1e-3)


def test_counters_that_are_no_numbers_leave_the_odometer_where_it_is(desk: Desk) -> None:
    desk.run(2.0, Twist(0.4, 0.0))
    before = desk.control.odometry
    for _ in range(10):
        desk.control.tick(Signals(desk.time, Pulses(math.nan, 5)))
        desk.time += PERIOD
    assert desk.control.odometry == before
    assert math.isfinite(desk.control.state.pose.x)
    assert desk.causes == {Cause.SENSOR}
