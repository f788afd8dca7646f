"""Keys from a network's maps: the peaks of its score, and the descriptors there as bytes."""

import cv2
import numpy as np
from numpy.typing import NDArray

REACH = 2
"""A key is the best within so many pixels to every side."""
SCALE = 255.0
"""Bytes a unit: values of descriptors of length 1 lie within half a unit, but for one that is nearly alone."""


def peaks(score: NDArray[np.float32], floor: float, cap: int) -> NDArray[np.intp]:
    """Pixels (n, 2), x and y, of the best local maxima of a score above ``floor``, at most ``cap``, best first."""
    around = cv2.dilate(score, np.ones((2 * REACH + 1, 2 * REACH + 1), np.uint8))
    y, x = np.nonzero((score == around) & (score > floor))
    best = np.argsort(-score[y, x], kind="stable")[:cap]
    return np.stack([x[best], y[best]], axis=1)


def sampled(descriptors: NDArray[np.float32], at: NDArray[np.intp], size: tuple[int, int]) -> NDArray[np.float32]:
    """Descriptors (n, D) of length 1 at pixels (n, 2) of a picture of ``size``, between cells of a map (D, h, w)."""
    depth, rows, columns = descriptors.shape
    cells = (at + 0.5) * (columns, rows) / size - 0.5
    cells = np.clip(cells, 0, np.array([columns - 1, rows - 1]))
    low = np.floor(cells).astype(np.intp)
    high = np.minimum(low + 1, (columns - 1, rows - 1))
    (right, down), one = (cells - low).astype(np.float32).T, descriptors
    found = (
        one[:, low[:, 1], low[:, 0]] * (1 - right) * (1 - down)
        + one[:, low[:, 1], high[:, 0]] * right * (1 - down)
        + one[:, high[:, 1], low[:, 0]] * (1 - right) * down
        + one[:, high[:, 1], high[:, 0]] * right * down
    ).T
    length = np.linalg.norm(found, axis=1, keepdims=True)
    return np.asarray(found / np.maximum(length, np.finfo(np.float32).tiny), np.float32).reshape(-1, depth)


def as_bytes(descriptors: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Descriptors of length 1 as bytes, ``SCALE`` a unit: their distances are that many times as large."""
    return np.asarray(np.clip(np.rint(descriptors * SCALE + SCALE / 2), 0, 255), np.uint8)
