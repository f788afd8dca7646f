"""A path as it was learnt: where in the map each of its views now lies."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.map.paths.annotations import Annotations
from refseq.map.paths.keys import PathKeys
from refseq.scan_matching.panorama import DEGREES


@dataclass(frozen=True, eq=False)
class MapPath:
    """A path by its ``name``: where each of the K views that were learnt along it now lies.

    ``along`` (K,) is each view's odometric distance from the first [m], rising; ``sequences`` and ``places`` (K,) say
    which sequence holds the place, and the number that it has there. For most views that is the path's own sequence.
    ``annotations`` are what missions need of the path beside.

    ``odometry`` (K, 3) are the views' poses by the drive's own odometry, kept where other sequences hold some of them:
    x, y [m] and heading [rad]; ``poses`` (K, 3) those in the one frame of all paths that are joined. Both are (0, 3)
    where they are not known. ``scans`` (K, 360) are what a laser saw (``refseq.scan_matching.panorama``), for later
    merging; (0, 360) without one. ``times`` (K,) are the views' stamps in the recording that they were learnt from [s],
    by which they are found there again; (0,) where they are not known. ``keys`` are those of each camera, where
    geometry is asked for (``log_ratio.geometry``).

    ``loops`` (n, 2) are pairs of views, the earlier first, that are one place: there the path came back to itself.
    """

    name: str
    along: NDArray[np.float64]
    sequences: NDArray[np.intp]
    places: NDArray[np.intp]
    annotations: Annotations = field(default_factory=Annotations)
    odometry: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    poses: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    scans: NDArray[np.uint16] = field(default_factory=lambda: np.zeros((0, DEGREES), np.uint16))
    times: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    loops: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 2), np.intp))
    keys: Mapping[str, PathKeys] = field(default_factory=lambda: MappingProxyType({}))

    def __len__(self) -> int:
        return len(self.along)

    @property
    def length(self) -> float:
        """From the first view to the last [m]."""
        return float(self.along[-1] - self.along[0])


@dataclass(frozen=True)
class Link:
    """Where a path crosses over: it goes from a place of one sequence straight on to one of another."""

    path: int
    start: tuple[int, int]
    end: tuple[int, int]
