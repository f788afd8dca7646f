"""From luminance to the bytes of a camera: lens, exposure control with lag, noise, gain, gamma.

Numbers and their tags (S read, C computed, M not verified, choice) as in ``docs/sim.md``.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.cameras.exposure import Exposure, ExposureControl, split_exposure, wanted_exposure
from refseq_bench.sim.cameras.lens import Lens, Optics
from refseq_bench.sim.cameras.sensor import WHITE, Sensor
from refseq_bench.sim.device_tables import TABLE, Number, require
from refseq_bench.sim.errors import SimError

METER_STEP = 8
"""The light meter takes a mean: every so many rows and columns are enough."""


@dataclass(frozen=True, slots=True)
class CameraModel:
    """Figures of a camera, those of a Unibrain Fire-i unless given; raises ``SimError`` for values none could have.

    ``gamma`` of the output; lens, sensor and exposure control have figures of their own.
    """

    __pydantic_config__ = TABLE
    gamma: Number = 2.2  # choice
    lens: Lens = field(default_factory=Lens)
    sensor: Sensor = field(default_factory=Sensor)
    exposure: ExposureControl = field(default_factory=ExposureControl)

    def __post_init__(self) -> None:
        require(0.0 < self.gamma < math.inf, "gamma", self.gamma, "> 0 and finite")
        self.optics()

    def optics(self) -> Optics:
        """The lens before the sensor."""
        return Optics(self.lens, self.sensor.pixel, self.sensor.size)

    @property
    def sensitivity(self) -> float:
        """Electrons that a pixel on the axis gathers from 1 cd/m² in 1 s.

        A lens of f-number N gives E = π T L / (4 N²) [lx] on the sensor (small angles, far subject; the usual camera
        equation). About 9000 for the Fire-i.
        """
        return math.pi * self.lens.transmission / (4.0 * self.lens.f_number**2) * self.sensor.electrons_per_lux_second


class Camera:
    """One camera: turns luminance into images and keeps its exposure from one to the next.

    Pictures of luminance are (height, width) [cd/m²], of the sensor's size, as the lens draws them (``optics.draw``).
    """

    def __init__(self, model: CameraModel, rng: np.random.Generator) -> None:
        self.model, self.optics = model, model.optics()
        self._rng = rng
        self._log_exposure: float | None = None  # ln(shutter · gain / 1 s)
        self._curve = _gamma_curve(model.gamma)

    @property
    def exposure(self) -> Exposure:
        """Exposure of the next frame; raises ``SimError`` before anything was seen."""
        if self._log_exposure is None:
            raise SimError("camera: no exposure before the first adapt() or expose()")
        return split_exposure(self.model.exposure, math.exp(self._log_exposure))

    def adapt(self, picture: NDArray[np.floating], dt: float) -> None:
        """Let the exposure control look at ``picture`` for ``dt`` [s].

        The logarithm of the exposure nears the one that the scene asks for with the time constant ``lag`` (first
        order); what is seen first sets it at once.
        """
        require(dt >= 0.0, "camera: dt", dt, ">= 0 s")
        self._check(picture)
        zones = np.s_[::METER_STEP, ::METER_STEP]
        signal = picture[zones] * self.optics.shading[zones] * (self.model.sensitivity / self.model.sensor.full_well)
        wanted = math.log(wanted_exposure(self.model.exposure, signal))
        if self._log_exposure is None:
            self._log_exposure = wanted
        self._log_exposure += (wanted - self._log_exposure) * -math.expm1(-dt / self.model.exposure.lag)

    def forget(self) -> None:
        """Forget the light: what is seen next sets the exposure at once."""
        self._log_exposure = None

    def digital(self, picture: NDArray[np.floating]) -> NDArray[np.uint16]:
        """Numbers of the converter for ``picture`` with the exposure as it is: linear in the light, 0 to 4095."""
        self._check(picture)
        if self._log_exposure is None:
            self.adapt(picture, 0.0)
        exposure, sensor = self.exposure, self.model.sensor
        mean = self.optics.blurred(picture) * self.optics.shading
        mean *= np.float32(self.model.sensitivity * exposure.shutter)
        return sensor.converted(sensor.read(mean, self._rng), exposure.gain)

    def expose(self, picture: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Take the image of ``picture`` with the exposure as it is."""
        return self._curve.take(self.digital(picture))

    def _check(self, picture: NDArray[np.floating]) -> None:
        height, width = picture.shape
        size = "{} × {}".format(*self.model.sensor.size)
        require((width, height) == tuple(self.model.sensor.size), "camera: picture", f"{width} × {height}", size)


def _gamma_curve(gamma: float) -> NDArray[np.uint8]:
    share = np.arange(WHITE + 1) / WHITE
    return np.round(255.0 * share ** (1.0 / gamma)).astype(np.uint8)
