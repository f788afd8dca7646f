"""Scene of a drive: its cameras, laser and extent, found before drawing so that no panel stays empty."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.planar import Pose, after_motion
from refseq.view import View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.drawing.plane import ORIGIN

MARGIN = 2.0
"""Free room around a plan [m]."""
WIDE = 4.0
"""A plan this many times wider than high gets a row of its own."""
SAMPLES = 500
"""Scans that are looked at to find how far the laser sees."""


@dataclass(frozen=True)
class Extent:
    """A rectangle of the world: ``low`` and ``high`` are its corners x, y [m]."""

    low: tuple[float, float]
    high: tuple[float, float]

    @classmethod
    def around(cls, poses: Iterable[Pose | None]) -> "Extent | None":
        """The rectangle around all poses, with a margin; ``None`` without any."""
        points = np.array([(pose.x, pose.y) for pose in poses if pose])
        if not len(points):
            return None
        (west, south), (east, north) = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        return cls((float(west), float(south)), (float(east), float(north)))

    @property
    def bounds(self) -> rrb.VisualBounds2D:
        """The rectangle as a plan shows it, with north up."""
        (west, south), (east, north) = self.low, self.high
        return rrb.VisualBounds2D(x_range=[west, east], y_range=[-north, -south])

    @property
    def wide(self) -> bool:
        """True for a strip."""
        (west, south), (east, north) = self.low, self.high
        return east - west >= WIDE * (north - south)


@dataclass(frozen=True)
class Scene:
    """A drive as far as the layout depends on it.

    ``cameras``, the ``sizes`` of their pictures (width, height) as far as they are known, whether there is a ``laser``;
    ``reach`` holds most of what that sees [m]; ``extent`` is the plan's,
    ``None`` without one; ``framed`` as for ``DriveLog``; ``count`` the number of views, ``None`` while it is not known.
    """

    cameras: tuple[str, ...]
    laser: bool = True
    reach: float = 10.0
    extent: Extent | None = None
    framed: bool = True
    count: int | None = None
    sizes: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    @property
    def scan_bounds(self) -> rrb.VisualBounds2D:
        """The part of a scan that is shown, forward up."""
        return rrb.VisualBounds2D(
            x_range=[-self.reach * 0.7, self.reach * 0.7], y_range=[-self.reach, self.reach * 0.15]
        )


def scene_of(views: Iterable[View], layers: Sequence[LocaliserLayer] = ()) -> Scene:
    """Look at a drive once, from its first view to its last."""
    sizes: dict[str, tuple[int, int]] = {}
    truths: list[Pose | None] = []
    reckoned: list[Pose] = [ORIGIN]
    ranges: list[NDArray[np.float32]] = []
    for view in views:
        for camera in view.images:
            if camera not in sizes:  # one size a camera: to ask for a picture decodes it
                height, width = view.images[camera].shape[:2]
                sizes[camera] = width, height
        truths.append(view.truth)
        reckoned.append(after_motion(reckoned[-1], view.distance, view.turn) if len(truths) > 1 else ORIGIN)
        if view.scan is not None and len(ranges) < SAMPLES:
            ranges.append(view.scan.ranges[view.scan.returned])
    placed = [pose for layer in layers for pose in layer.places.poses]
    framed = any(truths) or any(placed)
    return Scene(
        cameras=tuple(sorted(sizes)),
        laser=bool(ranges),
        reach=_usual(ranges),
        extent=Extent.around([*truths, *placed] if framed else reckoned),
        framed=framed,
        count=len(truths),
        sizes=sizes,
    )


def _usual(ranges: Sequence[NDArray[np.float32]]) -> float:
    """A distance that holds most of what the scanner sees, from 4 to 20 m."""
    seen = np.concatenate([np.zeros(0, np.float32), *ranges])
    return float(np.clip(np.quantile(seen, 0.95), 4.0, 20.0)) if len(seen) else 10.0
