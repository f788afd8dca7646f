"""Pose graphs in the plane: the poses that fit relative poses between them best, by weighted least squares.

The relative poses of one odometer may share an unknown scale, as where a wheel's radius is not what the robot takes it
for: an error that does not average out over a path.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq.planar import wrapped

if TYPE_CHECKING:
    from scipy.sparse import csr_array

MOST_STEPS, SMALL_STEP = 20, 1e-9
"""Least squares end after so many steps, or with a step that moves no pose by more [m, rad]."""
UNSCALED = -1
"""Number of no odometer: a relative pose that is as long as it says."""


@dataclass(frozen=True, slots=True)
class Relations:
    """Relative poses, n of them.

    ``pairs`` (n, 2) number two poses, ``motions`` (n, 3) say where the second is as seen from the first: x, y [m] and
    heading [rad]; ``sigmas`` (n, 3) are their standard deviations. ``odometers`` (n,) number the odometer that measured
    each, from 0, or ``UNSCALED``.
    """

    pairs: NDArray[np.intp]
    motions: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    odometers: NDArray[np.intp]

    @classmethod
    def of(
        cls, pairs: ArrayLike, motions: ArrayLike, sigmas: ArrayLike = 1.0, odometers: ArrayLike = UNSCALED
    ) -> "Relations":
        """Relations of plain lists; one sigma, one row of them or one odometer may stand for all."""
        numbers = np.asarray(pairs, np.intp).reshape(-1, 2)
        n = len(numbers)
        spread = np.broadcast_to(np.asarray(sigmas, np.float64), (n, 3))
        return cls(
            numbers,
            np.asarray(motions, np.float64).reshape(-1, 3),
            spread,
            np.broadcast_to(np.asarray(odometers, np.intp), n),
        )

    def __len__(self) -> int:
        return len(self.pairs)

    def beside(self, other: "Relations") -> "Relations":
        """These and others."""
        return Relations(
            np.concatenate([self.pairs, other.pairs]),
            np.concatenate([self.motions, other.motions]),
            np.concatenate([self.sigmas, other.sigmas]),
            np.concatenate([self.odometers, other.odometers]),
        )


@dataclass(frozen=True, slots=True)
class PoseFit:
    """Poses (m, 3) that fit relations best, the odometers' ``scales`` (s,), and each relation's ``squares`` (n,).

    A square is the sum over x, y and heading of (error / sigma)²; an odometer's way is 1 + scale times what it says.
    """

    poses: NDArray[np.float64]
    scales: NDArray[np.float64]
    squares: NDArray[np.float64]


def moved(poses: ArrayLike, motions: ArrayLike) -> NDArray[np.float64]:
    """Poses (…, 3) after motions (…, 3), each in the frame of its pose; headings are not wrapped."""
    x, y, heading = np.moveaxis(np.asarray(poses, np.float64), -1, 0)
    ahead, left, turn = np.moveaxis(np.asarray(motions, np.float64), -1, 0)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([x + cos * ahead - sin * left, y + sin * ahead + cos * left, heading + turn], axis=-1)


def motions_between(start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
    """The motions (…, 3) that lead from poses to others: the inverse of ``moved``; headings are not wrapped."""
    one, other = np.asarray(start, np.float64), np.asarray(end, np.float64)
    east, north, turn = np.moveaxis(other - one, -1, 0)
    cos, sin = np.cos(one[..., 2]), np.sin(one[..., 2])
    return np.stack([cos * east + sin * north, cos * north - sin * east, turn], axis=-1)


def ways_along(track: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way from the first pose of a track (n, 3) to each, (n,) [m]."""
    return np.cumsum([0.0, *np.hypot(*np.diff(track[:, :2], axis=0).T)])


def cuts(way: NDArray[np.float64], metres: float) -> list[int]:
    """Indices of the first pose, and of each that lies so many ``metres`` or more along the way behind the last one."""
    found = [0]
    for index, at in enumerate(way.tolist()):
        if at - way[found[-1]] >= metres:
            found.append(index)
    return found


def best_fit(
    relations: Relations, start: NDArray[np.float64], held: ArrayLike = (0,), scale_sigma: float = 0.0
) -> PoseFit:
    """Poses that fit relations with the least squares, by Gauss and Newton from ``start`` (m, 3).

    The poses ``held`` stay where they are: one of each group that relations join, or nothing says where the group is.
    Odometers' scales are 0 with a standard deviation ``scale_sigma``; 0 leaves them out.
    """
    # A fifth of a second to import, which whoever only moves poses does not wait for.
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    poses, held = start.copy(), np.asarray(held, np.intp)
    odometers = 1 + int(relations.odometers.max(initial=UNSCALED)) if scale_sigma else 0
    scales = np.zeros(odometers)
    free = np.setdiff1d(np.arange(3 * len(poses) + odometers), (3 * held[:, None] + np.arange(3)).ravel())
    prior = sparse.diags_array(np.isin(free, 3 * len(poses) + np.arange(odometers)) / (scale_sigma or 1.0) ** 2)
    for _ in range(MOST_STEPS):
        errors, slopes = _linearised(relations, poses, scales)
        some = slopes[:, free]
        push = some.T @ errors + prior @ np.concatenate([poses.ravel(), scales])[free]
        step = np.zeros(3 * len(poses) + odometers)
        step[free] = spsolve(sparse.csc_array(some.T @ some + prior), -push)
        poses += step[: poses.size].reshape(-1, 3)
        scales += step[poses.size :]
        if np.abs(step).max(initial=0.0) < SMALL_STEP:
            break
    errors, _ = _linearised(relations, poses, scales)
    return PoseFit(poses, scales, np.square(errors).reshape(-1, 3).sum(axis=1))


def _linearised(
    relations: Relations, poses: NDArray[np.float64], scales: NDArray[np.float64]
) -> "tuple[NDArray[np.float64], csr_array]":
    """Errors (3n,) of relations in their sigmas, and their slopes (3n, 3m + s) by poses and scales."""
    from scipy.sparse import csr_array  # as in ``best_fit``

    start, end = relations.pairs.T
    found = motions_between(poses[start], poses[end])
    scaled = np.flatnonzero(relations.odometers >= 0) if len(scales) else np.zeros(0, np.intp)
    odometer = relations.odometers[scaled]
    wanted = relations.motions.copy()
    wanted[scaled, :2] *= 1 + scales[odometer][:, None]
    errors = found - wanted
    errors[:, 2] = wrapped(errors[:, 2])
    cos, sin = np.cos(poses[start, 2]), np.sin(poses[start, 2])
    one, none = np.ones_like(cos), np.zeros_like(cos)
    by_start = [[-cos, -sin, found[:, 1]], [sin, -cos, -found[:, 0]], [none, none, -one]]
    by_end = [[cos, sin, none], [-sin, cos, none], [none, none, one]]
    every = np.arange(len(relations))
    parts = [
        (3 * every + row, 3 * numbers + column, value / relations.sigmas[:, row])
        for numbers, block in ((start, by_start), (end, by_end))
        for row, entries in enumerate(block)
        for column, value in enumerate(entries)
    ]
    parts += [
        (3 * scaled + row, poses.size + odometer, -relations.motions[scaled, row] / relations.sigmas[scaled, row])
        for row in (0, 1)
    ]
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    shape = (errors.size, poses.size + len(scales))
    return (errors / relations.sigmas).ravel(), csr_array((values, (rows, columns)), shape=shape)
