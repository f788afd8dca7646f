"""The processor alone: bytes and readings in, bytes and motor speeds out; its wheels turn as a test says."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq_bench.robots import Actuation, Cause, Inertial, Signals, Twist
from refseq_bench.robots.odometry import Pulses
from refseq_bench.robots.robuter import DRIVE, LIMITS, PULSES_PER_TURN
from refseq_bench.robots.robuter.firmware import HOLD, PERIOD, RobuterFirmware
from refseq_bench.robots.robuter.line import CAPACITY, SerialLine
from refseq_bench.robots.robuter.protocol import ProtocolError, Report, Servo, parse_line
from refseq_bench.robots.robuter.regulator import SERVO_LAG
from refseq_bench.robots.robuter.sonars import FRONT_SONARS, SONARS
from refseq_bench.robots.robuter.watches import HYSTERESIS, MARGIN, REACTION, ROUND, SonarWatch
from tests.robots.rolling import Wheels

FREE = np.full(len(SONARS), 10.668)


class Rig:
    """A firmware on wheels without mass."""

    def __init__(self) -> None:
        self.lines = [SerialLine(), SerialLine()]
        self.firmware = RobuterFirmware(DRIVE, LIMITS, PULSES_PER_TURN, FRONT_SONARS, self.lines)
        self.wheels = Wheels()
        self.done = Actuation()
        self.time = 0.0
        self.readings: Callable[[Signals], Signals] = lambda signals: signals
        self.track: list[Twist] = []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD)):
            signals = Signals(self.time, self.wheels.pulses, sonar=FREE)
            self.done = self.firmware.tick(self.readings(signals))
            self.wheels.roll(self.done)
            self.time += PERIOD
            self.track.append(self.motion)

    def drive(self, seconds: float, command: str) -> None:
        """Repeat a command at 5 Hz."""
        for _ in range(round(seconds / 0.2)):
            self.say(command + "\n")
            self.run(0.2)

    def say(self, text: str, line: int = 0) -> None:
        self.lines[line].to_robot.put(text.encode("latin-1"))

    def hear(self, line: int = 0) -> list[str]:
        return self.lines[line].to_host.take().decode("ascii").splitlines()

    def ask(self, text: str, line: int = 0) -> list[str]:
        self.hear(line)
        self.say(text + "\n", line)
        self.run(PERIOD)
        return self.hear(line)

    @property
    def motion(self) -> Twist:
        radius = DRIVE.wheel_radius
        left, right = self.done.left * radius, self.done.right * radius
        return Twist((left + right) / 2, (right - left) / DRIVE.track)

    @property
    def way(self) -> float:
        """How far the middle of the axle has come [m]."""
        return float(self.wheels.angles.mean()) * DRIVE.wheel_radius


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_a_transcript(rig: Rig) -> None:
    assert rig.ask("AM 0 0") == ["ack"]
    assert rig.ask("AM 5") == ["nak AM takes 2 values, not 1"]
    assert rig.ask("ack") == ["nak a reply, not a command: valid are AM, SERV ON, SERV OFF, ST"]
    assert rig.ask("SERV OFF") == ["ack"]
    em, state = rig.ask("ST")
    assert em == "em emergency-stop 60 all servo off"
    assert state == "st 80 0 0 0 0 OFF - 1 " + ",".join(["10668"] * 24)
    assert rig.ask("SERV ON\r") == ["ack"]
    assert rig.ask("ST") == ["st 120 0 0 0 0 ON - 0 " + ",".join(["10668"] * 24)]


def test_every_line_is_answered_in_its_turn(rig: Rig) -> None:
    rig.say("ST\nAM 0 0\nwhat\nST\n")
    rig.run(PERIOD)
    assert [line.split()[0] for line in rig.hear()] == ["st", "ack", "nak", "st"]


def test_both_lines_are_answered_apart_and_the_newest_command_counts(rig: Rig) -> None:
    rig.say("AM 100 100\n", 0)
    rig.run(PERIOD)
    rig.say("AM 300 300\n", 1)
    rig.run(0.4)
    assert rig.hear(0) == rig.hear(1) == ["ack"]
    assert rig.motion.linear == pytest.approx(0.42 * LIMITS.acceleration), "on the way to 0.3 m/s"
    rig.say("SERV OFF\n", 0)
    rig.run(PERIOD)
    assert rig.done.braked


@pytest.mark.parametrize(
    ("command", "twist"),
    [
        ("AM 300 300", Twist(0.3, 0.0)),
        ("AM 200 300", Twist(0.25, 0.1 / 0.62)),
        ("AM -200 -200", Twist(-0.2, 0.0)),
        ("AM -155 155", Twist(0.0, 0.5)),
        ("AM 9999 9999", Twist(0.5, 0.0)),
        ("AM -9999 9999", Twist(0.0, 0.5)),
        ("AM 0 1240", Twist(0.5 * 0.62 / 2, 0.5)),  # 2 rad/s were asked: slower along the same arc
    ],
)
def test_it_drives_as_told_within_its_limits(rig: Rig, command: str, twist: Twist) -> None:
    rig.drive(2.0, command)
    assert (rig.motion.linear, rig.motion.angular) == pytest.approx((twist.linear, twist.angular), abs=1e-9)


@given(st.lists(st.tuples(st.integers(-9999, 9999), st.integers(-9999, 9999)), min_size=1, max_size=8))
def test_no_command_leads_beyond_the_limits(commands: list[tuple[int, int]]) -> None:
    rig = Rig()
    for left, right in commands:
        rig.drive(0.4, f"AM {left} {right}")
    linear, angular = (np.array([getattr(t, key) for t in rig.track]) for key in ("linear", "angular"))
    assert np.abs(linear).max() <= LIMITS.speed + 1e-9
    assert np.abs(angular).max() <= LIMITS.turn_rate + 1e-9
    assert np.abs(np.diff(linear, prepend=0.0)).max() <= LIMITS.acceleration * PERIOD + 1e-9
    assert np.abs(np.diff(angular, prepend=0.0)).max() <= LIMITS.angular_acceleration * PERIOD + 1e-9


def test_without_commands_it_stops_after_half_a_second(rig: Rig) -> None:
    rig.drive(3.0, "AM 400 400")
    rig.say("AM 400 400\n")
    rig.run(PERIOD)
    before = rig.way
    rig.run(3.0)
    speed, braking = 0.4, 0.4**2 / (2 * LIMITS.acceleration)
    # It notices in the tick after the hold, and slows down by the limit, in steps of a tick; the motors lag.
    assert rig.way - before == pytest.approx(speed * (HOLD + SERVO_LAG) + braking, abs=speed * PERIOD)
    assert rig.motion == Twist()
    (em, _) = rig.ask("ST")
    assert em.startswith("em no-command")
    assert em.endswith("all none for 0.5 s")
    assert rig.ask("AM 0 0") == ["ack"]
    assert len(rig.ask("ST")) == 1, "it is gone with the next command"


def test_requests_for_the_state_are_no_commands(rig: Rig) -> None:
    rig.drive(1.0, "AM 400 400")
    rig.drive(2.0, "ST")
    assert rig.motion == Twist()


def test_the_beginning_of_a_line_is_dropped_when_its_end_does_not_come(rig: Rig) -> None:
    rig.say("AM 500 50")
    rig.run(0.6)
    assert rig.ask("ST")[-1].startswith("st")
    rig.say("AM 300 3")
    rig.run(0.3)
    assert rig.ask("00") == ["ack"], "while one that is slow is waited for"


def test_the_state_tells_counters_and_measured_speeds(rig: Rig) -> None:
    rig.drive(3.0, "AM 200 300")
    before = rig.wheels.pulses
    told = parse_line(rig.ask("ST")[-1].encode())
    assert isinstance(told, Report)
    assert told.speeds == (pytest.approx(200, abs=1), pytest.approx(300, abs=1))
    assert told.counters == before
    assert told.time == round(1000 * (rig.time - PERIOD))


# --- stops ---


def front(distance: float, sonars: tuple[int, ...] = FRONT_SONARS) -> Callable[[Signals], Signals]:
    ranges = FREE.copy()
    ranges[list(sonars)] = distance
    return lambda signals: replace(signals, sonar=ranges)


def causes(rig: Rig) -> set[str]:
    return {line.split()[1] for line in rig.ask("ST") if line.startswith("em")}


@pytest.mark.parametrize("speed", [0.1, 0.3, 0.5])
def test_it_stops_for_what_is_nearer_than_the_room_that_its_speed_needs(speed: float) -> None:
    room = MARGIN + speed * REACTION + speed**2 / (2 * LIMITS.acceleration)
    assert SonarWatch(FRONT_SONARS, LIMITS).room(speed) == pytest.approx(room)
    for distance, stopped in ((room + 0.01, False), (room - 0.01, True)):
        rig = Rig()
        rig.drive(2.0, f"AM {1000 * speed:.0f} {1000 * speed:.0f}")
        rig.readings = front(distance)
        rig.drive(2.0, f"AM {1000 * speed:.0f} {1000 * speed:.0f}")
        assert (rig.motion == Twist()) == stopped
        assert causes(rig) == ({"sonar"} if stopped else set())


def test_an_obstacle_ahead_leaves_it_turning_and_reversing(rig: Rig) -> None:
    rig.readings = front(0.2)
    rig.drive(1.0, "AM 200 300")
    assert rig.motion.linear == pytest.approx(0.0, abs=1e-12)
    assert rig.motion.angular == pytest.approx(0.1 / 0.62)
    rig.drive(1.0, "AM -200 -200")
    assert rig.motion.linear == pytest.approx(-0.2)


@pytest.mark.parametrize("side", [range(6, 12), range(12, 18), range(18, 24)])
def test_only_the_front_sonars_stop_it(rig: Rig, side: range) -> None:
    rig.readings = front(0.2, tuple(side))
    rig.drive(2.0, "AM 300 300")
    assert rig.motion.linear == pytest.approx(0.3)


def test_one_stray_echo_does_not_stop_it_and_two_do(rig: Rig) -> None:
    rig.drive(1.0, "AM 300 300")
    rig.readings = front(0.3, FRONT_SONARS[2:3])
    rig.say("AM 300 300\n")
    rig.run(0.36)  # a round: the sonar's next reading is another
    rig.readings = front(10.0)
    rig.drive(0.4, "AM 300 300")
    assert min(twist.linear for twist in rig.track[-30:]) == pytest.approx(0.3)
    rig.readings = front(0.3, FRONT_SONARS[2:3])
    rig.drive(ROUND + 1.0, "AM 300 300")
    assert rig.motion == Twist(), "one sonar that goes on seeing it"
    rig.readings = front(10.0)
    rig.drive(2.0, "AM 300 300")
    rig.readings = front(0.3, FRONT_SONARS[2:4])
    rig.run(3 * PERIOD)
    assert rig.motion.linear < 0.3, "two sonars at once"


def test_it_goes_on_when_there_is_more_room_than_it_stopped_for(rig: Rig) -> None:
    room = SonarWatch(FRONT_SONARS, LIMITS).room(0.3)
    for distance, speed in ((room - 0.01, 0.0), (room + 0.9 * HYSTERESIS, 0.0), (room + 1.1 * HYSTERESIS, 0.3)):
        rig.readings = front(distance)
        rig.drive(2.0, "AM 300 300")
        assert rig.motion.linear == pytest.approx(speed)


def test_echoes_lost_for_a_moment_do_not_let_it_go(rig: Rig) -> None:
    rig.readings = front(0.3)
    rig.drive(2.0, "AM 300 300")
    rig.readings = front(10.668)
    rig.run(ROUND - PERIOD)
    rig.readings = front(0.3)
    rig.drive(1.0, "AM 300 300")
    assert max(twist.linear for twist in rig.track[-90:]) == 0.0


def pressed(*bumpers: str) -> Callable[[Signals], Signals]:
    return lambda signals: replace(signals, bumpers=frozenset(bumpers))


@pytest.mark.parametrize(("bumper", "into", "away"), [("front", 300, -300), ("rear", -300, 300)])
def test_a_bumper_stops_it_at_once_and_lets_it_away(rig: Rig, bumper: str, into: int, away: int) -> None:
    rig.drive(2.0, f"AM {into} {into}")
    rig.readings = pressed(bumper)
    rig.run(2 * PERIOD)
    assert rig.motion.linear == 0.0
    rig.readings = pressed()
    rig.drive(2.0, f"AM {into} {into}")
    assert rig.motion.linear == 0.0, "it rebounds from what it hit: as long as it is told to, it would hit it again"
    assert causes(rig) == {"bumper"}
    rig.drive(1.0, f"AM {away} {away}")
    assert rig.motion.linear == pytest.approx(away / 1000)
    assert causes(rig) == set()


def test_both_bumpers_hold_it(rig: Rig) -> None:
    rig.readings = pressed("front", "rear")
    for command in ("AM 300 300", "AM -300 -300", "AM -100 100"):
        rig.drive(1.0, command)
        assert rig.motion == Twist()
    assert "front,rear" in rig.ask("ST")[-1]


NAN = math.nan
BROKEN = {
    "pitch": lambda s: replace(s, inertial=Inertial(pitch=NAN)),
    "yaw rate": lambda s: replace(s, inertial=Inertial(yaw_rate=NAN)),
    "left encoder": lambda s: replace(s, pulses=Pulses(NAN, s.pulses.right)),
    "right encoder": lambda s: replace(s, pulses=Pulses(s.pulses.left, NAN)),
    "sonar": lambda s: replace(s, sonar=np.where(np.arange(24) == 7, NAN, FREE)),
}
TIPPED = {
    "nose down": lambda s: replace(s, inertial=Inertial(pitch=0.8)),
    "on its side": lambda s: replace(s, inertial=Inertial(roll=-1.1)),
}


@pytest.mark.parametrize("fault", [*BROKEN, *TIPPED])
def test_what_is_latched_locks_the_motors_until_they_are_released(rig: Rig, fault: str) -> None:
    rig.drive(2.0, "AM 300 300")
    assert not rig.done.braked
    rig.readings = {**BROKEN, **TIPPED}[fault]
    rig.run(PERIOD)
    assert rig.done == Actuation(0.0, 0.0, braked=True)
    told = {"sensor-fault"} if fault in BROKEN else {"tipped-over"}
    rig.drive(1.0, "AM 300 300")
    rig.ask("SERV ON")
    assert causes(rig) == told, "released while the reason holds, it is raised again"
    rig.readings = lambda signals: signals
    rig.drive(1.0, "AM 300 300")
    assert causes(rig) == told
    assert rig.done.braked
    rig.ask("SERV ON")
    assert causes(rig) == set()
    rig.drive(2.0, "AM 300 300")
    assert rig.motion.linear == pytest.approx(0.3)


def test_counters_that_are_no_numbers_are_told_as_they_last_were(rig: Rig) -> None:
    rig.drive(2.0, "AM 300 300")
    before = parse_line(rig.ask("ST")[-1].encode())
    rig.readings = BROKEN["left encoder"]
    after = parse_line(rig.ask("ST")[-1].encode())
    assert isinstance(before, Report)
    assert isinstance(after, Report)
    assert after.counters == before.counters
    assert after.servo is Servo.OFF


def test_a_wheel_that_is_pushed_and_stands_is_stuck(rig: Rig) -> None:
    standing = Pulses(100, 100)
    rig.readings = lambda signals: replace(signals, torques=(29.0, 3.0), pulses=standing)
    rig.drive(0.8, "AM 300 300")
    assert causes(rig) == set()
    rig.drive(0.4, "AM 300 300")
    (em, _) = rig.ask("ST")
    assert em.split()[1] == "stuck-wheel"
    assert em.endswith("left wheel stands still at 29 N m")
    assert rig.done.braked


def test_set_down_it_starts_from_rest(rig: Rig) -> None:
    rig.drive(2.0, "AM 500 500")
    rig.firmware.rest()
    rig.run(PERIOD)
    assert rig.motion == Twist()


@settings(max_examples=200)
@given(
    st.lists(
        st.one_of(st.binary(max_size=300), st.sampled_from([b"AM 300 300\n", b"ST\n", b"SERV ON\n", b"SERV OFF\n"])),
        max_size=12,
    )
)
def test_no_bytes_upset_it_and_all_that_it_says_are_lines(chunks: list[bytes]) -> None:
    rig = Rig()
    ends = 0
    for chunk in chunks:
        rig.lines[0].to_robot.put(chunk)
        rig.run(PERIOD)
        ends += chunk.count(b"\n")
    rig.run(1.0)
    said = rig.hear()
    for line in said:
        parse_line(line.encode("latin-1"))
    assert len([line for line in said if not line.startswith("em")]) == ends, "one answer to each line"


def test_a_flood_is_read_at_the_rate_of_a_line_and_the_rest_is_lost(rig: Rig) -> None:
    flood = b"AM 1 1\n" * 2000
    assert len(flood) > CAPACITY
    rig.lines[0].to_robot.put(flood)
    rig.run(PERIOD)
    assert len(rig.hear()) == 256 // 7
    rig.run(1.0)
    assert len(rig.hear()) == CAPACITY // 7 - 256 // 7


def test_every_cause_of_its_own_is_told_apart() -> None:
    with pytest.raises(ProtocolError):
        parse_line(b"em nothing 0 all x")
    for cause in Cause:
        assert parse_line(f"em {cause.value.replace(' ', '-')} 0 all x".encode())
