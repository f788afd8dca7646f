"""Signals between a robot's electronics and its body: readings come in, what its motors are to do goes out."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.odometry import Pulses


class LaserScan(Protocol):
    """One turn of a laser scanner, as whoever carries it gives it.

    ``ranges`` (n,) [m], counter-clockwise, ``inf`` where nothing came back; ``bearings`` (n,) [rad] from forward;
    ``points`` (n, 2) [m] are the beams' ends in the scanner's frame, x forward.
    """

    @property
    def ranges(self) -> NDArray[np.float32]: ...  # noqa: D102

    @property
    def bearings(self) -> NDArray[np.float64]: ...  # noqa: D102

    @property
    def points(self) -> NDArray[np.float64]: ...  # noqa: D102


class Inertial(NamedTuple):
    """Readings of the inertial sensors.

    ``pitch`` (nose down is positive) and ``roll`` (left side up) [rad], rates of pitch and yaw [rad/s].
    """

    pitch: float = 0.0
    roll: float = 0.0
    pitch_rate: float = 0.0
    yaw_rate: float = 0.0

    @property
    def finite(self) -> bool:
        """True if all readings are numbers."""
        return all(map(math.isfinite, self))


LEVEL = Inertial()


@dataclass(frozen=True, slots=True)
class Signals:
    """Readings of a robot's electronics at one ``time`` [s].

    ``pulses`` are the encoders' counters, ``torques`` what the motors give to the (left, right) wheel [N·m],
    ``bumpers`` the names of those that are pressed. ``sonar`` (n,) [m] and ``scan`` are the newest that there are, None
    where the robot has no such sensor or nobody asked for it.
    """

    time: float
    pulses: Pulses
    torques: tuple[float, float] = (0.0, 0.0)
    inertial: Inertial = LEVEL
    bumpers: frozenset[str] = field(default_factory=frozenset)
    sonar: NDArray[np.float64] | None = None
    scan: LaserScan | None = None


@dataclass(frozen=True, slots=True)
class Actuation:
    """Commands to the motors of the (left, right) wheel, in the unit of the robot's actuators; brakes hold them."""

    left: float = 0.0
    right: float = 0.0
    braked: bool = False
