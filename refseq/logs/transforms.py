"""Tree of coordinate frames: mounts of sensors, and the robot's pose where only transforms tell of it."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.limits import FRAMES, METRES
from refseq.logs.trajectory import Trajectory
from refseq.planar import Pose

TURNED = 1e6
"""The largest component of a rotation that is believed; real ones are at most 1, but not all writers scale them."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Pose of frame ``child`` in frame ``parent``: ``translation`` (x, y, z) [m], ``rotation`` (x, y, z, w).

    ``static`` ones hold at any time, whatever their stamp.
    """

    parent: str
    child: str
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    static: bool = False


@dataclass(frozen=True, slots=True)
class Mount:
    """Pose of a sensor on the robot, in the plane; ``upside_down`` when its z axis points to the floor."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    upside_down: bool = False


def heading_of(rotation: tuple[float, float, float, float]) -> float:
    """Heading [rad] of a rotation x, y, z, w that is about the vertical; of any other that of its x axis."""
    x, y, z, w = rotation
    if x == 0 and y == 0:
        return 2.0 * math.atan2(z, w)
    return math.atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)


def pose_in_plane(translation: tuple[float, float, float], rotation: tuple[float, float, float, float]) -> Pose | None:
    """Project a pose in space to the plane: x, y, and the heading of its x axis.

    None of one that is no number, or whose rotation is nothing but zeros, as programs send while they do not know, and
    of one beyond all places (``METRES``).
    """
    if not (all(abs(value) <= METRES for value in translation) and all(abs(value) <= TURNED for value in rotation)):
        return None
    if not any(rotation):
        return None
    return Pose(translation[0], translation[1], heading_of(rotation))


def pose_of_message(pose: Any) -> Pose | None:
    """The pose in the plane of a message with a position and an orientation, ROS' or Foxglove's; None as above."""
    at, turn = pose.position, pose.orientation
    return pose_in_plane((at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))


class TransformTree:
    """Frames that hang together by transforms.

    Static transforms and dynamic ones may be mixed. Of a frame with two parents the first is kept and the other counted
    in ``reparented``; a cycle is refused.
    """

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._static: dict[str, NDArray[np.float64]] = {}
        self._moving: dict[str, tuple[list[float], list[NDArray[np.float64]]]] = {}
        self._logged: dict[str, list[float]] = {}
        self.reparented: dict[str, str] = {}

    def add(self, transforms: Iterable[Transform], time: float, logged: float | None = None) -> None:
        """Take transforms with their time [s], and that of logging, by default the same.

        Raises ``LogError`` for a cycle and for values that are no pose.
        """
        for transform in transforms:
            if self._hang(transform):
                matrix = _matrix(transform)
                if transform.static:
                    self._static[transform.child] = matrix
                else:
                    times, matrices = self._moving.setdefault(transform.child, ([], []))
                    times.append(time)
                    matrices.append(matrix)
                    self._logged.setdefault(transform.child, []).append(time if logged is None else logged)

    def take_logged_times(self) -> None:
        """Take the times of logging for those of all transforms."""
        self._moving = {child: (list(self._logged[child]), found[1]) for child, found in self._moving.items()}

    def _hang(self, transform: Transform) -> bool:
        """Hang a frame below its parent; False if it hangs below another."""
        parent, child = transform.parent, transform.child
        known = self._parents.get(child)
        if known is not None:
            if known != parent:
                self.reparented[child] = parent
            return known == parent
        above = [parent, *self._above(parent)]
        if child in above:
            circle = " → ".join([*reversed(above[: above.index(child) + 1]), child])
            raise LogError(f"transforms form a cycle: {circle}; valid is a tree")
        FRAMES.check(len(self._parents) + 1, "transforms have")
        self._parents[child] = parent
        return True

    def _above(self, frame: str) -> Iterator[str]:
        while (parent := self._parents.get(frame)) is not None:
            yield parent
            frame = parent

    @property
    def frames(self) -> tuple[str, ...]:
        """All frames, sorted."""
        return tuple(sorted({*self._parents, *self._parents.values()}))

    @property
    def roots(self) -> tuple[str, ...]:
        """Frames without a parent, sorted; more than one: the tree is in pieces."""
        return tuple(sorted(set(self._parents.values()) - set(self._parents)))

    def hangs(self, frame: str) -> bool:
        """Tell whether a frame has a parent."""
        return frame in self._parents

    def moving(self, frame: str) -> bool:
        """Tell whether transforms move ``frame`` against its parent: of a single one nobody knows that."""
        return frame in self._moving and len(self._moving[frame][0]) > 1

    def chain(self, frame: str, ancestor: str) -> tuple[str, ...] | None:
        """Frames from ``frame`` up to below ``ancestor``; None where the one does not hang below the other."""
        path = [frame, *self._above(frame)]
        return tuple(path[: path.index(ancestor)]) if ancestor in path else None

    def mount(self, sensor: str, base: str) -> Mount | None:
        """Where a sensor's frame sits on the robot's ``base``; None where that is not known."""
        matrix = self._between(sensor, base)
        if matrix is None:
            return None
        return Mount(
            float(matrix[0, 3]),
            float(matrix[1, 3]),
            math.atan2(matrix[1, 0], matrix[0, 0]),
            bool(matrix[2, 2] < 0),
        )

    def _between(self, frame: str, base: str) -> NDArray[np.float64] | None:
        """Fixed pose of ``frame`` in ``base``, by way of the root both hang below; a moving joint at its first pose."""
        up, down = [frame, *self._above(frame)], [base, *self._above(base)]
        shared = next((one for one in up if one in down), None)
        if shared is None:
            return None
        from_frame = self._product(up[: up.index(shared)])
        from_base = self._product(down[: down.index(shared)])
        between: NDArray[np.float64] = np.linalg.inv(from_base) @ from_frame
        return between

    def _product(self, chain: list[str] | tuple[str, ...]) -> NDArray[np.float64]:
        total = np.eye(4)
        for frame in chain:
            total = (self._static[frame] if frame in self._static else self._moving[frame][1][0]) @ total
        return total

    def trajectory(self, child: str, parent: str) -> Trajectory | None:
        """The way of ``child`` in ``parent``, at the times of the fastest transform between them, in the plane.

        None where the one does not hang below the other, or where nothing between them moves.
        """
        chain = self.chain(child, parent)
        movers = [frame for frame in chain or () if self.moving(frame)]
        if chain is None or not movers:
            return None
        fastest = max(movers, key=lambda frame: len(self._moving[frame][0]))
        times = np.array(self._moving[fastest][0])
        total = np.tile(np.eye(4), (len(times), 1, 1))
        for frame in chain:
            total = self._at(frame, times) @ total
        headings = np.arctan2(total[:, 1, 0], total[:, 0, 0])
        poses = [Pose(*row) for row in np.column_stack([total[:, 0, 3], total[:, 1, 3], headings]).tolist()]
        return Trajectory.of(times, poses)

    def _at(self, frame: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Matrices of one frame in its parent, (n, 4, 4): the latest transform at each time, the first before that."""
        if frame in self._static:
            return np.broadcast_to(self._static[frame], (len(times), 4, 4))
        stamps, matrices = self._moving[frame]
        order = np.argsort(stamps, kind="stable")
        latest = np.searchsorted(np.array(stamps)[order], times, side="right") - 1
        found: NDArray[np.float64] = np.stack(matrices)[order][latest.clip(0)]
        return found


def _matrix(transform: Transform) -> NDArray[np.float64]:
    """Homogeneous matrix, (4, 4)."""
    x, y, z, w = transform.rotation
    length = math.sqrt(x * x + y * y + z * z + w * w)
    if not (0.5 < length < TURNED and all(abs(value) <= METRES for value in transform.translation)):
        raise LogError(
            f"transform {transform.parent} → {transform.child} has rotation ({x:g}, {y:g}, {z:g}, {w:g}); "
            "valid are a quaternion of length 1 and finite numbers"
        )
    x, y, z, w = x / length, y / length, z / length, w / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), transform.translation[0]],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), transform.translation[1]],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), transform.translation[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
