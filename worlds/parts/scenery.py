"""Pictures of outdoor surfaces: asphalt, paint, leaves, cars' details, window panes.

As in ``refseq_bench.worlds.parts.textures``: seeded, grey, (height, width) uint8, sRGB codes, row 0 is the upper edge.
"""

from types import MappingProxyType

import cv2
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.parts.greyscale import FONT, Image, cloud, encode, grey, srgb

ATLAS = MappingProxyType(
    {
        "glass": (0.0, 0.5, 0.5, 1.0),
        "wheel": (0.5, 0.5, 1.0, 1.0),
        "shade": (0.0, 0.0, 0.5, 0.5),
        "plate": (0.5, 0.375, 1.0, 0.5),
        "head": (0.5, 0.1875, 0.75, 0.375),
        "tail": (0.75, 0.1875, 1.0, 0.375),
        "dark": (0.5, 0.0, 1.0, 0.1875),
    }
)
"""Parts of the picture of a car's details: left, bottom, right, top as shares of it."""
ATLAS_SIZE = 256
"""Side of that picture [px]."""


# --- the ground ---


def asphalt(count: tuple[int, int], albedo: float, rng: Generator, pixels: int = 48) -> Image:
    """Draw (columns, rows) tiles of asphalt: stones, worn patches, tarred cracks, drops of oil, mended squares."""
    columns, rows = count
    shape = rows * pixels, columns * pixels
    # Noise of a quarter of the size, so that the picture is drawn in a fraction of the time.
    stones = np.tile(cv2.GaussianBlur(rng.standard_normal((shape[0] // 4, shape[1] // 4)), (0, 0), 0.6), (4, 4))
    worn = cv2.resize(cloud((rows * 6, columns * 6), rng, coarsest=5, fall=0.7), (stones.shape[1], stones.shape[0]))
    field = albedo * (1.0 + 0.26 * stones + 0.10 * worn)
    for _ in range(rng.poisson(0.004 * columns * rows)):
        _mended(field, rng, pixels)
    for _ in range(rng.poisson(0.012 * columns * rows)):
        _crack(field, rng, pixels)
    for _ in range(rng.poisson(0.05 * columns * rows)):
        _drop(field, rng, pixels)
    return encode(np.clip(field, 0.3 * albedo, 2.0 * albedo), rng)


def _mended(field: Floats, rng: Generator, pixels: int) -> None:
    height, width = field.shape
    w, h = (rng.uniform(1.5, 6.0, 2) * pixels).astype(int)
    x, y = int(rng.integers(max(1, width - w))), int(rng.integers(max(1, height - h)))
    field[y : y + h, x : x + w] *= rng.uniform(0.72, 1.2)
    cv2.rectangle(field, (x, y), (x + int(w), y + int(h)), float(0.6 * field.mean()), 2)


def _crack(field: Floats, rng: Generator, pixels: int) -> None:
    height, width = field.shape
    steps = rng.normal(0, 0.35, (int(rng.integers(8, 30)), 2)) + rng.normal(0, 0.4, 2)
    line = rng.uniform(0, 1, 2) * (width, height) + np.cumsum(steps, axis=0) * pixels
    cv2.polylines(field, [line.astype(np.int32)], False, float(0.5 * field.mean()), int(rng.integers(1, 4)))


def _drop(field: Floats, rng: Generator, pixels: int) -> None:
    height, width = field.shape
    radius = rng.uniform(0.06, 0.4) * pixels
    x, y, r = int(rng.integers(width)), int(rng.integers(height)), int(3 * radius) + 1
    patch = field[max(0, y - r) : y + r + 1, max(0, x - r) : x + r + 1]
    v, u = np.mgrid[max(0, y - r) : max(0, y - r) + patch.shape[0], max(0, x - r) : max(0, x - r) + patch.shape[1]]
    patch *= 1.0 - rng.uniform(0.2, 0.6) * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * radius**2))


def mottled(albedo: float, rng: Generator, pixels: int = 256) -> Image:
    """Draw a square of something uneven, such as worn paint, soil, grass or concrete; it repeats without a seam."""
    field = cloud((pixels // 2, pixels // 2), rng, coarsest=6, octaves=5, fall=0.85)
    field = np.block([[field, field[:, ::-1]], [field[::-1], field[::-1, ::-1]]])
    worn = np.clip(1.0 + 0.16 * field, 0.35, 1.5)
    return encode(np.clip(albedo * worn, 0.0, 1.0), rng)


def brick(size: tuple[float, float], albedo: float, rng: Generator, density: int = 100) -> Image:
    """Draw a brick wall of (width, height) [m]: courses of 10 cm, no two bricks quite alike."""
    course, brick = round(0.1 * density), round(0.25 * density)
    rows, columns = round(size[1] * density) // course, round(size[0] * density) // brick
    each = np.kron(1.0 + 0.16 * rng.standard_normal((rows, columns)), np.ones((course, brick)))
    each[::course] = each[1::course] = 1.5  # mortar
    for i in range(rows):
        upright = each[i * course + 2 : (i + 1) * course]
        upright[:, ::brick] = upright[:, 1::brick] = 1.5
        each[i * course : (i + 1) * course] = np.roll(each[i * course : (i + 1) * course], i % 2 * brick // 2, axis=1)
    each *= 1.0 + 0.08 * cloud(each.shape, rng, coarsest=3, octaves=6, fall=0.8)
    return encode(np.clip(albedo * each, 0.0, 1.0), rng)


# --- leaves ---


def hedge(size: tuple[float, float], albedo: float, rng: Generator, density: int = 100) -> Image:
    """Draw a clipped hedge of (width, height) [m]."""
    patch = foliage(albedo, rng, pixels=round(1.5 * density))
    height, width = round(size[1] * density), round(size[0] * density)
    return np.tile(patch, (height // len(patch) + 1, width // len(patch) + 1))[:height, :width]


def foliage(albedo: float, rng: Generator, pixels: int = 256) -> Image:
    """Draw a square full of leaves, each as dark as it lies deep."""
    field = np.full((pixels, pixels), 0.25 * albedo)
    for depth in np.linspace(0.3, 1.4, 700):
        at = rng.uniform(0, pixels, 2).astype(int)
        axes = (rng.uniform(0.02, 0.045, 2) * pixels * (1.0, 0.45)).astype(int) + 1
        shade = float(albedo * depth * rng.uniform(0.75, 1.25))
        cv2.ellipse(field, at.tolist(), axes.tolist(), rng.uniform(0, 180), 0, 360, shade, -1, cv2.LINE_AA)
    return encode(np.clip(field, 0.0, 1.0), rng)


# --- cars and windows ---


def car_atlas(shade: Image, rng: Generator) -> Image:
    """Draw what on a car is not paint, laid out by ``ATLAS``; ``shade`` is the ground under it."""
    image = np.full((ATLAS_SIZE, ATLAS_SIZE), grey(0.03), np.uint8)
    _put(image, "glass", encode(np.linspace(0.10, 0.03, 128)[:, None] * np.ones((1, 128)), rng))
    _put(image, "shade", shade)
    for part, draw in (("wheel", _wheel), ("plate", _plate), ("head", _headlamp), ("tail", _tail_lamp)):
        left, bottom, right, top = ATLAS[part]
        size = round((top - bottom) * ATLAS_SIZE), round((right - left) * ATLAS_SIZE)
        _put(image, part, draw(size, rng))
    return image


def _put(image: Image, part: str, patch: Image) -> None:
    left, bottom, right, top = (round(ATLAS_SIZE * share) for share in ATLAS[part])
    size = right - left, top - bottom
    image[ATLAS_SIZE - top : ATLAS_SIZE - bottom, left:right] = cv2.resize(patch, size, interpolation=cv2.INTER_AREA)


def _wheel(size: tuple[int, int], rng: Generator) -> Image:
    image = np.full(size, grey(0.03), np.uint8)
    middle, radius = (size[1] // 2, size[0] // 2), size[0] // 2
    cv2.circle(image, middle, round(0.66 * radius), grey(rng.uniform(0.25, 0.5)), -1, cv2.LINE_AA)
    spokes = int(rng.integers(4, 9))
    for angle in np.arange(spokes) * 2 * np.pi / spokes + rng.uniform(0, 1):
        at = np.add(middle, 0.42 * radius * np.array([np.cos(angle), np.sin(angle)]))
        cv2.circle(image, at.astype(int).tolist(), round(0.9 * radius / spokes), grey(0.06), -1, cv2.LINE_AA)
    cv2.circle(image, middle, round(0.1 * radius), grey(0.2), -1, cv2.LINE_AA)
    return image


def _plate(size: tuple[int, int], rng: Generator) -> Image:
    """Draw a Portuguese number plate: three pairs of letters and digits."""
    image = np.full(size, grey(0.75), np.uint8)
    pairs = ["".join(rng.choice(list("0123456789"), 2)) for _ in range(2)]
    pairs.insert(int(rng.integers(3)), "".join(rng.choice(list("ABCDEFGHJLMNPQRSTUVXZ"), 2)))
    cv2.putText(image, "-".join(pairs), (8, round(0.75 * size[0])), FONT, 0.72, grey(0.03), 2, cv2.LINE_AA)
    cv2.rectangle(image, (0, 0), (size[1] - 1, size[0] - 1), grey(0.1), 1)
    return image


def _headlamp(size: tuple[int, int], rng: Generator) -> Image:
    image = np.full(size, grey(0.45), np.uint8)
    cv2.circle(image, (size[1] // 2, size[0] // 2), size[0] // 3, grey(rng.uniform(0.6, 0.8)), -1, cv2.LINE_AA)
    cv2.rectangle(image, (0, 0), (size[1] - 1, size[0] - 1), grey(0.1), 2)
    return image


def _tail_lamp(size: tuple[int, int], rng: Generator) -> Image:
    image = np.full(size, grey(0.10), np.uint8)
    image[size[0] // 2 : round(0.7 * size[0])] = grey(rng.uniform(0.3, 0.5))
    return image


def shade_under(size: tuple[float, float], height: float, beyond: float, albedo: float, pixels: int = 64) -> Image:
    """Draw ground under a plate of ``size`` (length, width) that hangs ``height`` above it [m], up to ``beyond`` it.

    Only the part of the sky counts that the plate leaves: 1 − its form factor from each point of the ground.
    """
    x = np.linspace(-1, 1, pixels) * (size[0] / 2 + beyond)
    y = np.linspace(-1, 1, pixels)[:, None] * (size[1] / 2 + beyond)
    hidden = sum(
        _corner_factor((size[0] / 2 + along * x) / height, (size[1] / 2 + across * y) / height)
        for along in (-1, 1)
        for across in (-1, 1)
    )
    return np.round(255 * srgb(albedo * (1.0 - hidden))).astype(np.uint8)


def _corner_factor(x: Floats, y: Floats) -> Floats:
    """Form factor from a small surface to a parallel rectangle of sides x, y (over the distance) over its corner.

    (x / √(1+x²) atan(y / √(1+x²)) + y / √(1+y²) atan(x / √(1+y²))) / 2π: the usual catalogue's, odd in x and y.
    """
    a, b = np.sqrt(1 + x**2), np.sqrt(1 + y**2)
    return (x / a * np.arctan(y / a) + y / b * np.arctan(x / b)) / (2 * np.pi)


def window_pane(size: tuple[float, float], panes: int, rng: Generator, density: int = 64) -> Image:
    """Draw a window of (width, height) [m] from outside, by day: dark, sky in its upper part, blinds at will."""
    height, width = round(size[1] * density), round(size[0] * density)
    field = np.linspace(0.16, 0.05, height)[:, None] * np.ones((1, width))
    field *= 1.0 + 0.12 * cloud((height, width), rng, coarsest=2, octaves=3)
    for i in range(panes):
        left, right = i * width // panes, (i + 1) * width // panes
        drawn = round(height * rng.choice([0.0, 0.0, 0.25, 0.5, 1.0], p=[0.3, 0.2, 0.2, 0.2, 0.1]))
        slats = 0.30 * (1.0 + 0.15 * np.sin(2 * np.pi * np.arange(drawn) / 5.0))
        field[:drawn, left:right] = slats[:, None]
    return encode(np.clip(field, 0.0, 1.0), rng)


def lit_room(size: tuple[float, float], panes: int, rng: Generator, density: int = 64) -> Image:
    """Draw a lit room behind a window of (width, height) [m], as shares of its brightest luminance."""
    height, width = round(size[1] * density), round(size[0] * density)
    field = 0.35 * (1.0 + 0.25 * cloud((height, width), rng, coarsest=2, octaves=4))
    for x in rng.uniform(0.1, 0.8, 2) * width:
        field[: round(0.12 * height), int(x) : int(x + 0.2 * width)] = 1.0
    for x in rng.uniform(0.0, 0.85, 3) * width:
        top = round(height * rng.uniform(0.35, 0.8))
        field[top:, int(x) : int(x + rng.uniform(0.08, 0.2) * width)] *= 0.3
    for i in range(panes):
        drawn = round(height * rng.choice([0.0, 0.3, 0.6], p=[0.6, 0.25, 0.15]))
        field[:drawn, i * width // panes : (i + 1) * width // panes] *= 0.5
    return encode(np.clip(field, 0.0, 1.0), rng)
