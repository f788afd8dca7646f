"""All that a model shows, as triangles: which body moves each, what it looks like, and what keeps light off others."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq_bench.sim.rendering.baked.charts import Sheet
from refseq_bench.sim.rendering.baked.shapes import Faces, faces_of, shape_of
from refseq_bench.sim.rendering.baked.triangles import HALVES, Floats, Triangles

RGB = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
WHITE = 255.0
PIECES = 120
"""Light is known at no more than so many points along a great surface's side: a choice, every 0.7 m of 8000 m²."""
LOOSE = 3.0
"""Edges of a mesh's triangles may be so many times longer than sides of cells: each costs time in every picture."""


@dataclass(frozen=True, slots=True)
class Finish:
    """A geom's look: ``albedo`` [share], ``emission`` [cd/m²], both times its picture ``texture``, -1: without one."""

    albedo: float
    emission: float
    texture: int
    repeat: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Triangles of several geoms in the frame of their bodies.

    For each triangle: ``geom`` (n,), ``body`` (n,) or 0 for all that never moves, and whether its light is on the
    ``sheet``, at ``chart`` (n, 3, 2) [texels]; (0, 0): it is not. ``finish`` tells the look of each geom.
    """

    triangles: Triangles
    chart: Floats
    geom: NDArray[np.intp]
    body: NDArray[np.intp]
    finish: tuple[Finish, ...]
    casts: NDArray[np.bool_]
    """Geoms that throw shadows, (ngeom,)."""
    flat: NDArray[np.bool_]
    """Geoms that are planes, without thickness, (ngeom,)."""
    closed: NDArray[np.bool_]
    """Geoms that nobody sees from behind, (ngeom,): all but meshes, which may be a dome, or leaves."""
    sheet: Sheet
    sheet_geom: NDArray[np.intp]
    """The geom of each of the sheet's charts, (k,)."""

    def __len__(self) -> int:
        return len(self.geom)

    @property
    def still(self) -> NDArray[np.bool_]:
        """Tell which triangles never move, (n,)."""
        return self.body == 0

    @property
    def charted(self) -> NDArray[np.bool_]:
        """Tell which triangles have their light on the sheet, (n,)."""
        return self.chart[:, 0, 0] > 0.0


def surfaces_of(model: mujoco.MjModel, longest: float) -> Surfaces:
    """Lay out all geoms that cameras see; light on what never moves is to be known every ``longest`` [m].

    What glows needs none: it shows light of its own.
    """
    layout = _Layout(model, longest)
    shown = np.flatnonzero(mujoco.MjvOption().geomgroup[model.geom_group]).tolist()
    parts = [layout.lay(geom) for geom in shown]
    counts = [len(part.triangles) for part in parts]
    # All together: hundreds of small meshes, each cut by itself, took more than half of this function's time.
    pieces, of = Triangles.joined([part.triangles for part in parts]).cut(np.repeat([p.longest for p in parts], counts))
    geom_of = np.repeat(shown, counts)[of]
    by_geom = np.argsort(geom_of, kind="stable")
    geom_of = geom_of[by_geom]
    moved = np.array([body if moves(model, body) else 0 for body in range(model.nbody)])
    return Surfaces(
        triangles=pieces[by_geom],
        chart=np.concatenate([part.chart for part in parts])[of[by_geom]],
        geom=geom_of,
        body=moved[model.geom_bodyid[geom_of]],
        finish=layout.finish,
        casts=model.geom_castshadow != 0,
        flat=model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE,
        closed=model.geom_type != mujoco.mjtGeom.mjGEOM_MESH,
        sheet=layout.sheet,
        sheet_geom=np.array(layout.laid, np.intp),
    )


class _Part(NamedTuple):
    """A geom's ``triangles``, where their corners are on the sheet, ``chart`` (n, 3, 2) [texels], and how far to cut.

    Edges are to be no longer than ``longest`` [m].
    """

    triangles: Triangles
    chart: Floats
    longest: float


class _Layout:
    """Puts geoms where they are, and lays out the faces of those that stand still on a sheet."""

    def __init__(self, model: mujoco.MjModel, longest: float) -> None:
        self._model, self._longest, self._rest = model, longest, mujoco.MjData(model)
        mujoco.mj_kinematics(model, self._rest)
        self.finish = tuple(finish_of(model, geom) for geom in range(model.ngeom))
        self.sheet, self.laid = Sheet(), list[int]()

    def lay(self, geom: int) -> _Part:
        """Put one geom where it is."""
        still, finish = not moves(self._model, int(self._model.geom_bodyid[geom])), self.finish[geom]
        place, rotation = self._placed(geom, still)
        shape, faces = shape_of(self._model, geom).placed(place, rotation), faces_of(self._model, geom)
        chart, longest = np.zeros((len(shape), 3, 2)), math.inf
        if still and not finish.emission:
            step = max(self._longest, math.sqrt(shape.area) / PIECES)
            if faces is None:
                longest = LOOSE * step
            else:
                chart = _charted(self.sheet, faces, place, rotation, step)
                self.laid += [geom] * len(faces.corners)
        return _Part(Triangles(shape.corners, shape.normals, shape.uv * finish.repeat), chart, longest)

    def _placed(self, geom: int, still: bool) -> tuple[Floats, Floats]:
        """Position (3,) and rotation (3, 3) of a geom: in the world where it stands still, else in its body's frame."""
        if still:
            return self._rest.geom_xpos[geom], self._rest.geom_xmat[geom].reshape(3, 3)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._model.geom_quat[geom])
        return self._model.geom_pos[geom], rotation.reshape(3, 3)


def _charted(sheet: Sheet, faces: Faces, place: Floats, rotation: Floats, step: float) -> Floats:
    """Lay out faces; returns where the corners of their triangles are on the sheet, (n, 3, 2) [texels]."""
    laid = [sheet.lay(face @ rotation.T + place, step).corners[HALVES] for face in faces.corners]
    return np.concatenate(laid)


def moves(model: mujoco.MjModel, body: int) -> bool:
    """Tell whether a body is anything but a part of the world: it has joints, or is put from place to place."""
    return bool(model.body_weldid[body] != 0 or model.body_mocapid[body] >= 0)


def finish_of(model: mujoco.MjModel, geom: int) -> Finish:
    """Look up a geom's material; colours count by their red channel, encoded as sRGB."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return Finish(float(linear(model.geom_rgba[geom, 0])), 0.0, -1, (1.0, 1.0))
    albedo = float(linear(model.mat_rgba[material, 0]))
    # MuJoCo's classic materials, which tell no roughness, take their emission as a share of their colour.
    share = albedo if model.mat_roughness[material] < 0 else 1.0
    repeat = (float(model.mat_texrepeat[material, 0]), float(model.mat_texrepeat[material, 1]))
    return Finish(albedo, share * float(model.mat_emission[material]), int(model.mat_texid[material, RGB]), repeat)


def picture_of(model: mujoco.MjModel, texture: int) -> Floats:
    """Share of the light that each pixel of a texture sends back, (height, width)."""
    height, width, channels = (int(a[texture]) for a in (model.tex_height, model.tex_width, model.tex_nchannel))
    first = int(model.tex_adr[texture])
    codes = model.tex_data[first : first + height * width * channels].reshape(height, width, channels)[..., 0]
    coded = model.tex_colorspace[texture] != mujoco.mjtColorSpace.mjCOLORSPACE_LINEAR
    return np.asarray(_CURVE[codes] if coded else codes / WHITE)


def linear(code: float | Floats) -> Floats:
    """Light of an sRGB code, 0 to 1 (IEC 61966-2-1)."""
    code = np.asarray(code, dtype=float)
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


_CURVE = linear(np.arange(WHITE + 1) / WHITE)
