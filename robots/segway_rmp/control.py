"""The RMP's Control layer: speaks the machine's frames, looks out by laser, and tells what it hears in SI units."""

import math

from refseq_bench.robots.motion import Limits, Twist
from refseq_bench.robots.mounting import Mounting
from refseq_bench.robots.odometry import Encoders, Geometry, Odometry, Pulses
from refseq_bench.robots.planar import PlanarPose
from refseq_bench.robots.robot import Shape
from refseq_bench.robots.segway_rmp.firmware import ACCELERATION, Build, SegwayFirmware
from refseq_bench.robots.segway_rmp.jam import JamWatch
from refseq_bench.robots.segway_rmp.obstacle_monitor import ObstacleMonitor
from refseq_bench.robots.segway_rmp.protocol import (
    COUNTS_PER_RADIAN,
    COUNTS_PER_SPEED,
    QUIET,
    RESET_FOREAFT,
    TOP_SPEED,
    TOP_TURN,
    Config,
    SegwayCommand,
    StatusBits,
    StatusFrame,
)
from refseq_bench.robots.signals import Actuation, Signals
from refseq_bench.robots.state import Blocked, Cause, Motors, RobotState
from refseq_bench.robots.stops import Stops

COMMAND_TICKS = 2
"""A command frame goes down every so many ticks: 20 ms, of 10 to 300 ms that the machine takes; a choice."""
SILENCE = 0.4
"""Without a command from above for so long [s] the robot is stopped: what the machine itself holds a command."""
LATENCY = 0.5
"""Time until the machine slows down [s] (C): a scan 0.2, frames 0.03, smoothing 0.24; rounded up."""
SURGE = 0.08
"""Way that the axle runs ahead so that the body leans back [m] (C): arm · tilt · acceleration, ``plant.Flatness``."""
MARGIN = 0.15
"""Room that is left to what is in the way [m]: a choice."""
CLEAR = 0.1
"""A way that was blocked is free again with so much more room [m]: a choice."""
GOING, STANDING, HELD_TIME = 0.1, 0.05, 2.0
"""Told to go at least so fast and going less than so fast [m/s] for so long [s], something holds it: choices."""

STAY = Config.RESET_INTEGRATORS, RESET_FOREAFT
"""Setting that lets the machine take the place where it is for the one where it should be."""


class SegwayControl:
    """One machine, and the program that commands it."""

    period = 0.01
    needs_scan = True

    def __init__(self, build: Build, limits: Limits, shape: Shape, mounting: Mounting, believed: Geometry) -> None:
        self._firmware = SegwayFirmware(build)
        self._wake, self._limits = build.mode, limits
        self._odometry = Odometry(believed, Encoders(build.pulses_per_turn))
        self._jam = JamWatch(slack=build.pulses_per_turn / 360)
        self._stops, self._state = Stops(), RobotState()
        self._wanted, self._asked, self._told = Twist(), Twist(), 0.0
        self._ticks, self._time = 0, 0.0
        self._settings: list[tuple[Config, int]] = []
        self._monitor = ObstacleMonitor(shape, mounting)
        self._went = 0.0

    @property
    def state(self) -> RobotState:
        """The state that was last heard from the robot."""
        return self._state

    @property
    def odometry(self) -> PlanarPose:
        """The odometer at this moment."""
        return self._odometry.pose

    @property
    def status(self) -> StatusFrame:
        """The machine's newest frame."""
        return self._firmware.status

    def command(self, twist: Twist) -> None:
        """Ask for a motion; it holds until the next command, 0.4 s at most."""
        self._wanted, self._told = self._limits.limited(twist), self._time

    def emergency_stop(self) -> None:
        """Brake to a standstill and hold the place.

        A machine that balances has no safer state: without power it falls.
        """
        self._stops.set(Cause.EMERGENCY, "emergency stop was asked for", self._time)

    def release(self) -> None:
        """Clear all stops whose reason has gone; the machine goes back to the mode that it woke up in."""
        self._stops.release()
        self._jam.forget()
        self._told = self._time
        self._wanted = Twist()
        self._settings = [(Config.MODE, self._wake), STAY]

    def rest(self) -> None:
        """Begin anew from rest: somebody has set the robot down. Stops stay, and the odometer."""
        self._firmware.rest()
        self._jam.forget()
        self._wanted = self._asked = Twist()

    def tick(self, signals: Signals) -> Actuation:
        """Let one period pass."""
        self._time = signals.time
        self._monitor.take(signals.scan, self._state.pitch, signals.time)
        if self._ticks % COMMAND_TICKS == 0:
            self._firmware.receive(self._frame(), signals.time)
        self._ticks += 1
        actuation = self._firmware.tick(signals)
        self._hear(signals)
        return actuation

    def _frame(self) -> SegwayCommand:
        """The next command: the motion that is let through, and a setting where one waits."""
        allowed = self._stops.allowed(self._wanted)
        ramped = self._limits.approached(self._asked, allowed, COMMAND_TICKS * self.period)
        # What a stop forbids ends at once, not by a ramp: the machine itself brakes as hard as it safely can.
        self._asked = self._stops.allowed(ramped)
        config, parameter = self._settings.pop(0) if self._settings else (Config.NONE, 0)
        return SegwayCommand(
            _word(self._asked.linear * COUNTS_PER_SPEED, TOP_SPEED),
            _word(self._asked.angular * COUNTS_PER_RADIAN, TOP_TURN),
            config,
            parameter,
        )

    def _hear(self, signals: Signals) -> None:
        status = self.status
        self._odometry.update(Pulses(status.left, status.right))
        self._look_for_stops(signals, status)
        self._state = RobotState(
            time=signals.time,
            pose=self._odometry.pose,
            distance=self._odometry.distance,
            twist=_motion(status),
            stops=self._stops.held,
            motors=Motors.ON if StatusBits.MOTORS_ENABLED in status.words else Motors.OFF,
            mode=status.mode.name.lower(),
            pitch=status.pitch / COUNTS_PER_RADIAN,
        )

    def _look_for_stops(self, signals: Signals, status: StatusFrame) -> None:
        stops, time = self._stops, signals.time
        # Until a release has gone down, the machine tells of faults that it is about to forget.
        outdated = (Config.MODE, self._wake) in self._settings
        faults = QUIET if outdated else status.words
        stops.set(Cause.TIPPED, _fallen(status, faults), time)
        stops.set(Cause.SENSOR, self._broken(faults, time), time)
        stops.set(Cause.STUCK, self._jammed(signals, status), time)
        silent = time - self._told > SILENCE + 1e-9
        stops.set(Cause.NO_COMMAND, f"none for {SILENCE:g} s" if silent else None, time)
        stops.set(Cause.LASER, self._in_the_way(status), time, Blocked.FORWARD)

    def _broken(self, faults: StatusBits, time: float) -> str | None:
        """Name the sensor that has failed: the machine tells of its own, the laser is ours."""
        if StatusBits.SYSTEM_INTEGRITY_FAULT in faults:
            return "inertial sensors read no number"
        if StatusBits.MOTOR_FEEDBACK_FAULT in faults:
            return "encoders read no number"
        return self._monitor.lost(time)

    def _jammed(self, signals: Signals, status: StatusFrame) -> str | None:
        """Tell of a wheel that is stuck; the machine then stands where it is, however far it should have come."""
        jammed = self._jam.look(signals) or self._held_back(status)
        if StatusBits.MOTORS_ENABLED not in status.words:
            return None
        if jammed and Cause.STUCK not in self._stops:
            self._settings.append(STAY)
        return jammed

    def _held_back(self, status: StatusFrame) -> str | None:
        told, goes = status.velocity_command / COUNTS_PER_SPEED, _motion(status).linear
        if abs(told) < GOING or abs(goes) > STANDING:
            self._went = self._time
        elif self._time - self._went > HELD_TIME:
            return f"told to go {told:.2f} m/s, goes {goes:.2f} m/s"
        return None

    def _in_the_way(self, status: StatusFrame) -> str | None:
        # A robot that stands before something and is told to go along an arc is asked for a tighter one at first.
        found = self._monitor.nearest({self._asked, self._wanted})
        if found is None:
            return None
        moving = _motion(status)
        blocked = Cause.LASER in self._stops
        speed = max(moving.linear, self._wanted.linear if blocked else 0.0, 0.0)
        needed = speed * LATENCY + speed**2 / (2 * ACCELERATION) + SURGE + MARGIN + (CLEAR if blocked else 0.0)
        if found.gap > needed:
            return None
        return f"laser: {found.gap:.2f} m ahead at {math.degrees(found.bearing):.0f}°"


def _word(value: float, most: int) -> int:
    return round(min(max(value, -most), most))


def _motion(status: StatusFrame) -> Twist:
    speed = (status.left_speed + status.right_speed) / 2 / COUNTS_PER_SPEED
    return Twist(speed, status.yaw_rate / COUNTS_PER_RADIAN)


def _fallen(status: StatusFrame, faults: StatusBits) -> str | None:
    if not (StatusBits.PITCH_LIMIT | StatusBits.ROLL_LIMIT) & faults:
        return None
    pitch, roll = (math.degrees(count / COUNTS_PER_RADIAN) for count in (status.pitch, status.roll))
    return f"pitch {pitch:.0f}°, roll {roll:.0f}°: motors off"
