"""The Robuter's own processor: takes lines in, gives lines out, drives the motors, and stops them when it must.

It runs whether anybody speaks with it or not. Every reason to stop is one of its stops, which ``st`` tells.
"""

from collections.abc import Sequence

import numpy as np

from refseq_bench.robots.motion import DifferentialDrive, Limits, Twist, WheelSpeeds
from refseq_bench.robots.odometry import Encoders
from refseq_bench.robots.robuter.line import SerialLine
from refseq_bench.robots.robuter.protocol import (
    NO_ECHO,
    Bumper,
    LineReader,
    Message,
    Motion,
    ProtocolError,
    ProtocolWord,
    Provision,
    Refusal,
    Report,
    Servo,
    bounded,
    format_line,
    legible,
    parse_line,
)
from refseq_bench.robots.robuter.regulator import MOTOR_TORQUE, Regulator
from refseq_bench.robots.robuter.watches import BumperWatch, SonarWatch
from refseq_bench.robots.robuter.wheels import WheelMeter
from refseq_bench.robots.signals import Actuation, Signals
from refseq_bench.robots.state import LATCHED, Blocked, Cause
from refseq_bench.robots.stops import Stops, StuckWatch, let_through, not_a_number, tipped

PERIOD = 0.02
"""Time between two ticks [s]: a choice."""
HOLD = 0.5
"""Time that a command holds, and the beginning of a line waits for its end [s]; the hold is the project's figure."""
BYTES_PER_TICK = 256
"""Bytes that are read from a line in one tick; 115 200 baud would carry 230."""
STUCK_SLACK = 20
"""Pulses by which a wheel that is stuck may give way: 2 mm of its rim, a choice."""
TOLERANCE = 1e-9
"""Room for the rounding of times [s]."""

AT_ONCE = LATCHED | {Cause.BUMPER}
"""Causes at which it does not slow down gently."""


class RobuterFirmware:
    """The processor on several serial ``lines``, of which each is answered on its own; the newest command counts."""

    def __init__(
        self,
        drive: DifferentialDrive,
        limits: Limits,
        pulses_per_turn: int,
        front_sonars: Sequence[int],
        lines: Sequence[SerialLine],
    ) -> None:
        self._drive, self._limits = drive, limits
        self._ports = [_Port(line) for line in lines]
        encoders = Encoders(pulses_per_turn)
        self._wheels = WheelMeter(encoders, PERIOD)
        self._left, self._right = Regulator(encoders, PERIOD), Regulator(encoders, PERIOD)
        self._sonars = SonarWatch(front_sonars, limits)
        self._bumpers = BumperWatch()
        self._stuck = StuckWatch(MOTOR_TORQUE, STUCK_SLACK)
        self._stops = Stops()
        self._wanted = self._driven = Twist()
        self._commanded = 0.0  # when the last command came [s]

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass."""
        self._wheels.look(signals.pulses)
        self._watch(signals)
        for port in self._ports:
            for line in port.hear(signals.time):
                self._answer(port, line, signals)
        return self._drive_on()

    def rest(self) -> None:
        """Begin anew from rest: somebody has set the robot down."""
        self._wanted = self._driven = Twist()
        for part in (self._wheels, self._left, self._right):
            part.rest()

    @property
    def _locked(self) -> bool:
        return any(stop.cause in LATCHED for stop in self._stops.held)

    def _watch(self, signals: Signals) -> None:
        """Raise and clear the stops by what is read now."""
        time, stops = signals.time, self._stops
        if time - self._commanded > HOLD + TOLERANCE:
            self._wanted = Twist()
            stops.set(Cause.NO_COMMAND, f"none for {HOLD:g} s", time)
        speed = max(self._wanted.linear, self._driven.linear, self._drive.twist(self._wheels.speeds).linear)
        bumped = self._bumpers.look(signals.bumpers, self._wanted)
        stops.set(Cause.BUMPER, bumped, time, self._bumpers.blocks)
        stops.set(Cause.SONAR, self._sonars.look(time, signals.sonar, speed), time, Blocked.FORWARD)
        stops.set(Cause.TIPPED, tipped(signals), time)
        stops.set(Cause.STUCK, self._stuck.look(signals), time)
        stops.set(Cause.SENSOR, not_a_number(signals), time)

    def _answer(self, port: "_Port", line: bytes, signals: Signals) -> None:
        try:
            self._obey(port, parse_line(line), signals)
        except ProtocolError as error:
            port.say(Refusal(legible(str(error))))

    def _obey(self, port: "_Port", message: Message, signals: Signals) -> None:
        match message:
            case Motion():
                self._command(message, signals.time)
            case ProtocolWord.SERVO_OFF:
                self._wanted = Twist()
                self._stops.set(Cause.EMERGENCY, "servo off", signals.time)
            case ProtocolWord.SERVO_ON:
                self._wanted = Twist()
                self._stops.release()
            case ProtocolWord.STATE:
                port.say(*self._provisions(), self._report(signals))
                return
            case _:
                raise ProtocolError("a reply, not a command: valid are AM, SERV ON, SERV OFF, ST")
        port.say(ProtocolWord.ACK)

    def _command(self, motion: Motion, time: float) -> None:
        """Take speeds of the wheels for what is wanted, slower along the same arc where they are too fast."""
        radius = 1000 * self._drive.wheel_radius
        self._wanted = self._limits.limited(self._drive.twist(WheelSpeeds(motion.left / radius, motion.right / radius)))
        self._commanded = time
        self._stops.set(Cause.NO_COMMAND, None, time)

    def _provisions(self) -> list[Message]:
        return [
            Provision(stop.cause, bounded(1000 * stop.since), stop.blocks, legible(stop.detail))
            for stop in self._stops.held
        ]

    def _report(self, signals: Signals) -> Report:
        counters, speeds = self._wheels.counters, self._wheels.speeds
        radius = 1000 * self._drive.wheel_radius
        return Report(
            time=bounded(1000 * signals.time),
            counters=(bounded(counters.left), bounded(counters.right)),
            speeds=(bounded(speeds.left * radius), bounded(speeds.right * radius)),
            servo=Servo.OFF if self._locked else Servo.ON,
            bumpers=tuple(bumper for bumper in Bumper if bumper.value in signals.bumpers),
            provisions=len(self._stops.held),
            sonars=() if signals.sonar is None else tuple(_millimetres(signals.sonar)),
        )

    def _drive_on(self) -> Actuation:
        """Change the speed as fast as the limits allow; where it must stop at once, faster."""
        held = self._stops.held
        driven = self._limits.approached(self._driven, let_through(held, self._wanted), PERIOD)
        self._driven = let_through((stop for stop in held if stop.cause in AT_ONCE), driven)
        speeds, counters = self._drive.wheel_speeds(self._driven), self._wheels.counters
        left, right = self._left.told(speeds.left, counters.left), self._right.told(speeds.right, counters.right)
        return Actuation(left, right, braked=self._locked)


class _Port:
    """One serial line at the robot's end."""

    def __init__(self, line: SerialLine) -> None:
        self._line, self._reader, self._heard = line, LineReader(), 0.0

    def hear(self, time: float) -> list[bytes]:
        """Return the lines that have come to their end; a beginning that waited too long is dropped."""
        if time - self._heard > HOLD + TOLERANCE:
            self._reader.forget()
        data = self._line.to_robot.take(BYTES_PER_TICK)
        if data:
            self._heard = time
        return self._reader.feed(data)

    def say(self, *messages: Message) -> None:
        self._line.to_host.put(b"".join(map(format_line, messages)))


def _millimetres(ranges: np.ndarray) -> list[int]:
    """Return sonar readings as the line carries them."""
    nearest = np.rint(np.where(np.isfinite(ranges), 1000 * ranges, NO_ECHO)).clip(0, NO_ECHO)
    told: list[int] = nearest.astype(int).tolist()
    return told
