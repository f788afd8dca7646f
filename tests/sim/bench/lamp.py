"""A wall evenly lit, drawn without a device, and what a camera makes of it."""

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.view import View
from refseq_bench.sim.cameras.camera import METER_STEP, CameraModel
from refseq_bench.sim.cameras.exposure import centre_weights
from refseq_bench.sim.rendering.renderer import RendererKind


class Lamp:
    """A renderer of a wall that is evenly lit by ``luminance`` [cd/m²], its left half dark if there is an ``edge``."""

    kind = RendererKind.FILAMENT

    def __init__(self, luminance: float) -> None:
        self.luminance = luminance
        self.edge = self.closed = False
        self.sizes: list[tuple[int, int]] = []
        self.around: list[float] = []

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        self.sizes.append((width, height))
        picture = np.full((height, width), self.luminance, np.float32)
        picture[:, : width // 2 if self.edge else 0] *= 0.2
        return picture

    def light_around(self, illuminance: Callable[[], float]) -> None:
        self.around.append(illuminance())

    def close(self) -> None:
        self.closed = True


def signal(view: View) -> float:
    """Signal before gamma as the light meter weighs it, as a share of full scale."""
    zones = (view.images["camera-1"][::METER_STEP, ::METER_STEP] / 255.0) ** CameraModel().gamma
    return float((centre_weights(*zones.shape) * zones).sum())
