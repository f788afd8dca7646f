"""What goes wrong on a drive, and where: each fault begins when the robot has come so far along its route.

The physics and the sensors do the rest: a kidnapped robot's wheels have not turned, a covered camera turns its gain up,
a wheel on a slick spins under the motor that regulates it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal

import numpy as np

from sim.errors import SimError
from sim.figures import TABLE

if TYPE_CHECKING:
    from sim.bench import Bench
    from sim.operator import Operator


@dataclass(frozen=True, slots=True)
class Kidnap:
    """Somebody carries the robot from ``at`` to ``to`` [m along the route]; it is set down looking along the route."""

    __pydantic_config__ = TABLE
    at: float
    to: float
    kind: Literal["kidnap"] = "kidnap"

    def __post_init__(self) -> None:
        _require_ways("kidnap", at=self.at, to=self.to)

    def begin(self, bench: "Bench", operator: "Operator") -> None:
        """Carry the robot, and let the operator go on from there."""
        bench.place(operator.carried(self.to))

    def over(self, progress: float, elapsed: float) -> bool:
        """At once."""
        return True

    def end(self, bench: "Bench") -> None:
        """Nothing is left to be undone."""


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

    def begin(self, bench: "Bench", operator: "Operator") -> None:
        """Cover the camera."""
        bench.cover(self.camera, True)

    def over(self, progress: float, elapsed: float) -> bool:
        """Once the robot has come far enough."""
        return progress >= self.until

    def end(self, bench: "Bench") -> None:
        """Uncover it."""
        bench.cover(self.camera, False)


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

    def begin(self, bench: "Bench", operator: "Operator") -> None:
        """Blind the beams."""
        bench.dazzle(np.radians([self.bearing - self.width / 2, self.bearing + self.width / 2]))

    def over(self, progress: float, elapsed: float) -> bool:
        """Once the robot has come far enough."""
        return progress >= self.until

    def end(self, bench: "Bench") -> None:
        """Let all beams measure again."""
        bench.dazzle(None)


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

    def begin(self, bench: "Bench", operator: "Operator") -> None:
        """Put the slick under the wheels."""
        bench.grip(self.wheels, self.friction)

    def over(self, progress: float, elapsed: float) -> bool:
        """After its time: a robot that spins on the spot comes no farther."""
        return elapsed >= self.seconds

    def end(self, bench: "Bench") -> None:
        """Give the tyres their own grip back."""
        bench.grip(self.wheels, None)


Fault = Kidnap | CameraBlack | LaserDazzled | WheelSlip
FAULTS = (Kidnap, CameraBlack, LaserDazzled, WheelSlip)


class Agenda:
    """The faults of a drive: looks how far the robot has come, begins what is due and ends what is over.

    Raises ``SimError`` for a fault that begins beyond the route's end, or that the robot cannot have.
    """

    def __init__(self, faults: Sequence[Fault], bench: "Bench", operator: "Operator") -> None:
        for fault in faults:
            _check(fault, bench, operator.length)
        self._bench, self._operator = bench, operator
        # Not by progress alone: a kidnapped robot may come past a place twice, and each fault happens once.
        self._coming = sorted(faults, key=lambda fault: fault.at)
        self._running: list[tuple[Fault, float]] = []

    def look(self) -> None:
        """Begin and end what is due now."""
        progress, time = self._operator.progress, self._bench.time
        while self._coming and progress >= self._coming[0].at:
            fault = self._coming.pop(0)
            fault.begin(self._bench, self._operator)
            self._running.append((fault, time))
            progress = self._operator.progress
        for entry in list(self._running):
            fault, began = entry
            if fault.over(progress, time - began):
                fault.end(self._bench)
                self._running.remove(entry)


def _check(fault: Fault, bench: "Bench", length: float) -> None:
    for field in fields(fault):
        if field.name in ("at", "to", "until") and getattr(fault, field.name) > length:
            far = getattr(fault, field.name)
            raise SimError(f"fault {fault.kind}: {field.name} = {far} m is beyond the route's end at {length:.1f} m")
    if isinstance(fault, CameraBlack) and fault.camera not in bench.robot.cameras:
        valid = ", ".join(bench.robot.cameras)
        raise SimError(f"fault {fault.kind}: camera '{fault.camera}' is not on {bench.robot.name}; valid are {valid}")


def _require_ways(kind: str, **ways: float) -> None:
    for name, value in ways.items():
        if not 0 <= value < np.inf:
            raise SimError(f"fault {kind}: {name} = {value} must be 0 m or more along the route")


def _require_stretch(kind: str, at: float, until: float) -> None:
    _require_ways(kind, at=at, until=until)
    if until <= at:
        raise SimError(f"fault {kind}: until = {until} m must be beyond at = {at} m")
