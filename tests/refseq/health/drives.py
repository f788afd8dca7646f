"""A made-up drive with a laser and two cameras, of which faults can be made."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import cv2
import numpy as np

from refseq.planar import Pose
from refseq.view import View
from tests.refseq.rooms import cast, rectangle

STEP = 0.85
WALLS = [
    *rectangle(-3.0, -1.2, 32.0, 1.2),
    *(wall for x in range(0, 30, 3) for wall in rectangle(x, -1.2, x + 0.9, -0.8)),
    *(wall for x in range(2, 30, 5) for wall in rectangle(x, 0.9, x + 0.6, 1.2)),
]
"""A corridor with cupboards on both sides, not alike."""


def drive(count: int = 30, seed: int = 1) -> list[View]:
    """A drive that winds a little along the corridor, a view each ``STEP`` [m]."""
    rng = np.random.default_rng(seed)
    heading = np.concatenate([[0.0], 0.12 * np.sin(np.arange(1, count) * 1.1)])
    way = STEP * np.arange(count)
    y = np.cumsum(STEP * np.sin(heading))
    y -= y.mean()
    poses = [Pose(float(a), float(b), float(c)) for a, b, c in zip(way, y, heading, strict=True)]
    return [
        View(
            time=1.8 * k,
            images={f"camera-{c}": picture(pose.x, c, rng) for c in (1, 2)},
            scan=cast(WALLS, pose, rng=rng),
            distance=STEP + 0.005 * float(rng.standard_normal()) if k else 0.0,
            turn=pose.heading - poses[k - 1].heading + 0.005 * float(rng.standard_normal()) if k else 0.0,
            truth=pose,
        )
        for k, pose in enumerate(poses)
    ]


def picture(along: float, camera: int, rng: np.random.Generator) -> np.ndarray:
    """A picture that changes along the way, with noise, (120, 160) uint8."""
    whole = np.random.default_rng(camera).random((12, 400)) * 160 + 40
    begin = along * 10
    columns = np.interp(begin + np.arange(16), np.arange(400), np.arange(400)).astype(np.float32)
    part = cv2.remap(
        whole.astype(np.float32),
        np.tile(columns, (12, 1)),
        np.tile(np.arange(12, dtype=np.float32)[:, None], (1, 16)),
        1,
    )
    large = cv2.resize(part, (160, 120), interpolation=cv2.INTER_CUBIC)
    return np.clip(large + rng.normal(0, 2, large.shape), 0, 255).astype(np.uint8)


def from_view(views: list[View], start: int, fault: Callable[[View, View], View]) -> list[View]:
    """The same drive, with a fault from view ``start`` on: of the view, and of the last one before it began."""
    return [fault(view, views[start - 1]) if k >= start else view for k, view in enumerate(views)]


def with_image(view: View, images: Mapping[str, np.ndarray]) -> View:
    """A view with other pictures of some cameras."""
    return replace(view, images={**view.images, **images})
