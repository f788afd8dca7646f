"""MuJoCo's classic OpenGL renderer."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.errors import RendererError, SimError
from refseq_bench.sim.rendering.drivers import open_gl, quiet_terminal
from refseq_bench.sim.rendering.frustum import frustum
from refseq_bench.sim.rendering.renderer import Closing, RendererKind

CLASSIC_WHITE = 200.0
"""Luminance [cd/m²] that the classic renderer's white stands for: a choice, its light is not photometric."""
CLASSIC_GAMMA = 2.2
"""The classic renderer's colours are made for a screen: luminance is their power (usual value)."""
GREY_OF_RGB = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Luminance of the primaries (ITU-R BT.709)."""


class ClassicRenderer(Closing):
    """MuJoCo's classic OpenGL renderer: quick, but its light is neither photometric nor computed at every pixel.

    Sets ``offsamples`` to 0 and ``shadowsize`` to 1024 in the given model's ``vis.quality``: 4 to 30 times faster than
    MuJoCo's defaults on a CPU. A pixel's grey g of 255 is taken for (g / 255)^2.2 · ``CLASSIC_WHITE`` cd/m².
    """

    kind = RendererKind.CLASSIC

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._gl: Any = None
        self._context: Any = None
        model.vis.quality.offsamples = 0
        model.vis.quality.shadowsize = min(int(model.vis.quality.shadowsize), 1024)
        size = model.vis.global_
        self.backend, self._gl = open_gl(size.offwidth, size.offheight)
        with quiet_terminal():
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + model.nlight + 100)
        self._options = mujoco.MjvOption()

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """See ``Renderer``; raises ``SimError`` for a size beyond the model's off-screen buffer."""
        if self._context is None:
            raise RendererError("renderer 'classic' is closed")
        size = self._model.vis.global_
        if width > size.offwidth or height > size.offheight:
            raise SimError(f"image of {width}×{height} is beyond the model's {size.offwidth}×{size.offheight}")
        self._look(data, camera, width / height)
        self._gl.make_current()
        rgb, viewport = np.empty((height, width, 3), np.uint8), mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(viewport, self._scene, self._context)
        mujoco.mjr_readPixels(rgb, None, viewport, self._context)
        grey = (rgb[::-1] / np.float32(255) @ GREY_OF_RGB).astype(np.float32, copy=False)
        return np.float32(CLASSIC_WHITE) * grey ** np.float32(CLASSIC_GAMMA)

    def light_around(self, illuminance: Callable[[], float]) -> None:
        """See ``Renderer``: this one's light knows no amounts and stays as it is."""

    def _look(self, data: mujoco.MjData, camera: str, shape: float) -> None:
        seen, free = frustum(self._model, data, camera, shape), mujoco.MjvCamera()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        free.type, free.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, self._model.camera(camera).id
        mujoco.mjv_updateScene(self._model, data, self._options, None, free, everything, self._scene)
        for eye in self._scene.camera:
            for name in ("near", "bottom", "top", "center", "width"):
                setattr(eye, f"frustum_{name}", getattr(seen, f"frustum_{name}"))

    def close(self) -> None:
        """See ``Renderer``."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._gl.free()
        self._context = None
