"""Free room for a robot: along an arc, or for a turn about itself."""

import math

import numpy as np
from numpy.typing import NDArray

from refseq_bench.robots.robot import Shape

MARGIN = 0.3
"""Room that a robot keeps ahead of it [m]: a choice, more than that at which the Robuter's sonars stop it."""
SIDE_MARGIN = 0.06
"""Room that it keeps at its sides, and all around while it turns on the spot [m]: a choice."""
TOUCH = 0.02
"""A point less deep in the robot's box is beside it: the scan's noise and the odometer's drift [m]; a choice."""
LOOK = 2.5
"""Length of way that must be free [m]: a choice, room enough to change by a metre."""
ARC_STEP = 0.05
TURN_STEP = math.radians(3)
MOST_TURNED = math.radians(90)
"""Nobody who steers drives an arc for longer than this: a choice."""


def free_ahead(points: NDArray[np.float64], shape: Shape, curvature: float, reach: float) -> float:
    """Distance [m] that a robot may drive along an arc of ``curvature`` [1/m] and keep ``MARGIN`` to what it meets.

    ``points`` (n, 2) are in its frame; it is ``reach`` where there are none before the arc has turned by
    ``MOST_TURNED``. A point beside the robot from the start does not count: it is being passed, and lanes keep it off.
    """
    lengths = np.arange(0.0, min(reach, MOST_TURNED / max(abs(curvature), 1e-9)), ARC_STEP)
    turned = curvature * lengths
    chord = lengths * np.sinc(turned / (2 * np.pi))
    centres = np.stack([chord * np.cos(turned / 2), chord * np.sin(turned / 2)], axis=1)
    near = points[(np.abs(points) < reach + 1.5).all(axis=1)]
    inside = _inside(near, centres, turned, shape, SIDE_MARGIN)  # (lengths, points)
    beside = inside[0] & (near[:, 0] < shape.ahead)
    hit = (inside & ~beside).any(axis=1)
    return max(float(lengths[np.argmax(hit)]) - (MARGIN - SIDE_MARGIN), 0.0) if hit.any() else reach


def blocks_turn(points: NDArray[np.float64], shape: Shape, angle: float) -> NDArray[np.float64]:
    """Those points (m, 2) that a robot meets which turns on the spot by ``angle`` [rad], nearest first."""
    angle = math.copysign(min(abs(angle), 2 * math.pi), angle)
    turned = np.linspace(0.0, angle, 2 + int(abs(angle) / TURN_STEP))
    near = points[np.hypot(*points.T) < shape.swing + 2 * SIDE_MARGIN]
    centres = np.zeros((len(turned), 2))
    close = _inside(near, centres, turned, shape, SIDE_MARGIN)
    touched = _inside(near, centres, turned, shape, -TOUCH)
    # What is within the margin from the start is in the way only if the robot would touch it.
    met = near[(close.any(axis=0) & ~close[0]) | touched.any(axis=0)]
    return met[np.argsort(np.hypot(*met.T))]


def _inside(
    points: NDArray[np.float64],
    centres: NDArray[np.float64],
    turned: NDArray[np.float64],
    shape: Shape,
    margin: float,
) -> NDArray[np.bool_]:
    """Mask of the points (n,) in the robot's box, with a ``margin`` all around, at each of k poses: (k, n)."""
    x = points[None, :, 0] - centres[:, None, 0]
    y = points[None, :, 1] - centres[:, None, 1]
    cos, sin = np.cos(turned)[:, None], np.sin(turned)[:, None]
    forward, left = cos * x + sin * y, cos * y - sin * x
    lengthwise = (forward < shape.ahead + margin) & (forward > -shape.behind - margin)
    return lengthwise & (np.abs(left) < shape.half_width + margin)
