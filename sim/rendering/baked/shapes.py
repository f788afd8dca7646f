"""MuJoCo's shapes in the frame of their geom, with the pictures that Filament would lay on them."""

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from refseq_bench.sim.rendering.baked.triangles import HALVES, Floats, Triangles

AROUND = 24
"""Corners around a cylinder: half a millimetre is missing to a pole of 5 cm."""
SMOOTH = 0.7
"""A corner's normal is believed where its cosine to the face's is at least this: a choice."""
UP = 12
"""Rows of a sphere from pole to pole."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Parallelograms: ``corners`` (n, 4, 3) [m], counter-clockwise from outside, ``uv`` (n, 4, 2) as of triangles."""

    corners: Floats
    uv: Floats

    @property
    def triangles(self) -> Triangles:
        """Two for each face, in their order."""
        return _quads(self.corners, self.uv)


def faces_of(model: mujoco.MjModel, geom: int) -> Faces | None:
    """The faces of a geom that has flat ones; None for one that has not."""
    match mujoco.mjtGeom(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_BOX:
            return box(model.geom_size[geom])
        case mujoco.mjtGeom.mjGEOM_PLANE:
            return plane(model.geom_size[geom, :2])
        case _:
            return None


def shape_of(model: mujoco.MjModel, geom: int) -> Triangles:
    """Triangles of any geom; none for a kind that worlds and robots do not have, as height fields."""
    faces = faces_of(model, geom)
    if faces is not None:
        return faces.triangles
    size = model.geom_size[geom]
    match mujoco.mjtGeom(model.geom_type[geom]):
        case mujoco.mjtGeom.mjGEOM_MESH:
            return mesh(model, int(model.geom_dataid[geom]))
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return turned(np.array([[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]]) * size[:2])
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return ellipsoid(np.repeat(size[0], 3))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return ellipsoid(size)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return capsule(size[0], size[1])
        case _:
            return Triangles.flat(np.empty((0, 3, 3)))


def plane(half: Floats) -> Faces:
    """A rectangle that looks up."""
    x, y = half
    corners = np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])
    return Faces(corners[None], np.array([[[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]]))


def box(half: Floats) -> Faces:
    """A box; its picture is upright on all four sides, on two of them in a mirror."""
    return Faces(_BOX.corners * half, _BOX.uv)


def _unit_box() -> Faces:
    corners, uv = [], []
    for axis, (across, up) in enumerate(((1, 2), (0, 2), (0, 1))):
        for sign in (1.0, -1.0):
            face = np.zeros((4, 3))
            face[:, axis] = sign
            face[:, across], face[:, up] = [-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]
            outward = np.cross(np.eye(3)[across], np.eye(3)[up])[axis] * sign > 0
            face = face if outward else face[::-1]
            corners.append(face)
            uv.append(0.5 + 0.5 * face[:, [across, up]] * [1.0, -1.0])
    return Faces(np.array(corners), np.array(uv))


_BOX = _unit_box()
"""Of half sides of 1 m: a world has hundreds of boxes."""


def mesh(model: mujoco.MjModel, number: int) -> Triangles:
    """A mesh of the model; where it has no good normals, as corners of thin bars have none, those of its faces."""
    faces = slice(model.mesh_faceadr[number], model.mesh_faceadr[number] + model.mesh_facenum[number])
    corners = model.mesh_vert[model.mesh_vertadr[number] + model.mesh_face[faces]].astype(float)
    normals = model.mesh_normal[model.mesh_normaladr[number] + model.mesh_facenormal[faces]].astype(float)
    uv = np.zeros((len(corners), 3, 2))
    if model.mesh_texcoordnum[number]:
        uv = model.mesh_texcoord[model.mesh_texcoordadr[number] + model.mesh_facetexcoord[faces]].astype(float)
    flat = Triangles.flat(corners, uv)
    along = np.einsum("fkc,fkc->fk", normals, flat.normals)
    return Triangles(corners, np.where((along > SMOOTH)[..., None], normals, flat.normals), uv)


def turned(outline: Floats) -> Triangles:
    """The body of revolution of an outline (n, 2) of distances from the axis and heights, from its lower end; flat."""
    angle = np.linspace(0.0, 2 * np.pi, AROUND + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    quads, uv = [], []
    for low, high in pairwise(outline):
        lower, upper = (np.column_stack([r * ring, np.full(len(ring), z)]) for r, z in (low, high))
        quads.append(np.stack([lower[:-1], lower[1:], upper[1:], upper[:-1]], axis=1))
        share = angle / (2 * np.pi)
        row = 0.5 - 0.5 * np.array([low[1], high[1]]) / max(np.abs(outline[:, 1]).max(), 1e-12)
        ends = [(share[:-1], row[0]), (share[1:], row[0]), (share[1:], row[1]), (share[:-1], row[1])]
        uv.append(np.stack([np.stack(np.broadcast_arrays(*end), axis=-1) for end in ends], axis=1))
    return _solid(_quads(np.concatenate(quads), np.concatenate(uv)))


def ellipsoid(half: Floats) -> Triangles:
    """An ellipsoid, with the normals of its surface."""
    up = np.linspace(-np.pi / 2, np.pi / 2, UP + 1)
    ball = turned(np.stack([np.cos(up), np.sin(up)], axis=-1))
    normals = ball.corners / half
    return Triangles(ball.corners * half, normals / np.linalg.norm(normals, axis=2, keepdims=True), ball.uv)


def capsule(radius: float, half: float) -> Triangles:
    """A cylinder between two half balls, with the normals of its surface."""
    up = np.linspace(0.0, np.pi / 2, UP // 2 + 1)
    arc = radius * np.stack([np.cos(up), np.sin(up)], axis=-1)
    top = arc + np.array([0.0, half])
    outline = np.concatenate([top[::-1] * [1.0, -1.0], top])
    body = turned(outline)
    core = body.corners * [0.0, 0.0, 1.0]
    core[..., 2] = np.clip(core[..., 2], -half, half)
    return Triangles(body.corners, (body.corners - core) / radius, body.uv)


def _quads(corners: Floats, uv: Floats) -> Triangles:
    """Two triangles for each of the quadrangles (n, 4, 3)."""
    return Triangles.flat(corners[:, HALVES].reshape(-1, 3, 3), uv[:, HALVES].reshape(-1, 3, 2))


def _solid(triangles: Triangles) -> Triangles:
    """Leave out those without an area."""
    edges = triangles.corners[:, 1:] - triangles.corners[:, :1]
    return triangles[np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 1e-12]
