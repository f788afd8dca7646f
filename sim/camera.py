"""From luminance to the bytes of a camera: exposure control with lag, noise, gain, gamma (model: Unibrain Fire-i).

Numbers and their tags (S read, C computed, M not verified, choice) as in `docs/sim.md`.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.errors import SimError

_PHOTONS_PER_LUX_SECOND = 4.09e15
"""Photons on a square metre in a second at one lux: 1 / 683 W/m² of 3.58e-19 J each, all light at 555 nm."""
_MOST = 1 << 12
"""Steps of the analogue-digital converter: 12 bits, a choice."""
_BISECTIONS = 40
_METER = (64, 48)
"""Zones of the light meter, (columns, rows): a choice; larger pictures are averaged down to them."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Figures of a camera; raises ``SimError`` for values that none could have.

    ``pixel`` pitch [m]; ``f_number``; ``transmission`` of the lens and ``quantum_efficiency`` in 0…1; ``full_well``
    and ``read_noise`` [electrons]; ``gamma`` of the output; ``blur``: width σ of the lens' image of a point [pixels].
    Exposure control: ``target`` is the mean signal aimed at, as a share of full scale before gamma; ``lag`` [s] is its
    time constant; ``shutter`` [s] and ``gain`` are (least, most).
    """

    pixel: float = 5.6e-6  # C
    f_number: float = 2.0  # choice, as all below without a tag
    transmission: float = 0.9
    quantum_efficiency: float = 0.4
    full_well: float = 16_000.0  # M: 13 to 20 thousand
    read_noise: float = 20.0  # M: 15 to 25
    gamma: float = 2.2
    blur: float = 0.5
    target: float = 0.18
    lag: float = 0.3
    shutter: tuple[float, float] = (1e-4, 1 / 15)
    gain: tuple[float, float] = (1.0, 16.0)

    def __post_init__(self) -> None:
        for name in ("pixel", "f_number", "transmission", "quantum_efficiency", "full_well", "gamma", "target", "lag"):
            _require(getattr(self, name) > 0.0, name, getattr(self, name), "> 0")
        for name in ("read_noise", "blur"):
            _require(getattr(self, name) >= 0.0, name, getattr(self, name), ">= 0")
        for name in ("transmission", "quantum_efficiency"):
            _require(getattr(self, name) <= 1.0, name, getattr(self, name), "<= 1")
        _require(self.target < 1.0, "target", self.target, "< 1")
        for name in ("shutter", "gain"):
            least, most = getattr(self, name)
            _require(0.0 < least <= most, name, (least, most), "0 < least <= most")

    @property
    def sensitivity(self) -> float:
        """Electrons a pixel gathers from 1 cd/m² in 1 s.

        A lens of f-number N gives E = π T L / (4 N²) [lx] on the sensor (small angles, far subject; the usual camera
        equation); a pixel of area a turns a share QE of its photons into electrons. About 9000 for the Fire-i.
        """
        illuminance = math.pi * self.transmission / (4.0 * self.f_number**2)
        return illuminance * self.pixel**2 * _PHOTONS_PER_LUX_SECOND * self.quantum_efficiency


def _require(holds: bool, name: str, value: object, valid: str) -> None:
    if not holds:
        raise SimError(f"camera: {name} = {value} is not {valid}")


@dataclass(frozen=True, slots=True)
class Exposure:
    """What a frame is taken with: ``shutter`` [s] and analogue ``gain``."""

    shutter: float
    gain: float


class Camera:
    """One camera: turns luminance into images and keeps its exposure from one to the next."""

    def __init__(self, model: CameraModel, rng: np.random.Generator) -> None:
        self._model, self._rng = model, rng
        self._log_exposure: float | None = None  # ln(shutter · gain / 1 s)
        self._curve = _gamma_curve(model.gamma)

    @property
    def exposure(self) -> Exposure:
        """What the next frame is taken with; raises ``SimError`` before anything was seen."""
        if self._log_exposure is None:
            raise SimError("camera: no exposure before the first adapt() or expose()")
        return split_exposure(self._model, math.exp(self._log_exposure))

    def adapt(self, radiance: NDArray[np.floating], dt: float) -> None:
        """Let the exposure loop look at ``radiance`` (height, width) [cd/m²] for ``dt`` [s].

        The logarithm of the exposure nears the one that the scene asks for with the time constant ``lag`` (first
        order); what is seen first sets it at once. A small picture will do, only its weighted mean counts.
        """
        if not dt >= 0.0:
            raise SimError(f"camera: dt = {dt} s is not >= 0")
        wanted = math.log(wanted_exposure(self._model, radiance))
        if self._log_exposure is None:
            self._log_exposure = wanted
        self._log_exposure += (wanted - self._log_exposure) * -math.expm1(-dt / self._model.lag)

    def expose(self, radiance: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Take the image of ``radiance`` (height, width) [cd/m²] with the exposure as it is."""
        if self._log_exposure is None:
            self.adapt(radiance, 0.0)
        electrons = gather(self._model, blurred(self._model, radiance), self.exposure.shutter, self._rng)
        electrons *= np.float32(self.exposure.gain / self._model.full_well * (_MOST - 1))
        np.clip(electrons, 0.0, _MOST - 1, out=electrons)
        electrons += np.float32(0.5)
        return self._curve[electrons.astype(np.uint16)]


def gather(
    model: CameraModel, radiance: NDArray[np.floating], shutter: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Electrons read from each pixel, shape as ``radiance`` [cd/m²], after ``shutter`` [s].

    Shot noise (variance n for n electrons) and read noise come from one normal draw of variance n + r². With r = 20
    electrons the exact sum, a Poisson and a normal variable, has a skewness n / (n + r²)^1.5 below 0.02 for every n:
    nobody could tell, and the draw takes a tenth of the time. No pixel holds more than ``full_well``.
    """
    mean = np.multiply(radiance, np.float32(model.sensitivity * shutter), dtype=np.float32)
    np.maximum(mean, 0.0, out=mean)
    electrons = rng.standard_normal(mean.shape, dtype=np.float32)
    electrons *= np.sqrt(mean + np.float32(model.read_noise**2))
    electrons += mean
    return np.minimum(electrons, np.float32(model.full_well), out=electrons)


def blurred(model: CameraModel, radiance: NDArray[np.floating]) -> NDArray[np.float32]:
    """``radiance`` as the lens draws it on the sensor: each point a Gaussian of σ = ``blur`` pixels."""
    sharp = np.asarray(radiance, np.float32)
    if model.blur == 0.0:
        return sharp
    return cv2.GaussianBlur(sharp, (0, 0), model.blur, borderType=cv2.BORDER_REPLICATE)


def wanted_exposure(model: CameraModel, radiance: NDArray[np.floating]) -> float:
    """The exposure, shutter [s] times gain, that brings the weighted mean signal to ``target``, within the limits.

    The mean is taken of what the sensor could tell, so pixels beyond full scale count as full scale: a sun patch on
    the floor does not black out the hallway. It rises with the exposure; bisection on the logarithm finds it.
    """
    zones = _zones(radiance)
    weights, signal = centre_weights(*zones.shape), zones * (model.sensitivity / model.full_well)
    low, high = (math.log(limit) for limit in exposure_limits(model))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if np.sum(weights * np.minimum(signal * math.exp(middle), 1.0)) < model.target:
            low = middle
        else:
            high = middle
    return math.exp((low + high) / 2)


def _zones(radiance: NDArray[np.floating]) -> NDArray[np.float64]:
    height, width = radiance.shape
    size = (min(width, _METER[0]), min(height, _METER[1]))
    return cv2.resize(np.asarray(radiance, np.float64), size, interpolation=cv2.INTER_AREA)


def exposure_limits(model: CameraModel) -> tuple[float, float]:
    """Least and most of shutter times gain [s]."""
    return model.shutter[0] * model.gain[0], model.shutter[1] * model.gain[1]


def split_exposure(model: CameraModel, product: float) -> Exposure:
    """Shutter and gain of a given product [s]: a longer shutter first, as it adds no noise, then gain."""
    shutter = float(np.clip(product / model.gain[0], *model.shutter))
    return Exposure(shutter, float(np.clip(product / shutter, *model.gain)))


def centre_weights(height: int, width: int) -> NDArray[np.float64]:
    """Weights of a light meter, (height, width), sum 1: the centre counts three times the middle of an edge."""
    rows, columns = (0.5 + np.sin(np.pi * (np.arange(n) + 0.5) / n) for n in (height, width))
    weights = np.outer(rows, columns)
    return weights / weights.sum()


def _gamma_curve(gamma: float) -> NDArray[np.uint8]:
    share = np.arange(_MOST) / (_MOST - 1)
    return np.round(255.0 * share ** (1.0 / gamma)).astype(np.uint8)
