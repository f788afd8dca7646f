"""The machine's firmware, a hundred times a second: hear sensors and commands, balance, drive, tell its status."""

import math
from dataclasses import dataclass, field

import numpy as np

from refseq_bench.robots.motion import within
from refseq_bench.robots.odometry import Encoders
from refseq_bench.robots.segway_rmp.balance import Vector, balancer, carrying, regulator
from refseq_bench.robots.segway_rmp.estimate import MotionEstimate
from refseq_bench.robots.segway_rmp.follower import Follower
from refseq_bench.robots.segway_rmp.plant import GRAVITY, Course, Plant, Posture
from refseq_bench.robots.segway_rmp.protocol import (
    COUNTS_PER_DEGREE,
    COUNTS_PER_METRE,
    COUNTS_PER_RADIAN,
    COUNTS_PER_REVOLUTION,
    COUNTS_PER_SPEED,
    COUNTS_PER_TORQUE,
    QUIET,
    Config,
    GainSet,
    Mode,
    SegwayCommand,
    StatusBits,
    StatusFrame,
    counts,
)
from refseq_bench.robots.signals import Actuation, Signals
from refseq_bench.robots.stops import TIPPED_PITCH, TIPPED_ROLL

PERIOD = 0.01
COMMAND_HOLD = 0.4
"""A command counts for so long [s]; then the machine slows to a stop."""
POSITION_ERROR = 12 * 0.3048
"""Farther than this from where it should be [m] it gives up balancing and goes into tractor mode."""
LATERAL = 0.5 * GRAVITY
"""Cap of the acceleration across the path [m/s²]."""
ACCELERATION, ANGULAR_ACCELERATION = 1.0, 3.0
"""Greatest change of speed and turn rate [m/s², rad/s²]: choices; 1 m/s² leans the machine by 11°."""
SMOOTHING = 0.24
"""The ramp of the speed is averaged twice over so long [s], so that the machine leans over gently: a choice.

It is a whole number of command periods (20 ms), so that the steps of commands cancel out."""
REACH, TURN_REACH = 0.3, 0.5
"""Errors of place [m] and heading [rad] that are fed back at most, so that a robot held back does not tear: choices."""
LEAN = math.radians(15)
"""Greatest lean for errors of place and speed [rad]: a choice. More, and it could not
come upright again before it has run too fast, or run out of torque."""
TORQUE = 60.0
"""Greatest torque of a motor on its wheel [N·m]: a choice (README)."""

WHEEL_SPEED = 20.0
"""A wheel that turns faster is not driven any faster [rad/s], else one in the air would race: a choice, 4.8 m/s."""
WITHOUT_WHEELS = 10.0
"""Without both encoders the machine balances on for so long [s], then falls: a choice. It does not know whether it
stands, and what rolls away is worse than what falls."""


@dataclass(frozen=True, slots=True)
class Build:
    """One machine: what it weighs, what it counts, and the mode that it wakes up in."""

    plant: Plant
    pulses_per_turn: int
    mode: Mode
    gain_set: GainSet


@dataclass
class _Drive:
    """Courses that are followed, and sums of their errors."""

    way: Follower = field(default_factory=lambda: Follower(ACCELERATION, SMOOTHING, PERIOD))
    heading: Follower = field(default_factory=lambda: Follower(ANGULAR_ACCELERATION, PERIOD, PERIOD))
    integral: float = 0.0


class SegwayFirmware:
    """The machine's electronics; ``status`` is the frame of the last tick."""

    def __init__(self, build: Build) -> None:
        plant = build.plant
        self.status = StatusFrame()
        self._plant, self._gain_set = plant, build.gain_set
        self._known = MotionEstimate(plant, Encoders(build.pulses_per_turn), PERIOD)
        self._flatness = plant.flatness()
        self._turning = regulator(plant.yawing().sampled(PERIOD), np.array([0.03, 0.2]), 10.0)
        self._rolling = regulator(plant.rolling().sampled(PERIOD), np.array([0.03, 0.1]), 20.0)
        self._drive = _Drive()
        self._command, self._heard = SegwayCommand(), -math.inf
        self._frames, self._words = 0, QUIET
        self._seen_wheels = 0.0
        self._torques = 0.0, 0.0
        self._mode = Mode.DISABLED
        self._enter(build.mode)

    @property
    def courses(self) -> tuple[Course, Course]:
        """Followed courses: those of the way [m] and of the heading [rad]."""
        return self._drive.way.course, self._drive.heading.course

    def receive(self, command: SegwayCommand, time: float) -> None:
        """Take a command that came at ``time`` [s]."""
        self._command, self._heard = command, time
        if command.config is Config.GAIN_SET:
            self._gain_set = GainSet(command.parameter)
        elif command.config is Config.MODE:
            self._words = QUIET  # what was wrong is forgotten
            self._known.begin_anew()
            self._enter(Mode(command.parameter))
        elif command.config is Config.RESET_INTEGRATORS:
            self._hold_here()

    def _enter(self, mode: Mode) -> None:
        """Change the mode; the gain set is latched when the machine begins to balance."""
        if mode is self._mode:
            return
        self._known.begin(balancing=mode is Mode.BALANCE)
        if mode is Mode.BALANCE:
            self._latched = self._gain_set
            self._balancing = balancer(self._plant, self._latched, PERIOD)
            self._flatness = carrying(self._plant, self._latched).flatness()
        self._mode = mode
        self._drive.integral = 0.0  # what held the machine's place against a push would lean it over in the new mode
        self._hold_here()

    def _hold_here(self) -> None:
        """Take the present place for the one where the machine should be."""
        x, speed, *_ = self._known.state.tolist()
        self._drive.way.start(x, speed)
        self._drive.heading.start(*self._known.yaw)

    def rest(self) -> None:
        """Begin anew from rest, upright; the ways stay as they are."""
        self._known.rest()
        self._drive, self._torques = _Drive(), (0.0, 0.0)
        self._hold_here()

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass."""
        self._frames += 1
        self._known.hear(signals, self._torques)
        self._watch(signals)
        self._follow(signals.time)
        self._torques = self._share(*self._efforts())
        self.status = self._tell()
        return Actuation(*self._torques)

    def _watch(self, signals: Signals) -> None:
        """Look for what ends balancing, or all motion."""
        sensors = self._known.sensors
        if sensors.inertial_believed and abs(sensors.inertial.pitch) > TIPPED_PITCH:
            self._power_off(StatusBits.PITCH_LIMIT)
        if sensors.inertial_believed and abs(sensors.inertial.roll) > TIPPED_ROLL:
            self._power_off(StatusBits.ROLL_LIMIT)
        if sensors.inertial_lost:
            self._words |= StatusBits.SYSTEM_INTEGRITY_FAULT | StatusBits.SPEED_LIMIT_0
        if any(sensors.wheels_lost):
            self._words |= StatusBits.MOTOR_FEEDBACK_FAULT | StatusBits.SPEED_LIMIT_0
        if not all(sensors.wheels_lost):
            self._seen_wheels = signals.time
        if (sensors.inertial_lost and any(sensors.wheels_lost)) or signals.time - self._seen_wheels > WITHOUT_WHEELS:
            self._power_off(QUIET)
        if self._mode is Mode.BALANCE and abs(self._off) > POSITION_ERROR:
            self._enter(Mode.TRACTOR)
            self._words |= StatusBits.POSITION_ERROR

    def _power_off(self, why: StatusBits) -> None:
        self._words |= why
        self._enter(Mode.DISABLED)

    @property
    def _asked(self) -> Posture:
        """The posture that the machine should have now."""
        course = self._drive.way.course
        if self._mode is Mode.BALANCE:
            return self._flatness.posture(course)
        return Posture(course.place, course.speed, 0.0, 0.0, self._flatness.push * course.acceleration)

    @property
    def _off(self) -> float:
        """Lead of the machine over where it should be [m]."""
        return float(self._known.state[0]) - self._asked.place

    def _follow(self, time: float) -> None:
        speed, turn = self._command.velocity / COUNTS_PER_SPEED, self._command.turn / COUNTS_PER_RADIAN
        if (
            time - self._heard > COMMAND_HOLD + 1e-9
            or StatusBits.SPEED_LIMIT_0 in self._words
            or self._mode is Mode.DISABLED
        ):
            speed = turn = 0.0
        drive = self._drive
        drive.way.follow(speed)
        most = LATERAL / max(abs(drive.way.course.speed), 1e-6)
        drive.heading.follow(within(turn, most))

    def _efforts(self) -> tuple[float, float]:
        """Torque of both motors together, and of the right one over the left one [N·m]."""
        if self._mode is Mode.DISABLED:
            return 0.0, 0.0
        asked = self._asked
        errors = self._known.state - asked[:4]
        errors[0] = within(errors[0], REACH)
        forward = asked.torque - (self._balance(errors) if self._mode is Mode.BALANCE else self._rolling @ errors[:2])
        course, (heading, rate) = self._drive.heading.course, self._known.yaw
        turning = -self._turning @ (within(heading - course.place, TURN_REACH), rate - course.speed)
        return float(forward), float(turning)

    def _balance(self, errors: Vector) -> float:
        """Torque that the state feedback takes off: place and speed ask for a lean, which has its limit."""
        if abs(errors[0]) < REACH:  # else it would go on summing while something holds the machine back
            self._drive.integral += errors[0] * PERIOD
        gains = self._balancing
        leaning = float(gains[:3] @ (self._drive.integral, *errors[:2]))
        return within(leaning, abs(gains[3]) * LEAN) + float(gains[3:] @ errors[2:])

    def _share(self, forward: float, turning: float) -> tuple[float, float]:
        """Torques of the (left, right) motor within their limit; balance comes before turning."""
        forward = within(forward, 2 * TORQUE)
        turning = within(turning, 2 * TORQUE - abs(forward))
        left, right = (forward - turning) / 2, (forward + turning) / 2
        rates = self._known.sensors.rates
        return _restrained(left, rates[0]), _restrained(right, rates[1])

    def _tell(self) -> StatusFrame:
        x, speed, pitch, rate = self._known.state.tolist()
        yaw, yaw_rate = self._known.yaw
        aside = yaw_rate * self._plant.track / 2
        on = StatusBits.MOTORS_ENABLED if self._mode is not Mode.DISABLED else QUIET
        balancing = StatusBits.BALANCE_MODE if self._mode is Mode.BALANCE else QUIET
        left, right = self._known.ways
        return StatusFrame(
            frames=self._frames % 2**16,
            pitch=counts(math.degrees(pitch), COUNTS_PER_DEGREE),
            pitch_rate=counts(math.degrees(rate), COUNTS_PER_DEGREE),
            roll=counts(math.degrees(self._known.sensors.inertial.roll), COUNTS_PER_DEGREE),
            yaw_rate=counts(math.degrees(yaw_rate), COUNTS_PER_DEGREE),
            left_speed=counts(speed - aside, COUNTS_PER_SPEED),
            right_speed=counts(speed + aside, COUNTS_PER_SPEED),
            left=counts(left, COUNTS_PER_METRE, 32),
            right=counts(right, COUNTS_PER_METRE, 32),
            forward=counts(x, COUNTS_PER_METRE, 32),
            yaw=counts(yaw / (2 * math.pi), COUNTS_PER_REVOLUTION, 32),
            left_torque=counts(self._torques[0], COUNTS_PER_TORQUE),
            right_torque=counts(self._torques[1], COUNTS_PER_TORQUE),
            mode=self._mode,
            gain_set=self._latched if self._mode is Mode.BALANCE else self._gain_set,
            velocity_command=self._command.velocity,
            turn_command=self._command.turn,
            words=self._words | on | balancing,
        )


def _restrained(torque: float, rate: float) -> float:
    return 0.0 if rate * math.copysign(1.0, torque) > WHEEL_SPEED else torque
