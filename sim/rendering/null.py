"""The renderer of a bench without cameras."""

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import Closing, RendererKind, others_than


class NullRenderer(Closing):
    """Draws nothing: the bench takes no images with it."""

    kind = RendererKind.NONE

    def __init__(self, model: mujoco.MjModel) -> None:
        del model

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """Raise ``SimError``: there is nothing to see."""
        raise SimError(f"renderer 'none' has no image of camera '{camera}': choose {others_than(self.kind)}")

    def light_around(self, illuminance: Callable[[], float]) -> None:
        """See ``Renderer``: there is nothing to light."""
