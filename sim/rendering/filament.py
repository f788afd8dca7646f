"""MuJoCo's Filament renderer through Vulkan: linear luminance under photometric lights."""

import copy
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.drivers import quiet_terminal, require_vulkan
from refseq_bench.sim.rendering.frustum import frustum
from refseq_bench.sim.rendering.native_output import dropping_lines
from refseq_bench.sim.rendering.renderer import Closing, RendererKind

LUMINANCE_OF_ONE = 1.2 * 2.0 ** np.log2(16.0**2 * 125.0)
"""Luminance [cd/m²] of a Filament pixel of 1.0: 38400.

Filament multiplies with the exposure 1 / (1.2 · 2^EV100); a camera that nobody set has f/16, 1/125 s and ISO 100, hence
EV100 = log2(16² · 125) (Filament's documentation, 'Physically based camera')."""
MANY_LAMPS = 30
"""From so many lights without shadow on, those with shadows are drawn apart. Measured on 2 cores without a GPU, in a
hallway of 100 m under a sun with shadow: 40 lamps, a third less time apart; 18, up to a third more."""
SMALLEST = (4, 3)
"""Width and height of a picture that nobody looks at [pixels]."""
UNTIMED_FRAME = b"FrameInfo's circular queue is full"
"""Beginning of the line, one a frame, by which Filament tells that it will not time a frame: the thread that waits for
earlier ones has not run yet, on a machine with more to do than cores. The picture is drawn all the same."""
FILAMENT_SETTINGS = {
    "filament.ao.enabled": 0.0,
    "filament.fallback.head_light_intensity": 0.0,
    "filament.fallback.scene_light_intensity": 0.0,
    "filament.fallback.environment_light_intensity": 0.0,
    "filament.phong.emissive_multiplier": 1.0 / LUMINANCE_OF_ONE,
}
"""Custom numbers of a model that Filament reads; ``prepare_spec`` gives the reasons."""


def prepare_spec(spec: mujoco.MjSpec) -> None:
    """Set what the renderers want to know of a world before it is compiled; numbers that are there already stay.

    Ambient occlusion off: it is reckoned from the pixels of the frame, so it would change with the view and its size;
    it costs a fifth of a frame on a software renderer, for faint shade in corners.
    Fallback lights off: Filament lights a world without lamps by itself, but such a night is dark. Emission of a
    material then counts in cd/m² (times its albedo for classic materials), not in Filament's scale for the latter.
    """
    present = {number.name for number in spec.numerics}
    for name, value in FILAMENT_SETTINGS.items():
        if name not in present:
            spec.add_numeric(name=name, data=[value])


class FilamentRenderer(Closing):
    """MuJoCo's Filament through Vulkan: linear luminance under photometric lights.

    Light adds up, so lights with shadows and many without are drawn apart and added: together, every lamp that throws
    no shadow would run through the shadow's part of the shader too.
    """

    kind = RendererKind.FILAMENT

    def __init__(self, model: mujoco.MjModel) -> None:
        require_vulkan()
        self._model = copy.copy(model)  # an own one: its emission is switched on and off
        self._emission = model.mat_emission.copy()
        with quiet_terminal() as written:
            try:
                self._open()
            except Exception as error:
                written.seek(0)
                said = " ".join(written.read().decode(errors="replace").split())
                raise RendererError(f"renderer 'filament' could not start: {error} {said}".rstrip()) from error

    def _open(self) -> None:
        # Registers Filament's materials; without it the context fails to open them.
        import mujoco.studio._studio  # noqa: F401
        from mujoco import mjrf
        from mujoco.rendering.filament.model_scene import ModelScene

        self._mjrf = mjrf
        config = mjrf.ContextConfig()
        config.graphics_api = mjrf.GraphicsApi.GRAPHICS_API_VULKAN  # its OpenGL needs an X server
        self._context = mjrf.Context(config)
        self._scene = ModelScene(self._context, self._model)
        self._passes = split_lights(self._model)
        self._shining = np.ones(self._model.nlight, bool)
        self._targets: dict[tuple[int, int], _Target] = {}
        self._settled = False
        self._context.flush()

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """See ``Renderer``. Mirrors (``reflectance``) show no image; colours count by their red channel: use greys."""
        if self._context is None:
            raise RendererError("renderer 'filament' is closed")
        seen, size = frustum(self._model, data, camera, width / height), (width, height)
        if not self._settled:
            self._settle(data, seen)
            self._settled = True
        if size not in self._targets:
            self._targets[size] = _Target(self._context, width, height)
            # The first frame of a size differs from its repetitions in a few pixels, now and then: it is discarded.
            self._draw(data, seen, self._targets[size])
        return self._draw(data, seen, self._targets[size])

    def light_around(self, illuminance: Callable[[], float]) -> None:
        """See ``Renderer``; a world without an image light stays as it is."""
        image = self._model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
        self._model.light_intensity[image] = illuminance() / np.pi  # read at the scene's next update

    def _settle(self, data: mujoco.MjData, seen: mujoco.MjvGLCamera) -> None:
        """Take all things out of the scene and let them in again one by one, a frame each.

        Where two surfaces are equally near to the last bit, as in a pixel on the line in which they meet, the one that
        is drawn first is seen. Filament orders its drawing by what it allots to each thing at its first frame, and to
        those of one frame it allots in another order in each context. Costs 5 ms a thing.
        """
        self._scene.update(data)
        shown = np.flatnonzero(mujoco.MjvOption().geomgroup[self._model.geom_group])
        things = [self._scene.get_renderable(mujoco.mjtObj.mjOBJ_GEOM, int(geom)) for geom in shown]
        target = _Target(self._context, *SMALLEST)
        for thing in things:
            self._scene.scene.remove_renderable(thing)
        self._frame(seen, target, self._passes[0], shadows=False)
        for thing in things:
            self._scene.scene.add_renderable(thing)
            self._frame(seen, target, self._passes[0], shadows=False)

    def _draw(self, data: mujoco.MjData, seen: mujoco.MjvGLCamera, target: "_Target") -> NDArray[np.float32]:
        total = np.zeros_like(target.pixels)
        for drawn in self._passes:
            self._switch(drawn)
            self._scene.update(data)
            self._frame(seen, target, drawn)
            total += target.pixels
        total *= LUMINANCE_OF_ONE
        return total

    def _frame(self, seen: mujoco.MjvGLCamera, target: "_Target", drawn: "LightSplit", *, shadows: bool = True) -> None:
        request = self._request(seen, target, drawn)
        request.shadows = shadows
        with dropping_lines(UNTIMED_FRAME):
            self._context.wait_for_frame(self._context.render([request], [target.read]))

    def _switch(self, drawn: "LightSplit") -> None:
        for index in np.flatnonzero(drawn.lights != self._shining):
            change = self._scene.scene.add_light if drawn.lights[index] else self._scene.scene.remove_light
            change(self._scene.get_light(int(index)))
        self._shining = drawn.lights
        self._model.mat_emission[:] = self._emission if drawn.glows else 0.0  # read at the scene's next update

    def _request(self, seen: mujoco.MjvGLCamera, target: "_Target", drawn: "LightSplit") -> Any:
        request = self._mjrf.RenderRequest()
        request.scene, request.target = self._scene.scene, target.target
        request.camera = self._mjrf.Camera(
            pos=seen.pos,
            forward=seen.forward,
            up=seen.up,
            frustum_bottom=seen.frustum_bottom,
            frustum_top=seen.frustum_top,
            frustum_center=seen.frustum_center,
            frustum_width=seen.frustum_width,
            frustum_near=seen.frustum_near,
            frustum_far=seen.frustum_far,
        )
        request.viewport.width, request.viewport.height = target.size
        # With post-processing a pixel would be tone-mapped, clipped at one and dithered anew in every frame.
        request.post_processing = request.reflections = request.haze = False
        request.skybox = drawn.glows
        return request

    def close(self) -> None:
        """See ``Renderer``."""
        # The context frees the device when the last object made by it is gone: it has no close of its own.
        self._targets = {}
        self._scene = None
        self._context = None


class _Target:
    """A float picture of one size on the device, and the buffer that it is read into."""

    def __init__(self, context: Any, width: int, height: int) -> None:
        from mujoco import mjrf

        config = mjrf.RenderTargetConfig()
        config.color_format = mjrf.PixelFormat.PIXEL_FORMAT_R32F
        self.size = (width, height)
        self.target = context.create_render_target(config)
        self.target.resize(width, height)
        self.pixels = np.zeros((height, width), np.float32)
        self.read = mjrf.ReadRequest()
        self.read.target = self.target
        self.read.set_buffer(self.pixels)


class LightSplit(NamedTuple):
    """One drawing pass: ``lights`` (nlight,) that shine, and whether what ``glows`` (and the sky) counts."""

    lights: NDArray[np.bool_]
    glows: bool


def split_lights(model: mujoco.MjModel) -> list[LightSplit]:
    """The passes that draw a model: all at once, or lights without shadows and all that glows, then the others."""
    shadowed, lamp = casts_shadow(model), model.light_type != mujoco.mjtLightType.mjLIGHT_IMAGE
    if shadowed.any() and np.sum(lamp & ~shadowed) >= MANY_LAMPS:
        return [LightSplit(~shadowed, glows=True), LightSplit(shadowed, glows=False)]
    return [LightSplit(np.ones(model.nlight, bool), glows=True)]


def casts_shadow(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Mask of the lights that throw shadows, (nlight,)."""
    image = model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
    return (model.light_castshadow != 0) & ~image & (model.light_active != 0) & (model.light_intensity > 0)
