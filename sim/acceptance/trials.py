"""Acceptance measurements of a robot on an empty floor, measured against what was asked for and against mechanics.

Each trial takes a fresh bench. Positions are those of the middle of the axle, which does not lean with the robot.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots import Limits, Twist
from refseq_bench.robots.sensor_mast import LATERAL_HEIGHT
from refseq_bench.robots.state import STANDS, Cause
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD

Floats = NDArray[np.float64]
Command = Callable[[float], Twist]
"""The command at a time since the start [s]."""

SETTLING = 3.0
"""A robot stands so long before it is measured, and after it was told to stop [s]; a choice."""
PUSH_TIME = 0.2
"""A push lasts so long [s]; a choice, between a blow and what a hand does."""
UPRIGHT = math.radians(5)
"""A robot that leans less than this stands [rad]; a choice."""


@dataclass(frozen=True, slots=True)
class Track:
    """Where the robot truly was, from where it began: it stood at the origin and headed along x.

    ``times`` (n,) [s], ``points`` of its axle (n, 2) [m], ``headings`` (n,) [rad], not wrapped, ``pitches`` (n,) [rad],
    nose down positive.
    """

    times: Floats
    points: Floats
    headings: Floats
    pitches: Floats

    @property
    def along(self) -> float:
        """Distance covered along its first heading [m]."""
        return float(self.points[-1, 0])

    @property
    def aside(self) -> float:
        """Distance covered to the left of it [m]."""
        return float(self.points[-1, 1])

    @property
    def turned(self) -> float:
        """Angle turned [rad]."""
        return float(self.headings[-1])

    @property
    def speeds(self) -> Floats:
        """Speed along the first heading between two moments, (n - 1,) [m/s]."""
        return np.diff(self.points[:, 0]) / np.diff(self.times)

    @property
    def excursion(self) -> float:
        """Greatest distance from where it began [m]."""
        return float(np.hypot(*self.points.T).max())


def follow(bench: Bench, command: Command, seconds: float, each: Callable[[], None] = lambda: None) -> Track:
    """Command the robot for so long and look at it after every control period; ``each`` is called before one."""
    began, rows = bench.time, [_look(bench)]
    while bench.time - began < seconds - 1e-9:
        each()
        bench.drive(command(bench.time - began))
        rows.append(_look(bench))
    times, x, y, headings, pitches = np.array(rows).T
    headings = np.unwrap(headings)
    forward, left = _turned(x - x[0], y - y[0], -headings[0])
    return Track(times - times[0], np.stack([forward, left], axis=1), headings - headings[0], pitches)


def _look(bench: Bench) -> tuple[float, float, float, float, float]:
    pose, lean = bench.pose, bench.data.body(bench.named(bench.robot.base)).xmat
    return bench.time, pose.x, pose.y, pose.heading, math.atan2(-lean[6], lean[8])


def _turned(x: Floats, y: Floats, angle: float) -> tuple[Floats, Floats]:
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def stand(_: float) -> Twist:
    """The command to stand."""
    return Twist()


# --- driving ---


@dataclass(frozen=True, slots=True)
class Ramp:
    """A way to go ``amount`` [m or rad] and stop: faster evenly, steadily on, slower evenly."""

    amount: float
    speed: float
    acceleration: float

    @property
    def rise(self) -> float:
        """Time that it gets faster [s]."""
        return min(self.speed / self.acceleration, math.sqrt(self.amount / self.acceleration))

    @property
    def seconds(self) -> float:
        """Time of all [s]."""
        top = self.rise * self.acceleration
        return self.amount / top + self.rise

    def at(self, elapsed: float) -> float:
        """The speed at a time [m/s or rad/s]."""
        return self.acceleration * max(0.0, min(elapsed, self.rise, self.seconds - elapsed))


def straight(bench: Bench, length: float = 10.0, share: float = 0.8) -> tuple[float, Track]:
    """Drive ``length`` [m] straight at a ``share`` of what the robot is let.

    Returns the distance that was commanded, a hair off ``length`` as commands come in steps, and the track until it
    stands again.
    """
    ramp = Ramp(length, share * bench.robot.limits.speed, share * bench.robot.limits.acceleration)
    return _ramped(bench, ramp, lambda speed: Twist(speed, 0.0))


def turn(bench: Bench, angle: float = 2 * math.pi, share: float = 0.8) -> tuple[float, Track]:
    """Turn on the spot by ``angle`` [rad]; see ``straight``."""
    limits = bench.robot.limits
    ramp = Ramp(angle, share * limits.turn_rate, share * limits.angular_acceleration)
    return _ramped(bench, ramp, lambda rate: Twist(0.0, rate))


def _ramped(bench: Bench, ramp: Ramp, twist: Callable[[float], Twist]) -> tuple[float, Track]:
    follow(bench, stand, SETTLING)
    asked: list[float] = []

    def command(elapsed: float) -> Twist:
        asked.append(ramp.at(elapsed + CONTROL_PERIOD / 2))
        return twist(asked[-1])

    track = follow(bench, command, ramp.seconds + SETTLING)
    return sum(asked) * CONTROL_PERIOD, track


@dataclass(frozen=True, slots=True)
class Braking:
    """Coming to a stop: ``speed`` [m/s] at the command to stop, ``distance`` [m] and ``seconds`` from it to rest."""

    speed: float
    distance: float
    seconds: float


def braking(bench: Bench, share: float = 1.0) -> Braking:
    """Drive at a ``share`` of the top mission speed, and stop at once."""
    limits = bench.robot.limits
    follow(bench, stand, SETTLING)
    follow(bench, lambda _: Twist(share * limits.speed, 0.0), limits.speed / limits.acceleration + SETTLING)
    before = follow(bench, lambda _: Twist(share * limits.speed, 0.0), 1.0)
    track = follow(bench, stand, limits.speed / limits.acceleration + 2 * SETTLING)
    moving = np.flatnonzero(np.abs(track.speeds) > STANDS)
    last = int(moving[-1]) + 1 if moving.size else 0
    return Braking(float(before.speeds.mean()), float(track.points[:, 0].max()), float(track.times[last]))


def braking_distance(limits: Limits, speed: float) -> float:
    """Way that stopping from ``speed`` [m/s] takes at the most that the robot is let slow down [m]: v² / 2a."""
    return speed**2 / (2 * limits.acceleration)


def first_move(bench: Bench, seconds: float = 1.0) -> float:
    """Command the top mission speed from rest; returns how far back it rolled first [m], 0 or less."""
    follow(bench, stand, SETTLING)
    track = follow(bench, lambda _: Twist(bench.robot.limits.speed, 0.0), seconds)
    return float(track.points[:, 0].min())


# --- standing ---


def standing(bench: Bench, seconds: float = 60.0) -> Track:
    """Stand, told to."""
    follow(bench, stand, SETTLING)
    return follow(bench, stand, seconds)


@dataclass(frozen=True, slots=True)
class Pushed:
    """Outcome of a push: greatest ``pitch`` [rad] and ``excursion`` [m], end ``off`` by [m], if it ``stands``."""

    pitch: float
    excursion: float
    off: float
    stands: bool


def push(
    bench: Bench,
    impulse: float = 50.0,
    seconds: float = 15.0,
    *,
    height: float = LATERAL_HEIGHT,
    duration: float = PUSH_TIME,
) -> Pushed:
    """Push the mast forward with ``impulse`` [N·s] for a ``duration`` [s], ``height`` [m] above the floor; look on."""
    follow(bench, stand, SETTLING)
    body = bench.model.body(bench.named(bench.robot.base)).id
    began, periods = bench.time, math.ceil(duration / CONTROL_PERIOD - 1e-9)
    newtons = impulse / (periods * CONTROL_PERIOD)

    def pushing() -> None:
        wrench, data = bench.data.xfrc_applied[body], bench.data
        wrench[:] = 0.0
        if bench.time - began < (periods - 0.5) * CONTROL_PERIOD:
            arm = data.xpos[body] + height * data.xmat[body].reshape(3, 3)[:, 2] - data.xipos[body]
            wrench[:3] = newtons * math.cos(bench.pose.heading), newtons * math.sin(bench.pose.heading), 0.0
            wrench[3:] = np.cross(arm, wrench[:3])

    track = follow(bench, stand, seconds, pushing)
    upright = abs(float(track.pitches[-1])) < UPRIGHT
    stands = upright and Cause.TIPPED not in {stop.cause for stop in bench.state.stops}
    return Pushed(float(np.abs(track.pitches).max()), track.excursion, float(np.hypot(*track.points[-1])), stands)


def balances(bench: Bench) -> bool:
    """True if it stands on its two drive wheels alone, so that it would fall without its motors."""
    follow(bench, stand, SETTLING)
    bodies = bench.model.geom_bodyid[bench.data.contact.geom]  # (contacts, 2)
    touching = {int(body) for pair in bodies if 0 in pair for body in pair} - {0}
    return touching == {int(bench.model.joint(bench.named(n)).bodyid[0]) for n in bench.robot.wheel_joints}


def energy_growth(bench: Bench, seconds: float = 60.0) -> float:
    """Mechanical energy at rest, of the last tenth of the time less that of the first tenth [J]."""
    bench.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    follow(bench, stand, SETTLING)
    energies: list[float] = []
    follow(bench, stand, seconds, lambda: energies.append(float(bench.data.energy.sum())))
    tenth = max(1, len(energies) // 10)
    return float(np.mean(energies[-tenth:]) - np.mean(energies[:tenth]))


def times_real_time(bench: Bench, seconds: float = 20.0) -> float:
    """Simulated over the processor's time of a drive with the laser looked at all the time, without cameras."""

    def look() -> None:
        bench.scan()

    began = time.process_time()
    follow(bench, lambda _: Twist(bench.robot.limits.speed / 2, 0.1), seconds, look)
    return seconds / (time.process_time() - began)
