"""Individual robots of one make: how far wheels, rolling and mounts are from the drawing.

Two spreads are known. ``calibrated``: the drawing's robot, whose wheels were measured (UMBmark), as it always was.
``as-built``: nobody measured anything; sizes are taken from the drawing, sensors were screwed on by hand.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np

from refseq_bench.robots.errors import RobotsError
from refseq_bench.robots.motion import DifferentialDrive
from refseq_bench.robots.odometry import CalibrationErrors, Geometry, believed_geometry


@dataclass(frozen=True, slots=True)
class MountError:
    """A sensor's mount off the drawing, or standard deviations of that: raised [m], turned [rad], ``focal`` relative.

    Pan is to the left, tilt upwards, roll clockwise as seen from behind.
    """

    raised: float = 0.0
    pan: float = 0.0
    tilt: float = 0.0
    roll: float = 0.0
    focal: float = 0.0

    def __post_init__(self) -> None:
        for key, value in asdict(self).items():
            if not math.isfinite(value):
                raise RobotsError(f"mount: {key} = {value} must be finite")
        if not self.focal > -1:
            raise RobotsError(f"mount: focal = {self.focal} must be above -1")


@dataclass(frozen=True, slots=True)
class RobotSpread:
    """Spread of robots of one make.

    ``calibration`` is of the wheels; each robot rolls unevenly by a heading's random walk [rad/√m] between the two of
    ``walk``, evenly drawn of its logarithm, both 0 for none. ``camera`` and ``laser`` are the mounts.
    """

    calibration: CalibrationErrors = field(default_factory=CalibrationErrors)
    walk: tuple[float, float] = (0.0, 0.0)
    camera: MountError = field(default_factory=MountError)
    laser: MountError = field(default_factory=MountError)

    def __post_init__(self) -> None:
        low, high = self.walk
        if not (0 < low <= high < 1 or low == high == 0):
            raise RobotsError(f"robot spread: walk = {low}, {high} rad/√m must be rising and in (0, 1), or both 0")
        for name, mount in (("camera", self.camera), ("laser", self.laser)):
            for key, value in asdict(mount).items():
                if value < 0:
                    raise RobotsError(f"robot spread: {name}.{key} = {value} must be 0 or more")


@dataclass(frozen=True, slots=True)
class Individual:
    """One robot: what it ``believed`` of its wheels, its ``walk`` [rad/√m], errors of its mounts by name."""

    believed: Geometry
    walk: float
    cameras: Mapping[str, MountError]
    laser: MountError


CALIBRATED, AS_BUILT = "calibrated", "as-built"
_DEGREE = math.radians(1.0)
SPREADS: Mapping[str, RobotSpread] = {
    CALIBRATED: RobotSpread(),
    # Wheels within what raw logs of three robots show (docs/robots.md); mounts are choices: what a bubble level, a
    # ruler and the print on a lens leave.
    AS_BUILT: RobotSpread(
        calibration=CalibrationErrors(size=0.008, mismatch=0.003, track=0.02),
        walk=(0.6 * _DEGREE, 2.5 * _DEGREE),
        camera=MountError(raised=0.02, pan=1.5 * _DEGREE, tilt=_DEGREE, roll=0.5 * _DEGREE, focal=0.005),
        laser=MountError(raised=0.01, pan=0.5 * _DEGREE, tilt=0.3 * _DEGREE, roll=0.3 * _DEGREE),
    ),
}


def spread_named(name: str) -> RobotSpread:
    """Find a spread by its name. Raises ``RobotsError`` for an unknown one."""
    if name not in SPREADS:
        raise RobotsError(f"unknown robot spread {name!r}: valid are {', '.join(SPREADS)}")
    return SPREADS[name]


def built(drive: DifferentialDrive, cameras: Sequence[str], spread: RobotSpread, unit: int) -> Individual:
    """Build the robot of number ``unit``: the same number is the same robot, in all its drives.

    Raises ``RobotsError`` for a number below 0.
    """
    if unit < 0:
        raise RobotsError(f"robot: unit = {unit} is not valid; it should be 0 or more")
    rng = np.random.default_rng(unit)
    believed = believed_geometry(drive, spread.calibration, rng)
    low, high = spread.walk
    share = float(rng.random())
    walk = low * (high / low) ** share if low else 0.0
    laser = _mounted(spread.laser, rng)
    return Individual(believed, walk, {name: _mounted(spread.camera, rng) for name in cameras}, laser)


def _mounted(spread: MountError, rng: np.random.Generator) -> MountError:
    sigmas = (spread.raised, spread.pan, spread.tilt, spread.roll, spread.focal)
    return MountError(*(sigma * float(drawn) for sigma, drawn in zip(sigmas, rng.normal(size=5), strict=True)))
