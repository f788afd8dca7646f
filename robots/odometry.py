"""Odometry as a robot has it: encoder pulses of its wheels and what it believes of their size, never the truth."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.motion import DifferentialDrive
from refseq_bench.robots.planar import PlanarPose


class Pulses(NamedTuple):
    """Readings of both wheels' counters: whole numbers, NaN where one cannot be read."""

    left: float
    right: float

    @property
    def finite(self) -> bool:
        """True if both can be read."""
        return math.isfinite(self.left) and math.isfinite(self.right)


@dataclass(frozen=True, slots=True)
class Encoders:
    """Incremental encoders that count ``pulses_per_turn`` in one turn of a wheel."""

    pulses_per_turn: int

    def __post_init__(self) -> None:
        if self.pulses_per_turn < 1:
            raise RobotsError(f"encoders: pulses_per_turn = {self.pulses_per_turn}: at least 1 is needed")

    def read(self, left: float, right: float) -> Pulses:
        """Return the counters at the wheels' angles [rad]: a pulse is counted when the wheel has passed it."""
        return Pulses(self._counted(left), self._counted(right))

    def _counted(self, angle: float) -> float:
        counted = angle * self.pulses_per_turn / (2 * np.pi)
        return math.floor(counted) if math.isfinite(counted) else math.nan

    def angle(self, pulses: float) -> float:
        """Return the turn of a wheel [rad] that makes so many pulses."""
        return 2 * np.pi * pulses / self.pulses_per_turn


@dataclass(frozen=True, slots=True)
class CalibrationErrors:
    """Errors of a calibrated robot's believed geometry, one standard deviation each, relative.

    ``size`` is common to both wheels, ``mismatch`` is the right wheel's excess over the left one, ``track`` the
    axle's. The defaults are choices: a calibrated drive does about ten times better than CARMEN's loose motion model
    (rotation by translation 0.01 rad/m, translation by translation 0.2): 0.001 rad/m on a track of 0.62 m is a
    mismatch of 0.06 %; size and track, which are seen on the odometer at once, are taken as known to 0.3 %.
    """

    size: float = 0.003
    mismatch: float = 0.0006
    track: float = 0.003

    def __post_init__(self) -> None:
        for key in ("size", "mismatch", "track"):
            if not 0 <= getattr(self, key) < 0.1:
                raise RobotsError(f"calibration: {key} = {getattr(self, key)} must be in [0, 0.1)")


@dataclass(frozen=True, slots=True)
class Geometry:
    """Radii of the wheels [m] and track [m] as the robot believes them."""

    left_radius: float
    right_radius: float
    track: float


def true_geometry(drive: DifferentialDrive) -> Geometry:
    """Return what a robot without any error would believe."""
    return Geometry(drive.wheel_radius, drive.wheel_radius, drive.track)


def believed_geometry(drive: DifferentialDrive, errors: CalibrationErrors, rng: np.random.Generator) -> Geometry:
    """Draw what one robot believes after its calibration: once, for all its drives."""
    size, mismatch, track = rng.normal(0.0, 1.0, 3) * (errors.size, errors.mismatch, errors.track)
    return Geometry(
        left_radius=drive.wheel_radius * (1 + size - mismatch / 2),
        right_radius=drive.wheel_radius * (1 + size + mismatch / 2),
        track=drive.track * (1 + track),
    )


_ZERO = Pulses(0, 0)


class Odometry:
    """Integrates the pose from pulses; starts at the origin, with the counters at ``start``."""

    def __init__(self, geometry: Geometry, encoders: Encoders, start: Pulses = _ZERO) -> None:
        self.pose = PlanarPose(0.0, 0.0, 0.0)
        self.distance = 0.0
        """Signed path length since the start [m]: backwards counts negative."""
        self._geometry = geometry
        self._encoders = encoders
        self._last = start

    def update(self, pulses: Pulses) -> PlanarPose:
        """Move on to counters at ``pulses`` and return the pose there; its heading is not wrapped."""
        geometry = self._geometry
        left = self._encoders.angle(pulses.left - self._last.left) * geometry.left_radius
        right = self._encoders.angle(pulses.right - self._last.right) * geometry.right_radius
        self._last = pulses
        length = float(left + right) / 2
        self.distance += length
        self.pose = along_arc(self.pose, length, (right - left) / geometry.track)
        return self.pose


def along_arc(pose: PlanarPose, length: float, turn: float) -> PlanarPose:
    """Drive an arc of ``length`` [m] that turns by ``turn`` [rad]: exact, its chord is length · sinc(turn/2)."""
    half = turn / 2
    chord = length * np.sin(half) / half if half else length
    middle = pose.heading + half
    return PlanarPose(
        float(pose.x + chord * np.cos(middle)), float(pose.y + chord * np.sin(middle)), float(pose.heading + turn)
    )
