"""Pictures of the view out of the windows: luminance as a share of the brightest."""

import cv2
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.parts.greyscale import Field, Image, around, cloud, encode

SKY_BY_DAY, SKY_BY_NIGHT = 0.9, 0.004
"""Luminance of the sky over the brightest thing outside, by day and by night."""


def outside(width: int, height: int, horizon: float, day: bool, rng: Generator) -> Image:
    """Draw what is seen out of the windows, (height, width) [px], as sRGB code of luminance over its peak.

    ``horizon`` is the height of the horizon as a share of the picture. By day: sky, houses, trees, a lawn. By night:
    the same shapes nearly black, with some lit windows and street lamps.
    """
    line = round((1.0 - horizon) * height)
    field = np.full((height, width), SKY_BY_DAY if day else SKY_BY_NIGHT, np.float32)
    fade = np.linspace(0.0, 2.0, height, dtype=np.float32).clip(0.0, 1.0)[:, None]  # plain sky above the picture
    haze = cloud((height, width), rng, coarsest=2)
    haze *= 0.05 * fade
    haze += 1.0
    field *= haze
    field[line:] = (0.28 if day else 0.002) * (1.0 + 0.15 * cloud((height - line, width), rng, coarsest=6))
    _trees(field, line, day, rng)
    x = 0
    while x < width:
        w = int(rng.integers(height // 3, height))
        if rng.random() < 0.6:
            _house(field, x, w, line, day, rng)
        x += w + int(rng.integers(0, height // 3))
    if not day:
        _street_lamps(field, line, rng)
    return encode(np.asarray(cv2.GaussianBlur(field, (0, 0), 1.0), np.float32), rng)


def _trees(field: Field, line: int, day: bool, rng: Generator) -> None:
    height, width = field.shape
    largest = 4 + height // 22
    for _ in range(width // 60):
        centre = int(rng.integers(width)), line - int(rng.integers(0, height // 8))
        circles = [
            (centre[0] + rng.normal(0, height / 14), centre[1] + rng.normal(0, height / 18), rng.integers(4, largest))
            for _ in range(14)
        ]
        low, high = around(np.array(circles, int)[:, :2], largest, field.shape)
        blob = np.zeros((high - low)[::-1], np.uint8)
        for x, y, radius in circles:
            cv2.circle(blob, (int(x) - int(low[0]), int(y) - int(low[1])), int(radius), 255, -1, cv2.LINE_AA)
        part = field[low[1] : high[1], low[0] : high[0]]
        part[blob > 127] = (0.1 if day else 0.001) * rng.uniform(0.6, 1.5)


def _house(field: Field, x: int, width: int, line: int, day: bool, rng: Generator) -> None:
    height = field.shape[0]
    top = line - int(rng.integers(height // 10, max(height // 10 + 1, line)))
    field[max(0, top) : line + height // 30, x : x + width] = (0.45 if day else 0.003) * rng.uniform(0.5, 1.4)
    step = max(8, height // 16)
    for u in range(x + step // 2, x + width - step, step + step // 2):
        for v in range(max(0, top) + step // 2, line - step, step + step // 2):
            lit = not day and rng.random() < 0.12
            shade = rng.uniform(0.2, 0.6) if lit else (0.08 if day else 0.001)
            field[v : v + step, u : u + step] = shade * rng.uniform(0.7, 1.3)


def _street_lamps(field: Field, line: int, rng: Generator) -> None:
    for x in range(int(rng.integers(40, 120)), field.shape[1], 260):
        cv2.circle(field, (x, max(3, line - field.shape[0] // 6)), 3, 1.0, -1)
