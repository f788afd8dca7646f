"""Faults of a drive: each begins when the robot has come so far along its route.

The physics and the sensors do the rest: a kidnapped robot's wheels have not turned, a covered camera turns its gain up,
a wheel on a slick spins under the motor that regulates it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np

from refseq.planar import Pose
from refseq_bench.robots.motion import WHEELS
from refseq_bench.sim.device_tables import TABLE
from refseq_bench.sim.errors import SimError

if TYPE_CHECKING:
    from refseq_bench.robots import Robot
    from refseq_bench.sim.bench.bench import Bench


@dataclass(frozen=True, slots=True)
class Kidnap:
    """Somebody carries the robot from ``at`` to ``to`` [m along the route]; it is set down looking along the route."""

    __pydantic_config__ = TABLE
    at: float
    to: float
    kind: Literal["kidnap"] = "kidnap"

    def __post_init__(self) -> None:
        _require_ways("kidnap", at=self.at, to=self.to)


@dataclass(frozen=True, slots=True)
class CameraBlack:
    """Something dark covers ``camera`` from ``at`` to ``until`` [m along the route]."""

    __pydantic_config__ = TABLE
    at: float
    until: float
    camera: str
    kind: Literal["camera-black"] = "camera-black"

    def __post_init__(self) -> None:
        _require_stretch("camera-black", self.at, self.until)

    def over(self, progress: float, elapsed: float) -> bool:
        """Once the robot has come far enough."""
        return progress >= self.until


@dataclass(frozen=True, slots=True)
class LaserDazzled:
    """The sun or a lamp shines into the laser from ``at`` to ``until`` [m along the route].

    Beams within ``width`` / 2 of ``bearing`` [degrees from straight ahead, to the left] then measure nothing.
    """

    __pydantic_config__ = TABLE
    at: float
    until: float
    bearing: float = 0.0
    width: float = 180.0
    kind: Literal["laser-dazzled"] = "laser-dazzled"

    def __post_init__(self) -> None:
        _require_stretch("laser-dazzled", self.at, self.until)
        if not 0 < self.width <= 360:
            raise SimError(f"fault laser-dazzled: width = {self.width} must be above 0 and at most 360 degrees")
        if not -180 <= self.bearing <= 180:
            raise SimError(f"fault laser-dazzled: bearing = {self.bearing} must be from -180 to 180 degrees")

    @property
    def arc(self) -> tuple[float, float]:
        """Bearings between which beams are blind [rad], the second counter-clockwise of the first."""
        return math.radians(self.bearing - self.width / 2), math.radians(self.bearing + self.width / 2)

    def over(self, progress: float, elapsed: float) -> bool:
        """Once the robot has come far enough."""
        return progress >= self.until


@dataclass(frozen=True, slots=True)
class WheelSlip:
    """For ``seconds`` from ``at`` [m along the route] on the driven wheels stand on something slick.

    ``friction`` is the coefficient there; ``wheels`` which of them. What the odometer then counts, and how far the
    robot gets, is up to the physics.
    """

    __pydantic_config__ = TABLE
    at: float
    seconds: float
    wheels: Literal["both", "left", "right"] = "both"
    friction: float = 0.02
    kind: Literal["wheel-slip"] = "wheel-slip"

    def __post_init__(self) -> None:
        _require_ways("wheel-slip", at=self.at)
        if not 0 < self.seconds < np.inf:
            raise SimError(f"fault wheel-slip: seconds = {self.seconds} must be positive")
        if not 0 < self.friction <= 2:
            raise SimError(f"fault wheel-slip: friction = {self.friction} must be above 0 and at most 2")

    def over(self, progress: float, elapsed: float) -> bool:
        """After its time: a robot that spins on the spot comes no farther."""
        return elapsed >= self.seconds


Lasting = CameraBlack | LaserDazzled | WheelSlip
Fault = Kidnap | Lasting
FAULTS = (Kidnap, CameraBlack, LaserDazzled, WheelSlip)


class Traveller(Protocol):
    """Progress of a robot on its way: of ``length`` [m] in all, as far as can be told, it is ``progress`` [m]."""

    @property
    def length(self) -> float:
        """The whole way [m]."""

    @property
    def progress(self) -> float:
        """Part of it that is behind the robot [m]."""

    def carried(self, to: float) -> Pose:
        """The robot is carried so far along the way [m]; returns where it is set down."""


class FaultSchedule:
    """The faults of a drive: looks how far the robot has come, begins what is due and ends what is over.

    Each fault happens once, also where the robot is carried back and passes its place again; those that it is carried
    past do not happen, and one whose stretch it is carried out of is over. Faults that overlap add up: of two slicks
    under a wheel the slicker one counts. Raises ``SimError`` for a fault that begins beyond the route's end, or that
    the robot cannot have.
    """

    def __init__(self, faults: Sequence[Fault], bench: "Bench", traveller: Traveller) -> None:
        for fault in faults:
            check_fault(fault, bench.robot, traveller.length)
        self._bench, self._traveller = bench, traveller
        self._coming = sorted(faults, key=lambda fault: fault.at)
        self._running: list[tuple[Lasting, float]] = []

    def look(self) -> None:
        """Begin and end what is due now."""
        before = list(self._running)
        while self._coming and self._traveller.progress >= self._coming[0].at:
            self._begin(self._coming.pop(0))
        progress, time = self._traveller.progress, self._bench.time
        self._running = [(fault, began) for fault, began in self._running if not fault.over(progress, time - began)]
        if self._running != before:
            self._impose()

    def _begin(self, fault: Fault) -> None:
        if isinstance(fault, Kidnap):
            self._bench.place(self._traveller.carried(fault.to))
            self._coming = [other for other in self._coming if not _within(other, fault)]
            self._running = [one for one in self._running if not _is_before(one[0], fault)]
        else:
            self._running.append((fault, self._bench.time))

    def _impose(self) -> None:
        """Let the bench feel all that runs, and nothing else."""
        faults = [fault for fault, _ in self._running]
        slicks = [fault for fault in faults if isinstance(fault, WheelSlip)]
        self._bench.covered = frozenset(fault.camera for fault in faults if isinstance(fault, CameraBlack))
        self._bench.dazzle([fault.arc for fault in faults if isinstance(fault, LaserDazzled)])
        for wheel in WHEELS:
            self._bench.grip(wheel, min((s.friction for s in slicks if s.wheels in ("both", wheel)), default=None))


def _within(fault: Fault, kidnap: Kidnap) -> bool:
    """True if all of a fault lies where a kidnapped robot is carried past."""
    end = fault.until if isinstance(fault, CameraBlack | LaserDazzled) else fault.at
    return kidnap.at <= fault.at < kidnap.to and end <= kidnap.to


def _is_before(fault: Lasting, kidnap: Kidnap) -> bool:
    """True if a kidnapped robot is set down before the stretch of a fault."""
    return isinstance(fault, CameraBlack | LaserDazzled) and kidnap.to < fault.at


def check_fault(fault: Fault, robot: "Robot", length: float) -> None:
    """Raise ``SimError`` for a fault that a drive of ``length`` [m] by this robot cannot have."""
    for field in fields(fault):
        if field.name in ("at", "to", "until"):
            check_driven(fault.kind, field.name, getattr(fault, field.name), length)
    if isinstance(fault, CameraBlack) and fault.camera not in robot.cameras:
        valid = ", ".join(robot.cameras)
        raise SimError(f"fault {fault.kind}: camera '{fault.camera}' is not on {robot.name}; valid are {valid}")


def check_driven(kind: str, name: str, way: float, length: float) -> None:
    """Raise ``SimError`` for a fault of some ``kind`` whose ``name`` lies beyond the ``length`` that is driven [m]."""
    if way > length:
        raise SimError(
            f"fault {kind}: {name} = {way:g} m is beyond the end of what is driven; valid is 0 to {length:.1f} m"
        )


def _require_ways(kind: str, **ways: float) -> None:
    for name, value in ways.items():
        if not 0 <= value < np.inf:
            raise SimError(f"fault {kind}: {name} = {value} must be 0 m or more along the route")


def _require_stretch(kind: str, at: float, until: float) -> None:
    _require_ways(kind, at=at, until=until)
    if until <= at:
        raise SimError(f"fault {kind}: until = {until} m must be beyond at = {at} m")
