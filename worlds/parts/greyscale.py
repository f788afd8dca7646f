"""Grey pictures: albedo as bytes, noise, and where one picture is put on another.

Pictures are (height, width) uint8, sRGB codes of the albedo (``srgb``), so that dark print keeps its steps; row 0 is
the upper edge.
"""

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from refseq_bench.worlds.arrays import Floats

Image = NDArray[np.uint8]
Field = NDArray[np.float32]
"""Albedo or luminance of each pixel, before it is encoded."""
Pixels = NDArray[np.integer]

DENSITY = 640
"""Pixels a metre on what is seen from near: a camera of 45° and 640 columns, 1.2 m away, sees as much."""
FONT = cv2.FONT_HERSHEY_SIMPLEX
INK, PAPER = 0.03, 0.82


def srgb(linear: float | NDArray[np.floating]) -> Floats:
    """Encode linear values 0..1 as sRGB values 0..1 (IEC 61966-2-1)."""
    x = np.atleast_1d(np.clip(np.asarray(linear, dtype=float), 0.0, 1.0))
    code = np.power(x, 1 / 2.4)
    code *= 1.055
    code -= 0.055
    dark = x <= 0.0031308
    code[dark] = 12.92 * x[dark]
    return code.reshape(np.shape(linear))


def linear(code: NDArray[np.uint8]) -> Floats:
    """Decode sRGB bytes to linear values 0..1, the inverse of ``srgb``."""
    x = code / 255.0
    return np.where(x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4))


def encode(albedo: NDArray[np.floating], rng: Generator) -> Image:
    """Turn albedos into bytes, dithered so that a faint gradient does not become steps."""
    albedo = np.clip(albedo, 0.0, 1.0, dtype=np.float32)
    code = np.asarray(cv2.pow(albedo, 1 / 2.4), np.float32)  # as ``srgb``, in a quarter of the time
    code *= 1.055
    code -= 0.055
    np.copyto(code, 12.92 * albedo, where=albedo <= 0.0031308)
    code *= 255.0
    code += rng.random(albedo.shape, dtype=np.float32)
    return np.minimum(code, 255, out=code).astype(np.uint8)


def grey(albedo: float) -> int:
    """Return the byte for one albedo."""
    return round(255 * float(srgb(albedo)))


def cloud(shape: tuple[int, int], rng: Generator, coarsest: int = 4, octaves: int = 5, fall: float = 0.55) -> Field:
    """Draw fractal value noise, zero mean and unit deviation; ``coarsest`` cells across the shorter side."""
    total = np.zeros(shape, np.float32)
    scale = min(shape)
    for i in range(octaves):
        cells = coarsest * 2**i
        grid = noise((2 + cells * shape[0] // scale, 2 + cells * shape[1] // scale), rng)
        total += cv2.resize(grid * np.float32(fall**i), shape[::-1], interpolation=cv2.INTER_CUBIC)
    mean, deviation = total.mean(), total.std()
    total -= mean
    total /= deviation
    return total


def noise(shape: tuple[int, int], rng: Generator) -> Field:
    """Draw a number for each pixel, zero mean and unit deviation."""
    return rng.standard_normal(shape, dtype=np.float32)


def around(points: Pixels, margin: int, shape: tuple[int, ...]) -> tuple[Pixels, Pixels]:
    """Corners (x, y) of the part of an image of that shape that lies around ``points`` (n, 2) [px]."""
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return np.clip(low, 0, shape[::-1]), np.clip(high, 0, shape[::-1])


def paste(image: Image, patch: Image, x: int, y: int) -> None:
    """Put ``patch`` into ``image`` with its upper left corner at (x, y) [px]; what stands out is cut off."""
    h, w = patch.shape
    room = image[y : y + h, x : x + w]
    room[:] = patch[: room.shape[0], : room.shape[1]]
