"""What a camera sees before it becomes an image: luminance [cd/m²] of every pixel, by one of three renderers."""

import copy
from collections.abc import Callable
from enum import StrEnum
from typing import Any, NamedTuple, Protocol, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.errors import RendererError, SimError
from sim.rendering.drivers import open_gl, quiet_terminal, require_vulkan

LUMINANCE_OF_ONE = 1.2 * 2.0 ** np.log2(16.0**2 * 125.0)
"""Luminance [cd/m²] of a Filament pixel of 1.0: 38400.

Filament multiplies with the exposure 1 / (1.2 · 2^EV100); a camera that nobody set has f/16, 1/125 s and ISO 100, hence
EV100 = log2(16² · 125) (Filament's documentation, 'Physically based camera')."""
CLASSIC_WHITE = 200.0
"""Luminance [cd/m²] that the classic renderer's white stands for: a choice, its light is not photometric."""
CLASSIC_GAMMA = 2.2
"""The classic renderer's colours are made for a screen: luminance is their power (usual value)."""
GREY_OF_RGB = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Luminance of the primaries (ITU-R BT.709)."""
MANY_LAMPS = 30
"""From so many lights without shadow on, those with shadows are drawn apart. Measured on 2 cores without a GPU, in a
hallway of 100 m under a sun with shadow: 40 lamps, a third less time apart; 18, up to a third more."""
CLIP_NEAR = 0.05
"""Nothing nearer to a camera [m] is drawn; a choice. MuJoCo's own limit grows with the size of the world."""
WIDTH_TO_HEIGHT = 4 / 3
"""Shape of a picture of which nothing else is said."""
RAYS = (33, 25)
"""Rays across and down that look for the farthest thing in a picture: one every 20 pixels."""
NEARBY = 10.0
"""Only a picture in which all rays end nearer than this [m] gets a far plane of its own. In a deep one, as down a
hallway, the farthest things are the smallest, and a grid of rays would miss them."""
SMALLEST = (4, 3)
"""Width and height of a picture that nobody looks at [pixels]."""
FILAMENT_SETTINGS = {
    "filament.ao.enabled": 0.0,
    "filament.fallback.head_light_intensity": 0.0,
    "filament.fallback.scene_light_intensity": 0.0,
    "filament.fallback.environment_light_intensity": 0.0,
    "filament.phong.emissive_multiplier": 1.0 / LUMINANCE_OF_ONE,
}
"""Custom numbers of a model that Filament reads; ``prepare_spec`` gives the reasons."""


class RendererKind(StrEnum):
    """The ways to draw that a user can ask for."""

    FILAMENT = "filament"
    CLASSIC = "classic"
    NONE = "none"


class Renderer(Protocol):
    """Draws what a model's cameras see."""

    kind: RendererKind

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """Luminance [cd/m²] of each pixel, (height, width), a fresh array; the row 0 is the top one."""
        ...

    def light_around(self, illuminance: float) -> None:
        """Let the light that comes from all sides alike give so much [lx] from the next picture on."""
        ...

    def close(self) -> None:
        """Give the device back; closing twice is fine, drawing afterwards is a ``RendererError``."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


class Closing:
    """What holds a device: ``with`` closes it."""

    def close(self) -> None:
        """Nothing to give back."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def open_renderer(kind: RendererKind | str, model: mujoco.MjModel) -> Renderer:
    """The renderer of that kind for a compiled model.

    Raises ``SimError`` for an unknown kind, ``RendererError`` where its driver is missing: no other one steps in.
    """
    try:
        return _RENDERERS[RendererKind(kind)](model)
    except ValueError:
        valid = ", ".join(RendererKind)
        raise SimError(f"unknown renderer '{kind}': valid are {valid}") from None


def prepare_spec(spec: mujoco.MjSpec) -> None:
    """Set what the renderers want to know of a world before it is compiled; numbers that are there already stay.

    Ambient occlusion off: it is reckoned from the pixels of the frame, so it would change with the view and its size.
    Fallback lights off: Filament lights a world without lamps by itself, but such a night is dark. Emission of a
    material then counts in cd/m² (times its albedo for classic materials), not in Filament's scale for the latter.
    """
    present = {number.name for number in spec.numerics}
    for name, value in FILAMENT_SETTINGS.items():
        if name not in present:
            spec.add_numeric(name=name, data=[value])


def farthest(
    model: mujoco.MjModel, data: mujoco.MjData, seen: mujoco.MjvGLCamera, shape: float = WIDTH_TO_HEIGHT
) -> float:
    """Distance of the farthest thing that a grid of rays through the picture meets [m]; infinite if one meets nothing.

    A shadow map is spread over all that lies before the far plane, so a far plane just behind what is there makes sun
    patches sharp: a camera that faces a wall at 1 m needs none of the 100 m beside it.
    """
    right = np.cross(seen.forward, seen.up)
    half_height = (seen.frustum_top - seen.frustum_bottom) / 2 / seen.frustum_near
    # MuJoCo leaves the width at 0 where the picture's own shape sets it.
    half_width = seen.frustum_width / seen.frustum_near or shape * half_height
    across, down = (axis.ravel() for axis in np.meshgrid(np.linspace(-1, 1, RAYS[0]), np.linspace(-1, 1, RAYS[1])))
    rays = (
        np.asarray(seen.forward)[None, :]
        + half_width * across[:, None] * right[None, :]
        + half_height * down[:, None] * np.asarray(seen.up)[None, :]
    )
    lengths = np.linalg.norm(rays, axis=1)
    distances, geoms = np.empty(len(rays)), np.empty(len(rays), np.int32)
    mujoco.mj_multiRay(
        model,
        data,
        np.asarray(seen.pos, float),
        (rays / lengths[:, None]).ravel(),
        mujoco.MjvOption().geomgroup,  # only what is drawn: what lies behind a window's pane is seen
        1,
        -1,
        geoms,
        distances,
        None,
        len(rays),
        mujoco.mjMAXVAL,
    )
    return float(np.inf if (distances < 0).any() else (distances / lengths).max())


def frustum(
    model: mujoco.MjModel, data: mujoco.MjData, camera: str, shape: float = WIDTH_TO_HEIGHT
) -> mujoco.MjvGLCamera:
    """Pose and frustum of a named camera, its near plane at ``CLIP_NEAR``; ``shape`` is width to height of the picture.

    Raises ``SimError`` for an unknown name.
    """
    names = [model.camera(i).name for i in range(model.ncam)]
    if camera not in names:
        raise SimError(f"unknown camera '{camera}': the model has {', '.join(names) or 'none'}")
    view = mujoco.MjvCamera()
    view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera(camera).id
    seen = mujoco.mjv_camera2GLCamera(model, data, view)
    scale = CLIP_NEAR / seen.frustum_near
    seen.frustum_near = CLIP_NEAR
    for side in ("frustum_bottom", "frustum_top", "frustum_center", "frustum_width"):
        setattr(seen, side, scale * getattr(seen, side))
    reach = farthest(model, data, seen, shape)
    if reach < NEARBY:
        # Twice as far, and a little more: what shows in a gap between two rays must not be cut off.
        seen.frustum_far = min(seen.frustum_far, 2.0 * reach + 2.0)
    return seen


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

    def light_around(self, illuminance: float) -> None:
        """See ``Renderer``; a world without an image light stays as it is."""
        image = self._model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
        self._model.light_intensity[image] = illuminance / np.pi  # read at the scene's next update

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
    """Which lights throw shadows, (nlight,)."""
    image = model.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE
    return (model.light_castshadow != 0) & ~image & (model.light_active != 0) & (model.light_intensity > 0)


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

    def light_around(self, illuminance: float) -> None:
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


class NullRenderer(Closing):
    """Draws nothing: the bench takes no images with it."""

    kind = RendererKind.NONE

    def __init__(self, model: mujoco.MjModel) -> None:
        del model

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """Raise ``SimError``: there is nothing to see."""
        raise SimError(f"renderer 'none' has no image of camera '{camera}': choose 'filament' or 'classic'")

    def light_around(self, illuminance: float) -> None:
        """See ``Renderer``: there is nothing to light."""


_RENDERERS: dict[RendererKind, Callable[[mujoco.MjModel], Renderer]] = {
    RendererKind.FILAMENT: FilamentRenderer,
    RendererKind.CLASSIC: ClassicRenderer,
    RendererKind.NONE: NullRenderer,
}
