"""Walks through a town of corridors, seen by a camera and a laser: sequences that share stretches, with known truth."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence
from refseq.planar import Pose
from refseq.view import View
from tests.refseq.rooms import bits_drive, bits_sequence

Leg = tuple[str, float, float]
"""A corridor, and from where to where it is walked [m]; the second below the first: the other way."""
REACH = 2.0


@dataclass(frozen=True)
class Town:
    """Corridors by letter, each with ``density`` features a metre and way, seen from up to ``REACH`` [m] away.

    Walked the other way, the camera sees other features; the laser's are the same both ways.
    """

    corridors: str = "ABCDEF"
    length: float = 40.0
    density: float = 12.0
    seed: int = 1

    @cached_property
    def _features(self) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.intp]]:
        rng = np.random.default_rng(self.seed)
        count = int(self.density * self.length * len(self.corridors) * 2)
        return (
            rng.integers(len(self.corridors), size=count),
            rng.uniform(-REACH, self.length + REACH, count),
            rng.integers(2, size=count),
        )

    def views(self, legs: Sequence[Leg], seed: int = 0, missed: float = 0.3, false: float = 0.02) -> list[View]:
        """A walk, a view a metre; some features are missed, and some seen that are not there."""
        rng = np.random.default_rng((self.seed, seed))
        corridor, at, way = self._features
        seen, poses = [], []
        for name, start, stop in legs:
            number, reverse = self.corridors.index(name), stop < start
            for x in np.arange(start, stop, -1.0 if reverse else 1.0):
                near = (corridor == number) & (np.abs(at - x) < REACH)
                seen.append((near & (way == reverse), near))
                poses.append(Pose(float(x), 100.0 * number, np.pi * reverse))
        camera, laser = (np.array(bits) for bits in zip(*seen, strict=True))
        drawn = {"camera": camera, "scanner": laser[:, ::4]}
        drawn = {
            key: np.where(rng.random(b.shape) < missed, False, b) | (rng.random(b.shape) < false)
            for key, b in drawn.items()
        }
        walk = bits_drive(drawn)
        return [View(v.time, v.images, None, v.distance, 0.0, pose) for v, pose in zip(walk, poses, strict=True)]

    def learnt(
        self, legs: Sequence[Leg], seed: int = 0, profile: Profile | None = None, sensors: Sequence[str] | None = None
    ) -> ReferenceSequence:
        """The reference sequence of a walk, one for all who ask: it never changes, and calibrating it takes longest."""
        which = (tuple(legs), seed, profile, None if sensors is None else tuple(sensors))
        if which not in self._sequences:
            walk = self.views(legs, seed)
            if sensors is not None:
                walk = [View(v.time, {s: v.images[s] for s in sensors}, None, v.distance, 0.0, v.truth) for v in walk]
            self._sequences[which] = bits_sequence(walk, profile)
        return self._sequences[which]

    @cached_property
    def _sequences(self) -> dict[object, ReferenceSequence]:
        return {}


def apart(one: Pose | None, other: Pose | None) -> float:
    """Distance of two poses that are known [m]."""
    assert one is not None
    assert other is not None
    return float(np.hypot(one.x - other.x, one.y - other.y))
