"""Faults of signals: what a broken sensor, cable or driver makes of views on their way to the localiser.

Other than the faults of ``sim.bench.faults``, which the physics carries out, these need no simulator: they are made of
any recording's views.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from refseq.view import LASER, View
from refseq_bench.sim.device_tables import TABLE
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.sensors.arcs import in_arc


class SignalFaultKind(StrEnum):
    """Faults that views can be given."""

    CAMERA_BLANK = "camera-blank"
    CAMERA_FROZEN = "camera-frozen"
    CAMERAS_EXCHANGED = "cameras-exchanged"
    LASER_BLIND = "laser-blind"
    LASER_FROZEN = "laser-frozen"
    LASER_MIRRORED = "laser-mirrored"
    ODOMETRY_LOST = "odometry-lost"
    ODOMETRY_DOUBLED = "odometry-doubled"
    ODOMETRY_FROZEN = "odometry-frozen"
    ODOMETRY_REVERSED = "odometry-reversed"
    ODOMETRY_SCALED = "odometry-scaled"
    CLOCK_JUMPING = "clock-jumping"


CAMERAS_OF = {
    SignalFaultKind.CAMERA_BLANK: ("camera",),
    SignalFaultKind.CAMERA_FROZEN: ("camera",),
    SignalFaultKind.CAMERAS_EXCHANGED: ("camera", "other"),
}
"""Keys that name cameras, of the faults that have some."""

SIGNAL_FAULT_STREAM = 41
"""Keeps the faults' random numbers apart from those of drives, and of other faults, that have the same seed."""


@dataclass(frozen=True, slots=True)
class SignalFault:
    """A fault from ``at`` to ``until`` [m of the odometer's way in the drive].

    ``camera`` is the one that is blank or frozen, or whose pictures are exchanged with those of ``other``. Beams within
    ``width`` / 2 of ``bearing`` [degrees, to the left] are blind. Stamps jump by ``seconds``, ahead or back. A scaled
    odometer tells ``factor`` times its way and turns, as one does whose wheels are smaller than it was told.
    """

    __pydantic_config__ = TABLE
    kind: SignalFaultKind
    at: float = 0.0
    until: float = math.inf
    camera: str = ""
    other: str = ""
    bearing: float = 0.0
    width: float = 120.0
    seconds: float = -5.0
    factor: float = 1.1

    def __post_init__(self) -> None:
        if self.kind not in list(SignalFaultKind):
            raise SimError(f"unknown signal fault {str(self.kind)!r}: valid are {', '.join(SignalFaultKind)}")
        object.__setattr__(self, "kind", SignalFaultKind(self.kind))
        if not 0 <= self.at < self.until:
            raise SimError(f"fault {self.kind}: at = {self.at:g} m, until = {self.until:g} m; valid is 0 <= at < until")
        if not 0 < self.factor < math.inf:
            raise SimError(f"fault {self.kind}: factor = {self.factor} is not valid; it should be above 0, and finite")
        if not 0 < self.width <= 360:
            raise SimError(f"fault {self.kind}: width = {self.width} is not valid; it should be above 0, at most 360")
        for name in ("bearing", "seconds"):
            if not math.isfinite(getattr(self, name)):
                raise SimError(f"fault {self.kind}: {name} = {getattr(self, name)} is not valid; it should be finite")
        for name in CAMERAS_OF.get(self.kind, ()):
            if not getattr(self, name):
                raise SimError(f"fault {self.kind}: {name} is missing; valid is the name of a camera")

    @property
    def sensors(self) -> tuple[str, ...]:
        """The cameras that it is about, or the laser; none where it is about odometry or the clock."""
        if self.kind.startswith(LASER):
            return (LASER,)
        return tuple(getattr(self, name) for name in CAMERAS_OF.get(self.kind, ()))


def with_signal_faults(views: Iterable[View], faults: Sequence[SignalFault], seed: int = 0) -> Iterator[View]:
    """The views of a drive with several faults, each made of what those before it have left.

    All begin and end by the way that the views told before any fault. Raises ``SimError`` for a sensor that a view
    lacks, and at the end for a fault that no view had.
    """
    rngs = [np.random.default_rng((SIGNAL_FAULT_STREAM, seed, number)) for number in range(len(faults))]
    failing = [_Failing(fault, rng) for fault, rng in zip(faults, rngs, strict=True)]
    way = 0.0
    for view in views:
        way += abs(view.distance)
        told = view
        for one in failing:
            told = one.passed(told, way)
        yield told
    for fault, one in zip(faults, failing, strict=True):
        if not one.occurred:
            raise SimError(
                f"fault {fault.kind}: no view was taken from {fault.at:g} to {fault.until:g} m; valid is a stretch of "
                f"the {way:.1f} m driven that holds some"
            )


def with_signal_fault(views: Iterable[View], fault: SignalFault, seed: int = 0) -> Iterator[View]:
    """The views of a drive with a fault in their signals. Raises ``SimError`` for a sensor that a view lacks."""
    return with_signal_faults(views, (fault,), seed)


class _Failing:
    """A fault on the views of one drive, as they come; ``occurred`` once a view has had it."""

    def __init__(self, fault: SignalFault, rng: np.random.Generator) -> None:
        self._fault, self._rng = fault, rng
        self.occurred = False
        self._last: View | None = None

    def passed(self, view: View, way: float) -> View:
        """Return the view that was taken ``way`` [m] from the start as it is told, ill or well."""
        if self._fault.at <= way < self._fault.until:
            self.occurred = True
            self._last = view if self._last is None else self._last
            return _faulty(view, self._last, self._fault, self._rng)
        self._last = view
        return view


def _faulty(view: View, last: View, fault: SignalFault, rng: np.random.Generator) -> View:
    """A view with a fault; ``last`` is the last one before it began."""
    match fault.kind:
        case SignalFaultKind.CAMERA_BLANK:
            dark = rng.integers(0, 4, _image(view, fault.camera).shape, dtype=np.uint8)
            return _with(view, {fault.camera: dark})
        case SignalFaultKind.CAMERA_FROZEN:
            return _with(view, {fault.camera: _image(last, fault.camera)})
        case SignalFaultKind.CAMERAS_EXCHANGED:
            one, other = _image(view, fault.camera), _image(view, fault.other)
            return _with(view, {fault.camera: other, fault.other: one})
        case SignalFaultKind.LASER_BLIND | SignalFaultKind.LASER_FROZEN | SignalFaultKind.LASER_MIRRORED:
            return _with_scan(view, last, fault)
        case SignalFaultKind.CLOCK_JUMPING:
            return replace(view, time=view.time + fault.seconds)
        case _:
            return _with_odometry(view, fault)


def _with_scan(view: View, last: View, fault: SignalFault) -> View:
    scan, before = view.scan, last.scan
    if scan is None or before is None:
        raise SimError(f"fault {fault.kind}: a view has no sensor '{LASER}'")
    if fault.kind is SignalFaultKind.LASER_FROZEN:
        return replace(view, scan=before)
    if fault.kind is SignalFaultKind.LASER_MIRRORED:
        return replace(view, scan=replace(scan, ranges=scan.ranges[::-1].copy()))
    blind = in_arc(scan.bearings, math.radians(fault.bearing - fault.width / 2), math.radians(fault.width))
    return replace(view, scan=replace(scan, ranges=np.where(blind, np.inf, scan.ranges).astype(np.float32)))


def _with_odometry(view: View, fault: SignalFault) -> View:
    if fault.kind is SignalFaultKind.ODOMETRY_LOST:
        return replace(view, distance=0.0, turn=0.0, has_odometry=False)
    factors = {
        SignalFaultKind.ODOMETRY_DOUBLED: 2.0,
        SignalFaultKind.ODOMETRY_FROZEN: 0.0,
        SignalFaultKind.ODOMETRY_REVERSED: -1.0,
        SignalFaultKind.ODOMETRY_SCALED: fault.factor,
    }
    factor = factors[fault.kind]
    return replace(view, distance=factor * view.distance, turn=factor * view.turn)


def _image(view: View, camera: str) -> NDArray[np.uint8]:
    if camera not in view.images:
        valid = ", ".join(sorted(view.images)) or "none"
        raise SimError(f"a fault of camera '{camera}': a view has none; valid are {valid}")
    return view.images[camera]


def _with(view: View, images: dict[str, NDArray[np.uint8]]) -> View:
    return replace(view, images={**view.images, **images})
