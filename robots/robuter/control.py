"""The Robuter's Control layer: the program on its computer, and the processor that it speaks with over a serial line.

The program sends what it is commanded at 5 Hz at most, each answered by an ``ack`` that also proves life, and asks for
the state at 10 Hz (card R1). 5 Hz is a limit, not a grid: on a line that has been idle a command goes out at the next
tick, so one that comes alone waits 20 ms and not up to 200. Under a command that changes all the time it is the newest
that goes, at even times. Only what was commanded since the last message is sent: when those above fall silent so does
the line, and the robot's watchdog stops it 0.5 s after the last message, at most 0.7 s after the last command.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from refseq_bench.robots.motion import DifferentialDrive, Limits, Twist, WheelSpeeds
from refseq_bench.robots.odometry import Encoders, Geometry, Odometry, Pulses
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.robuter.firmware import PERIOD, TOLERANCE, RobuterFirmware
from refseq_bench.robots.robuter.line import SerialLine
from refseq_bench.robots.robuter.protocol import (
    NO_ECHO,
    LineReader,
    Message,
    Motion,
    ProtocolError,
    ProtocolWord,
    Provision,
    Report,
    Servo,
    format_line,
    parse_line,
)
from refseq_bench.robots.signals import Actuation, Signals
from refseq_bench.robots.state import Cause, Motors, RobotState, Stop

COMMAND_PERIOD = 0.2
"""Least time between two commands [s] (card R1: 5 Hz)."""
STATE_PERIOD = 0.1
"""Time between two requests for the state [s] (card R1: 10 Hz)."""
PATIENCE = 3
"""Commands that may stay without an ``ack`` before the robot counts as dead: a choice, 0.6 s."""
STATE_PATIENCE = 6
"""As ``PATIENCE``, for requests of the state: the same time."""


class RobuterControl:
    """Speaks SI units with those above, and text lines with the robot.

    ``line`` is the program's own. The robot has a second one (the thesis names two), ``spare``, free for an outside
    program; the newest command on either counts.
    """

    period = PERIOD
    needs_scan = False

    def __init__(
        self,
        drive: DifferentialDrive,
        limits: Limits,
        pulses_per_turn: int,
        front_sonars: Sequence[int],
        believed: Geometry,
    ) -> None:
        self.line, self.spare = SerialLine(), SerialLine()
        self._drive, self._limits = drive, limits
        self._firmware = RobuterFirmware(drive, limits, pulses_per_turn, front_sonars, (self.line, self.spare))
        encoders = Encoders(pulses_per_turn)
        # Two odometers: by the counters of this moment, and by those of the last report, which the state tells of.
        self._odometry, self._told = Odometry(believed, encoders), Odometry(believed, encoders)
        self._reader = LineReader()
        self._urgent: list[Message] = []
        self._wanted: Twist | None = None  # not sent yet
        self._commanded = self._asked = -math.inf  # when the last message of either kind went [s]
        self._unanswered = {ProtocolWord.ACK: 0, ProtocolWord.STATE: 0}  # messages of either kind since the last answer
        self._provisions: list[Provision] = []
        self._state = RobotState()

    @property
    def state(self) -> RobotState:
        """The state that was last heard from the robot."""
        return self._state

    @property
    def odometry(self) -> PlanarPose:
        """The odometer at this moment."""
        return self._odometry.pose

    def command(self, twist: Twist) -> None:
        """Ask for a motion; one that is too fast is slowed along its arc."""
        self._wanted = self._limits.limited(twist)

    def emergency_stop(self) -> None:
        """Kill all motion and lock the motors, until ``release``; this waits for no rate."""
        self._wanted = None
        self._urgent = [Motion(0, 0), ProtocolWord.SERVO_OFF]

    def release(self) -> None:
        """Clear all stops whose reason has gone."""
        self._urgent.append(ProtocolWord.SERVO_ON)

    def rest(self) -> None:
        """Begin anew from rest: somebody has set the robot down."""
        self._wanted = None
        self._firmware.rest()

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass."""
        if signals.pulses.finite:
            self._odometry.update(signals.pulses)
        self._speak(signals.time)
        actuation = self._firmware.tick(signals)
        for line in self._reader.feed(self.line.to_host.take()):
            self._hear(line)
        self._mind_silence(signals.time)
        return actuation

    def _speak(self, time: float) -> None:
        """Send what is due."""
        for message in self._urgent:
            self._send(message)
        self._urgent = []
        if self._wanted is not None and time - self._commanded >= COMMAND_PERIOD - TOLERANCE:
            # A robot that does not answer is not told to move: who knows what it hears.
            self._send(Motion(0, 0) if self._silent else _in_millimetres(self._drive, self._wanted))
            self._unanswered[ProtocolWord.ACK] += 1
            self._wanted, self._commanded = None, time
        if time - self._asked >= STATE_PERIOD - TOLERANCE:
            self._send(ProtocolWord.STATE)
            self._unanswered[ProtocolWord.STATE] += 1
            self._asked = time

    def _send(self, message: Message) -> None:
        self.line.to_robot.put(format_line(message))

    def _hear(self, line: bytes) -> None:
        """Take in one line of the robot's; what is none of the protocol's counts as not heard."""
        try:
            message = parse_line(line)
        except ProtocolError:
            return
        match message:
            case ProtocolWord.ACK:
                self._unanswered[ProtocolWord.ACK] = 0
            case Provision():
                self._provisions.append(message)
            case Report():
                self._take(message)

    def _take(self, report: Report) -> None:
        """Make a report the state, unless some of its provisions were lost on the way."""
        provisions, self._provisions = self._provisions, []
        if len(provisions) != report.provisions:
            return
        self._unanswered[ProtocolWord.STATE] = 0
        self._told.update(Pulses(*report.counters))
        left, right = (speed / 1000 / self._drive.wheel_radius for speed in report.speeds)
        self._state = RobotState(
            time=report.time / 1000,
            pose=self._told.pose,
            distance=self._told.distance,
            twist=self._drive.twist(WheelSpeeds(left, right)),
            stops=tuple(Stop(one.cause, one.detail, one.since / 1000, one.blocks) for one in provisions),
            motors=Motors.LOCKED if report.servo is Servo.OFF else Motors.ON,
            sonar=_in_metres(report.sonars) if report.sonars else None,
        )

    @property
    def _silent(self) -> bool:
        return self._unanswered[ProtocolWord.ACK] >= PATIENCE or self._unanswered[ProtocolWord.STATE] >= STATE_PATIENCE

    def _mind_silence(self, time: float) -> None:
        """Tell of a robot that does not answer, as long as it does not."""
        stops, silent = self._state.stops, self._silent
        told = any(stop.cause is Cause.NO_ANSWER for stop in stops)
        if silent and not told:
            acks, states = self._unanswered.values()
            detail = f"{acks} commands and {states} requests without an answer"
            self._state = replace(self._state, stops=(*stops, Stop(Cause.NO_ANSWER, detail, time)))
        elif told and not silent:
            others = tuple(stop for stop in stops if stop.cause is not Cause.NO_ANSWER)
            self._state = replace(self._state, stops=others)


def _in_millimetres(drive: DifferentialDrive, twist: Twist) -> Motion:
    """Return the wheel speeds [mm/s] of a motion."""
    speeds = drive.wheel_speeds(twist)
    return Motion(*(round(1000 * drive.wheel_radius * speed) for speed in (speeds.left, speeds.right)))


def _in_metres(sonars: Sequence[int]) -> np.ndarray:
    return np.array([math.inf if reading == NO_ECHO else reading / 1000 for reading in sonars])
