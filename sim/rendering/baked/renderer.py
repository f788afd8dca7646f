"""Luminance by OpenGL, where the light on all that stands still is looked up, and only the sun's shadow is drawn."""

from collections.abc import Callable
from functools import partial
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.baked.batch import PLACE, Batch
from refseq_bench.sim.rendering.baked.model_lights import bake_lamps, sun_of
from refseq_bench.sim.rendering.baked.moving import moved, near
from refseq_bench.sim.rendering.baked.programs import Programs
from refseq_bench.sim.rendering.baked.still_light import Bake, light_still
from refseq_bench.sim.rendering.baked.sunlight import SunMap, column_major, frame_over
from refseq_bench.sim.rendering.baked.surfaces import picture_of, surfaces_of
from refseq_bench.sim.rendering.baked.triangles import Floats
from refseq_bench.sim.rendering.drivers import GL_PACKAGES, quiet_terminal
from refseq_bench.sim.rendering.frustum import eye_of
from refseq_bench.sim.rendering.renderer import BY_OPENGL, Closing, RendererKind, others_than

LONGEST = 0.4
"""Light varies linearly over pieces of walls and floors whose sides are not longer than this [m]: a choice."""
SAMPLES = 4
"""At edges a pixel is the mean of so many points of it."""
STILL_TEXELS, MOVING_TEXELS = 4096**2, 1024**2
"""Sizes of the sun's maps: in a corridor of 100 m a texel is 1 cm wide, in a car park 4 cm."""
DEVICE: dict[str, Any] = {"backend": "egl", "libgl": "libOpenGL.so.0", "libegl": "libEGL.so.1"}
"""The way to a device without a window, and the libraries as packages without development files bring them."""
NOTHING = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
PICTURE, SHEET, STILL_MAP, MOVING_MAP = range(4)
"""Units of the device from which the program reads."""


class BakedRenderer(Closing):
    """Draws by OpenGL with light that is baked: ``bake`` tells it, or the model's own lamps give it."""

    kind = RendererKind.BAKED

    def __init__(self, model: mujoco.MjModel, bake: Bake | None = None) -> None:
        self._model = model
        self._context: Any = _open()
        surfaces = surfaces_of(model, LONGEST)
        light = light_still(model, surfaces, bake or partial(bake_lamps, model))
        self._probes, self._sun = light.probes, sun_of(model)
        with self._context as context:
            context.enable_only(context.DEPTH_TEST)
            context.front_face = "cw"  # pictures are drawn upside down: their row 0 is the first in memory
            self._programs = Programs.of(context, sunny=self._sun.lux > 0.0)
            self._still = Batch(self._programs, surfaces, np.flatnonzero(surfaces.still), light.corners)
            self._moving = Batch(self._programs, surfaces, np.flatnonzero(~surfaces.still), light.corners)
            repeated = {look.texture for look in surfaces.finish if max(look.repeat) > 1.0}
            textures = {look.texture for look in surfaces.finish}
            self._pictures = {texture: self._picture(texture, texture in repeated) for texture in textures}
            self._sheet = _sheet(context, light.sheet)
            self._shine()
        self._targets: dict[tuple[int, int], _Target] = {}
        self._shade: SunMap | None = None

    def _picture(self, texture: int, repeated: bool) -> Any:
        """Load a texture, as light and not as codes, so that the mean of its pixels is their light's."""
        shown = picture_of(self._model, texture) if texture >= 0 else np.ones((1, 1))
        codes = np.round(shown * (2**16 - 1)).astype(np.uint16)
        loaded = self._programs.context.texture(shown.shape[::-1], 1, codes.tobytes(), alignment=1, dtype="nu2")
        loaded.build_mipmaps()
        loaded.repeat_x = loaded.repeat_y = repeated
        return loaded

    def _shine(self) -> None:
        """Tell the program of the sun, and draw the map of what it sees of all that stands still."""
        program, sun = self._programs.picture, self._sun
        program["picture"], program["sheet"] = PICTURE, SHEET
        if sun.lux <= 0.0:
            return
        program["sun"], program["towards_sun"] = sun.lux, tuple(sun.towards)
        program["still_map"], program["moving_map"] = STILL_MAP, MOVING_MAP
        places = self._still.vertices[self._still.casters, PLACE]
        self._still_map = self._cast(self._still, places, STILL_TEXELS)
        program["onto_still_map"].write(column_major(self._still_map.frame.matrix))

    def _cast(self, batch: Batch, places: NDArray[np.float32], texels: int) -> SunMap:
        """Draw a map of a batch over its places, (n, 3) [m]; an empty one where nothing throws a shadow."""
        if not self._sun.shadows or not len(places):
            return SunMap(self._programs.context, frame_over(NOTHING, self._sun.towards, 1))
        drawn = SunMap(self._programs.context, frame_over(places.astype(float), self._sun.towards, texels))
        drawn.draw(self._programs.depth, batch.cast)
        return drawn

    def radiance(self, data: mujoco.MjData, camera: str, width: int = 640, height: int = 480) -> NDArray[np.float32]:
        """See ``Renderer``. There are no mirrors and no gloss; colours count by their red channel: use greys."""
        if self._context is None:
            raise RendererError("renderer 'baked' is closed")
        seen = eye_of(self._model, data, camera)
        size = (width, height)
        with self._context:
            if size not in self._targets:
                self._targets[size] = _Target(self._context, width, height)
            self._place(data, np.array(seen.pos, float))
            return self._draw(seen, self._targets[size])

    def _place(self, data: mujoco.MjData, eye: Floats) -> None:
        """Put what moves where it is, and draw the map of its shadows."""
        vertices = moved(self._moving, data, self._probes)
        self._moving.write(vertices)
        if self._sun.lux <= 0.0:
            return
        program = self._programs.picture
        shade = self._cast(self._moving, near(self._moving, vertices, eye), MOVING_TEXELS)
        program["onto_moving_map"].write(column_major(shade.frame.matrix))
        program["texels"] = self._still_map.frame.texel, shade.frame.texel
        self._still_map.depth.use(STILL_MAP)
        shade.depth.use(MOVING_MAP)
        if self._shade is not None:
            self._shade.release()
        self._shade = shade

    def _draw(self, seen: mujoco.MjvGLCamera, target: "_Target") -> NDArray[np.float32]:
        program = self._programs.picture
        into, onto = into_camera(seen), onto_picture(seen, target.shape)
        program["into_camera"].write(column_major(into))
        program["onto_picture"].write(column_major(onto))
        self._sheet.use(SHEET)
        target.begin()
        self._still.draw(self._pictures, self._still.in_sight(sides(onto @ into), np.array(seen.pos, float)))
        self._moving.draw(self._pictures, self._moving.all)
        return target.read()

    def light_around(self, illuminance: Callable[[], float]) -> None:
        """See ``Renderer``: here each place has its own light, which stays as it is."""

    def close(self) -> None:
        """See ``Renderer``."""
        if self._context is not None:
            self._context.release()
        self._context = None


def into_camera(seen: mujoco.MjvGLCamera) -> Floats:
    """From the world into the camera's frame, which looks along −z, (4, 4)."""
    forward, up = np.array(seen.forward, float), np.array(seen.up, float)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([np.cross(forward, up), up, -forward])
    matrix[:3, 3] = -matrix[:3, :3] @ np.array(seen.pos, float)
    return matrix


def onto_picture(seen: mujoco.MjvGLCamera, shape: float) -> Floats:
    """Perspective of a picture whose width is ``shape`` times its height, its row 0 the first in memory, (4, 4).

    Nothing is too far away to be drawn.
    """
    near = seen.frustum_near
    bottom, top = seen.frustum_bottom, seen.frustum_top
    half = seen.frustum_width or shape * (top - bottom) / 2
    middle = seen.frustum_center
    return np.array(
        [
            [near / half, 0.0, middle / half, 0.0],
            [0.0, -2.0 * near / (top - bottom), -(top + bottom) / (top - bottom), 0.0],
            [0.0, 0.0, -1.0, -2.0 * near],
            [0.0, 0.0, -1.0, 0.0],
        ]
    )


def sides(matrix: Floats) -> Floats:
    """Planes left, below, right and above what a matrix (4, 4) maps onto a picture, their normals inwards, (4, 4)."""
    planes = np.concatenate([matrix[3] + matrix[:2], matrix[3] - matrix[:2]])
    return planes / np.linalg.norm(planes[:, :3], axis=1, keepdims=True)


def _sheet(context: Any, lux: NDArray[np.float32]) -> Any:
    """Load the light on flat faces."""
    rows, columns = lux.shape
    sheet = context.texture((columns, rows), 1, lux.tobytes(), alignment=4, dtype="f4")
    sheet.filter = context.LINEAR, context.LINEAR
    return sheet


class _Target:
    """A float picture of one size on the device, of several points a pixel, and the one that they are put into."""

    def __init__(self, context: Any, width: int, height: int) -> None:
        size = (width, height)
        self._context, self.shape = context, width / height
        self._pixels = (height, width)
        samples = min(SAMPLES, context.max_samples)
        colour = context.renderbuffer(size, 1, samples=samples, dtype="f4")
        self._drawn = context.framebuffer(colour, context.depth_renderbuffer(size, samples=samples))
        self._whole = context.framebuffer(context.renderbuffer(size, 1, dtype="f4"))

    def begin(self) -> None:
        self._drawn.use()
        self._drawn.clear()

    def read(self) -> NDArray[np.float32]:
        self._context.copy_framebuffer(self._whole, self._drawn)
        return np.frombuffer(self._whole.read(components=1, dtype="f4"), np.float32).reshape(self._pixels).copy()


def _open() -> Any:
    """A device without a window; raises ``RendererError``."""
    import moderngl

    try:
        with quiet_terminal():
            return moderngl.create_context(standalone=True, **DEVICE)
    except Exception as error:
        said = " ".join(str(error).split())
        raise RendererError(
            f"renderer 'baked' found no OpenGL by EGL ({said}): install the Debian packages {GL_PACKAGES} libopengl0 "
            f"('refseq doctor' tells more), or choose {others_than(*BY_OPENGL)}"
        ) from error
