"""Building site of a world: an ``MjSpec`` with the few kinds of parts that worlds are made of.

Geoms are in one of four groups. ``SOLID``: cameras see them, things touch them, laser beams end on them. ``SEEN``: for
cameras only. ``TOUCHED``: for things and beams, not for cameras. ``GLASS``: panes, which only beams notice. A geom's
first user value is its remission, what a laser gets back [share of white plaster]. All materials are grey and set up
for physically based shading.

A part is named by words with ``:`` between, which no name in a plan holds: ``door:d01:leaf``. So are materials and
pictures, but for the plan's own materials, which have their bare names.
"""

import zlib
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from refseq_bench.worlds.arrays import Block, Floats, Span
from refseq_bench.worlds.parts.greyscale import Image, srgb
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import Material

SOLID, SEEN, TOUCHED, GLASS = 0, 2, 3, 4
RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
ROLES = int(mujoco.mjtTextureRole.mjNTEXROLE)
EMISSIVE = int(mujoco.mjtTextureRole.mjTEXROLE_EMISSIVE)
BLACKEST = 1e-6
"""Least remission that a geom can tell: MuJoCo gives 0 to those that tell none. From 0.1 m on no laser sees it."""
TRIM, FRAME = "built-in:trim", "built-in:frame"
"""Materials of skirtings, nosings and frames of doors, and of frames of windows."""
Draw = Callable[[], Image]
"""Draws a picture when it is needed."""
UNIT_BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
BOX_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)
"""Triangles of a box over the corners of ``UNIT_BOX``, counter-clockwise from outside."""


class Site:
    """A spec under construction; ``seed`` and a part's name fix the drawing of its texture.

    Where it is not ``pictured`` none is drawn: drawing is most of the work, and only cameras notice.
    """

    def __init__(self, name: str, seed: int, pictured: bool = True) -> None:
        self.pictured = pictured
        self.spec = mujoco.MjSpec()
        self.spec.modelname = name
        self.spec.compiler.degree = False
        self.spec.nuser_geom = 1
        self._seed = seed
        self._echo: dict[str, float] = {}

    def rng(self, name: str) -> Generator:
        """Return the generator of the part called ``name``: adding a part does not redraw the others."""
        # The key is older than the names: pictures stay as they were drawn when these had underscores.
        key = name.removeprefix("built-in:").removeprefix("material:").replace(":", "_")
        return np.random.default_rng([self._seed, zlib.crc32(key.encode())])

    # --- materials ---

    def plain(self, name: str, material: Material) -> str:
        """Add a material of one albedo."""
        grey = float(srgb(material.albedo))
        self.spec.add_material(name=name, rgba=[grey, grey, grey, 1.0], **_matt(material.roughness))
        self._echo[name] = material.echo
        return name

    def picture(self, name: str, draw: Draw, like: Material) -> str:
        """Add a texture and a material that shows it once."""
        self.texture(name, draw)
        return self.papered(name, name, like)

    def papered(self, name: str, texture: str, like: Material, repeat: ArrayLike = (1.0, 1.0)) -> str:
        """Add a material that repeats a texture over each face; it is ``like`` another in all but the picture."""
        roles = self._roles(texture, RGB)
        self.spec.add_material(name=name, textures=roles, texrepeat=repeat, **_matt(like.roughness))
        self._echo[name] = like.echo
        return name

    def glowing(self, name: str, luminance: float, draw: Draw | None = None) -> str:
        """Add a dark material that gives light of its own [cd/m²], over the picture where there is one."""
        if draw is not None:
            self.texture(name, draw)
        roles = self._roles(name, RGB, EMISSIVE) if draw is not None else self._roles(name)
        self.spec.add_material(name=name, textures=roles, rgba=[0.05] * 3 + [1.0], emission=luminance, **_matt(1.0))
        return name

    def _roles(self, texture: str, *roles: int) -> list[str]:
        """Which texture a material has in each role: this one in those named, where there are pictures."""
        return [texture if self.pictured and role in roles else "" for role in range(ROLES)]

    def texture(self, name: str, draw: Draw) -> None:
        """Add a grey picture; row 0 is its upper edge."""
        if not self.pictured:
            return
        image = draw()
        height, width = image.shape
        texture = self.spec.add_texture(
            name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
        )
        texture.colorspace = mujoco.mjtColorSpace.mjCOLORSPACE_SRGB
        texture.data = np.repeat(image, 3).tobytes()  # Filament takes no one-channel textures

    def _stated(self, material: str) -> float:
        """A material's remission as its geoms tell it."""
        return max(self._echo[material], BLACKEST) if material in self._echo else 0.0

    # --- geometry ---

    def solid(self, name: str, frame: LocalFrame, block: Block, material: str, cast: bool = True) -> None:
        """Add a box that things bump into and beams end on."""
        self._box(name, frame, block, material, cast, SOLID)

    def shown(self, name: str, frame: LocalFrame, block: Block, material: str, cast: bool = False) -> None:
        """Add a box that only cameras see."""
        self._box(name, frame, block, material, cast, SEEN)

    def touched(self, name: str, frame: LocalFrame, block: Block, material: str) -> None:
        """Add a box that things bump into and beams end on, where what is seen is drawn apart."""
        self._box(name, frame, block, material, False, TOUCHED)

    def pane(self, name: str, frame: LocalFrame, block: Block) -> None:
        """Add a pane of glass, which only laser beams notice."""
        self._box(name, frame, block, "", False, GLASS)

    def _box(self, name: str, frame: LocalFrame, block: Block, material: str, cast: bool, group: int) -> None:
        spans = np.array(block)
        pos, size = frame.point(*spans.mean(axis=1)), np.diff(spans, axis=1)[:, 0] / 2
        kind = mujoco.mjtGeom.mjGEOM_BOX
        self.shape(name, kind, pos, size, material, group, quat=frame.box_quat, castshadow=cast)

    def panel(self, name: str, frame: LocalFrame, s: Span, out: float, z: Span, material: str) -> None:
        """Add a picture flat on a wall, ``out`` metres in front of it."""
        middle, extent = frame.point(sum(s) / 2, out, sum(z) / 2), (s[1] - s[0], z[1] - z[0])
        self.plane(name, middle, frame.panel_quat, extent, material)

    def plane(self, name: str, pos: ArrayLike, quat: ArrayLike, extent: Span, material: str) -> None:
        """Add a rectangle that only cameras see, of (width, height) ``extent`` [m]."""
        kind, size = mujoco.mjtGeom.mjGEOM_PLANE, [extent[0] / 2, extent[1] / 2, 1.0]
        self.shape(name, kind, pos, size, material, SEEN, quat=quat, castshadow=False)

    def lattice(self, name: str, frame: LocalFrame, blocks: list[Block], material: str, cast: bool = True) -> None:
        """Add several boxes as one geom that only cameras see; sparing geoms spares rendering time."""
        self.boxes(name, [(frame, block) for block in blocks], material, cast)

    def boxes(self, name: str, placed: list[tuple[LocalFrame, Block]], material: str, cast: bool = True) -> None:
        """Add several boxes, each in a frame of its own, as one geom that only cameras see."""
        corners = np.concatenate([_corners(frame, block) for frame, block in placed])
        faces = np.concatenate([_faces(frame) + 8 * i for i, (frame, _) in enumerate(placed)])
        self.mesh(name, uservert=corners.flatten(), userface=faces.flatten())
        self.meshed(name, name, material, SEEN, castshadow=cast)

    def mesh(self, name: str, **arrays: NDArray[Any]) -> None:
        """Add a mesh of flat faces, to be shown by any number of geoms."""
        mesh = self.spec.add_mesh(name=name, **arrays)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        mesh.smoothnormal = False

    def meshed(self, name: str, mesh: str, material: str, group: int = SOLID, **options: Any) -> None:
        """Add a geom that is a mesh."""
        placed = {"pos": [0.0] * 3, "size": [0.0] * 3, **options}
        self.shape(name, mujoco.mjtGeom.mjGEOM_MESH, material=material, group=group, meshname=mesh, **placed)

    def shape(
        self,
        name: str,
        kind: mujoco.mjtGeom,
        pos: ArrayLike,
        size: ArrayLike,
        material: str,
        group: int = SOLID,
        body: mujoco.MjsBody | None = None,
        **options: Any,
    ) -> None:
        """Add a geom of any kind to the world, or to another ``body``; its group tells whether things touch it."""
        touched = group in (SOLID, TOUCHED)
        if not touched:
            options["mass"] = 0.0
        (body or self.spec.worldbody).add_geom(
            name=name,
            type=kind,
            pos=pos,
            size=size,
            material=material,
            group=group,
            contype=int(touched),
            conaffinity=int(touched),
            userdata=[self._stated(material)],
            **options,
        )


def _matt(roughness: float) -> dict[str, float]:
    return {"roughness": roughness, "metallic": 0.0, "specular": 0.0}


def _corners(frame: LocalFrame, block: Block) -> Floats:
    spans = np.array(block)
    local = spans[:, 0] + UNIT_BOX * np.diff(spans, axis=1)[:, 0]
    level = frame.origin + local[:, :2] @ np.array([frame.along, frame.inward])
    return np.column_stack([level, local[:, 2]])


def _faces(frame: LocalFrame) -> NDArray[np.int64]:
    """Triangles of a box; a mirrored frame would turn them inside out, so there they go round the other way."""
    return BOX_FACES if frame.handed > 0 else BOX_FACES[:, ::-1]
