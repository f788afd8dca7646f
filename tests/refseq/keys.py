"""Keys of pictures that nobody took: scattered over a plane, and the same plane seen from elsewhere."""

import math

import numpy as np

from refseq.features.word_extractor import PictureKeys


def scene(rng: np.random.Generator, count: int) -> PictureKeys:
    points = rng.uniform((0, 0), (640, 480), (count, 2)).astype(np.float32)
    return PictureKeys(points, rng.integers(0, 120, (count, 128), np.uint8))


def moved(keys: PictureKeys, scale: float, turn: float, shift: tuple[float, float]) -> PictureKeys:
    """The same keys, turned and scaled about the picture's middle and shifted."""
    c, s = scale * math.cos(turn), scale * math.sin(turn)
    points = (keys.points - (320, 240)) @ np.array([[c, s], [-s, c]]) + np.add((320, 240), shift)
    return PictureKeys(points.astype(np.float32), keys.descriptors)
