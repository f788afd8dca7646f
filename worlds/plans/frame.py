"""Local frame of a wall or of a thing on the floor: along it, out of it into the room, and up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.schema import Door, Standing, Wall

UP = np.array([0.0, 0.0, 1.0])


def left_of(direction: Floats) -> Floats:
    """Return a direction on the floor (2,) turned left by 90°."""
    return np.array([-direction[1], direction[0]])


@dataclass(frozen=True, slots=True)
class LocalFrame:
    """Origin at the wall's start on the floor, (2,); ``along`` and ``inward`` are unit vectors, (2,)."""

    origin: Floats
    along: Floats
    inward: Floats

    @classmethod
    def of(cls, wall: Wall) -> "LocalFrame":
        """Return the frame of a wall of the plan."""
        frame = cls.between(wall.start, wall.end)
        return frame if wall.inside == "left" else cls(frame.origin, frame.along, -frame.inward)

    @classmethod
    def between(cls, start: ArrayLike, end: ArrayLike) -> "LocalFrame":
        """Return the frame of a line on the floor, (2,) each; ``inward`` points to its left."""
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        along = (end - start) / np.linalg.norm(end - start)
        return cls(start, along, left_of(along))

    @classmethod
    def under(cls, item: Standing) -> "LocalFrame":
        """Return the frame of what stands free: ``along`` is its heading, ``inward`` points to the left, its front."""
        along = np.array([np.cos(np.radians(item.heading)), np.sin(np.radians(item.heading))])
        return cls(np.array(item.at), along, left_of(along))

    def point(self, s: float, out: float, z: float) -> Floats:
        """Return the world point ``s`` along the wall, ``out`` into the room and ``z`` up, (3,) [m]."""
        return np.append(self.origin + s * self.along + out * self.inward, z)

    def corners(self, width: float, depth: float) -> Floats:
        """Return the corners of a rectangle about the origin, ``width`` along and ``depth`` out, (4, 2) [m]."""
        signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
        return self.origin + signs * (width, depth) @ np.array([self.along, self.inward])

    @property
    def box_quat(self) -> Floats:
        """Rotation (w x y z) of a box whose x runs along the wall and whose z is up."""
        return quaternion(np.append(self.along, 0.0), UP)

    @property
    def panel_quat(self) -> Floats:
        """Rotation (w x y z) of a picture on the wall: z looks into the room, y is up."""
        out = np.append(self.inward, 0.0)
        return quaternion(np.cross(UP, out), out)

    @property
    def handed(self) -> float:
        """+1 when a box's y axis points into the room, −1 when it points out of it."""
        return float(np.sign(self.along[0] * self.inward[1] - self.along[1] * self.inward[0]))

    def turned(self, s: float, out: float, angle: float) -> "LocalFrame":
        """Return a frame at (s, out) whose ``along`` is swung by ``angle`` [rad] away from the room."""
        cos, sin = np.cos(angle), np.sin(angle)
        origin = self.point(s, out, 0.0)[:2]
        return LocalFrame(origin, cos * self.along - sin * self.inward, cos * self.inward + sin * self.along)

    def leaf(self, door: Door, angle: float) -> "LocalFrame":
        """Return the frame of the leaf of a wall's door, from its hinge on, opened by ``angle`` [rad]."""
        at_start = door.hinge == "start"
        hinge, s = (self, door.extent[0]) if at_start else (self.reversed(), -door.extent[1])
        return hinge.turned(s, -door.recess, angle)

    def reversed(self) -> "LocalFrame":
        """Return the same place with ``along`` pointing the other way."""
        return LocalFrame(self.origin, -self.along, self.inward)


LEVEL = LocalFrame(np.zeros(2), np.array([1.0, 0.0]), np.array([0.0, 1.0]))
"""The world's own axes."""


def quaternion(x: ArrayLike, z: ArrayLike) -> Floats:
    """Return the rotation (w x y z) that has these axes x and z, unit and at right angles."""
    import mujoco  # takes a quarter of a second, which who only reads plans does not wait for

    x, z = np.asarray(x, dtype=float), np.asarray(z, dtype=float)
    matrix = np.stack([x, np.cross(z, x), z], axis=1)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, matrix.flatten())
    return quat
