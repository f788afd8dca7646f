"""Rooms of known geometry and what a laser sees in them, and drives whose features are set bit by bit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.extractor import BaseExtractor
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.map import Map
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence
from refseq.planar import Pose
from refseq.view import Scan, View

Wall = tuple[float, float, float, float]
"""A wall from (x0, y0) to (x1, y1) [m]."""


def rectangle(x0: float, y0: float, x1: float, y1: float) -> list[Wall]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


def rays(walls: Sequence[Wall], pose: Pose, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance to the first wall met in each direction of the plan, (n,); from the crossing of ray and segment."""
    x0, y0, x1, y1 = np.array(walls, np.float64).reshape(-1, 4, 1).swapaxes(0, 1)
    c, s = np.cos(angles), np.sin(angles)
    ax, ay, bx, by = x0 - pose.x, y0 - pose.y, x1 - x0, y1 - y0
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = c * by - s * bx
        reach = (ax * by - ay * bx) / cross
        share = (ax * s - ay * c) / cross
    hit = (reach > 0) & (share >= 0) & (share <= 1)
    return np.where(hit, reach, np.inf).min(axis=0, initial=np.inf)


def cast(
    walls: Sequence[Wall], pose: Pose, beams: int = 361, rng: np.random.Generator | None = None, noise: float = 0.005
) -> Scan:
    """A scan from a pose: exact, or with noise and in 1 cm steps if ``rng``."""
    step = np.pi / (beams - 1)
    ranges = rays(walls, pose, pose.heading - np.pi / 2 + step * np.arange(beams))
    if rng is not None:
        ranges = np.round(ranges + noise * rng.standard_normal(beams), 2)
    return Scan(ranges.astype(np.float32), -np.pi / 2, step)


class Bits(BaseExtractor):
    """A sensor whose image is the row of its features itself: not zero where one is seen."""

    def __init__(self, sensor: str, size: int) -> None:
        self.key = f"bits/{sensor}"
        self.sensor = sensor
        self.size = size

    def learn(self, view: View) -> NDArray[np.intp]:
        return self.describe(view)

    def describe(self, view: View) -> NDArray[np.intp]:
        return np.flatnonzero(view.images[self.sensor])

    def recognise(self, described: NDArray[np.intp]) -> NDArray[np.intp]:
        return described

    def state(self) -> Mapping[str, NDArray[Any]]:
        return {}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        return np.arange(size)


def bits_drive(
    bits: Mapping[str, NDArray[np.bool_]], distances: Sequence[float] | None = None, start: float = 0.0
) -> list[View]:
    """Views of a straight drive; ``bits`` are (views, features) for each sensor, ``distances`` 1 m if not given."""
    count = len(next(iter(bits.values())))
    distances = [0.0] + [1.0] * (count - 1) if distances is None else distances
    x = start + np.cumsum(distances)
    return [
        View(
            float(k),
            {sensor: seen[k][None].astype(np.uint8) for sensor, seen in bits.items()},
            distance=float(distances[k]),
            truth=Pose(float(x[k]), 0.0, 0.0),
        )
        for k in range(count)
    ]


def bits_sequence(views: Sequence[View], profile: Profile | None = None) -> ReferenceSequence:
    """The reference sequence of a drive of ``bits_drive``."""
    extractors = tuple(Bits(name, image.shape[1]) for name, image in views[0].images.items())
    columns = [{e.key: e.learn(view) for e in extractors} for view in views]
    matrix = IncidenceMatrix.from_columns(columns, {e.key: e.size for e in extractors})
    along = np.cumsum([0.0] + [abs(view.distance) for view in views[1:]])
    return ReferenceSequence(matrix, extractors, along, tuple(v.truth for v in views), profile or Profile())


def bits_map(views: Sequence[View], profile: Profile | None = None) -> Map:
    """The map of a drive of ``bits_drive``."""
    return Map.of(bits_sequence(views, profile))


def named_maps(names: Sequence[str], parts: Sequence[ReferenceSequence | Map]) -> list[Map]:
    """Maps of one path each, by these names."""
    maps = [part if isinstance(part, Map) else Map.of(part) for part in parts]
    return [one.named(name) for name, one in zip(names, maps, strict=True)]


def without(view: View, *sensors: str) -> View:
    """The view without some of its cameras."""
    return replace(view, images={name: image for name, image in view.images.items() if name not in sensors})
