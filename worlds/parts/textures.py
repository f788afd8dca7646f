"""Pictures of indoor surfaces: plaster, floors, ceilings, wood, metal.

Every function takes a seeded generator and returns a grey picture (``greyscale``).
"""

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from refseq_bench.worlds.parts.greyscale import Image, cloud, encode, grey, noise, paste
from refseq_bench.worlds.parts.posters import printed_page


def plaster(size: tuple[float, float], albedo: float, rng: Generator, density: int = 100) -> Image:
    """Draw painted plaster of (width, height) [m]: faint mottling, a few scuffs."""
    shape = round(size[1] * density), round(size[0] * density)
    field = albedo * (1.0 + 0.006 * cloud(shape, rng, coarsest=3, octaves=6, fall=0.8))
    for _ in range(rng.poisson(0.35 * size[0])):
        _scuff(field, rng, 0.9 + 0.08 * rng.random())
    return encode(field, rng)


def _scuff(field: NDArray[np.floating], rng: Generator, darken: float) -> None:
    height, width = field.shape
    mask = np.zeros(field.shape, np.uint8)
    start = np.array([rng.integers(width), height * (0.55 + 0.4 * rng.random())])
    end = start + rng.normal(0, 0.12, 2) * height
    cv2.line(mask, start.astype(int).tolist(), end.astype(int).tolist(), 255, 1, cv2.LINE_AA)
    field *= 1.0 - (1.0 - darken) * mask / 255.0


def tiles(count: tuple[int, int], albedo: float, rng: Generator, pixels: int = 48) -> Image:
    """Draw a floor of (columns, rows) tiles; no two quite alike, speckled, with dark joints."""
    columns, rows = count
    each = np.kron(1.0 + 0.035 * noise((rows, columns), rng), np.ones((pixels, pixels), np.float32))
    speckle = cv2.GaussianBlur(noise(each.shape, rng), (0, 0), 1.0)
    field = albedo * (each + 0.06 * speckle)
    field[::pixels] *= 0.7
    field[:, ::pixels] *= 0.7
    return encode(field, rng)


def carpet(count: tuple[int, int], albedo: float, rng: Generator, pixels: int = 48) -> Image:
    """Draw a floor of (columns, rows) carpet tiles, each a quarter turned against the next; trodden spots."""
    columns, rows = count
    shape = rows * pixels, columns * pixels
    pile = noise(shape, rng)
    along = cv2.GaussianBlur(pile, (0, 0), sigmaX=2.0, sigmaY=0.5, borderType=cv2.BORDER_REFLECT)
    across = cv2.GaussianBlur(pile, (0, 0), sigmaX=0.5, sigmaY=2.0, borderType=cv2.BORDER_REFLECT)
    turned = _checkered(count, pixels)
    loops = np.where(turned, along / along.std(), across / across.std())
    field = albedo * (1.0 + 0.03 * np.where(turned, 1, -1) + 0.12 * loops + 0.04 * cloud(shape, rng, coarsest=3))
    return encode(field, rng)


def parquet(count: tuple[int, int], albedo: float, rng: Generator, pixels: int = 48, strips: int = 5) -> Image:
    """Draw a floor of (columns, rows) squares of oak strips, each a quarter turned against the next."""
    columns, rows = count
    shape = rows * pixels, columns * pixels
    v, u = np.indices(shape)
    turned = _checkered(count, pixels)
    place = np.where(turned, v, u) % pixels * strips // pixels
    oak = 1.0 + 0.11 * rng.standard_normal((rows, columns, strips))[v // pixels, u // pixels, place]
    grain = noise(shape, rng)
    upright = cv2.GaussianBlur(grain, (0, 0), sigmaX=0.6, sigmaY=7.0)
    lying = cv2.GaussianBlur(grain, (0, 0), sigmaX=7.0, sigmaY=0.6)
    grain = np.where(turned, lying / lying.std(), upright / upright.std())
    field = albedo * oak * (1.0 + 0.07 * grain)
    field[_joints(np.where(turned, v, u), pixels, strips)] *= 0.72
    field[(u % pixels == 0) | (v % pixels == 0)] *= 0.72
    return encode(field, rng)


def _checkered(count: tuple[int, int], pixels: int) -> NDArray[np.bool_]:
    """Every second square of (columns, rows), as a mask of pixels."""
    squares = np.indices(count[::-1]).sum(axis=0) % 2 == 0
    return np.kron(squares, np.ones((pixels, pixels), bool))


def _joints(across: NDArray[np.integer], pixels: int, strips: int) -> NDArray[np.bool_]:
    """Where one strip ends and the next begins."""
    return (across % pixels * strips) % pixels < strips


def ceiling_panels(count: tuple[int, int], albedo: float, rng: Generator, pixels: int = 72) -> Image:
    """Draw a ceiling of (columns, rows) mineral-fibre panels: pinholes and thin metal bars."""
    columns, rows = count
    field = np.full((rows * pixels, columns * pixels), albedo)
    field *= np.kron(1.0 + 0.012 * rng.standard_normal((rows, columns)), np.ones((pixels, pixels), np.float32))
    field[rng.random(field.shape) < 0.03] *= 0.8
    for edge in (0, 1):
        field[edge::pixels] = field[:, edge::pixels] = albedo * (1.05 if edge else 0.75)
    return encode(field, rng)


def wood(size: tuple[float, float], albedo: float, rng: Generator, density: int = 320) -> Image:
    """Draw a veneered door leaf of (width, height) [m]: upright grain, a kick plate, a lock with its handle."""
    shape = round(size[1] * density), round(size[0] * density)
    grain = cv2.GaussianBlur(noise(shape, rng), (0, 0), sigmaX=1.2, sigmaY=40)
    bands = cv2.GaussianBlur(rng.standard_normal((1, shape[1])), (0, 0), 14)
    field = albedo * (1.0 + 0.05 * grain / grain.std() + 0.05 * bands / bands.std())
    image = encode(field, rng)
    kick = round(0.22 * density)
    image[-kick:] = grey(0.35)
    cv2.line(image, (0, shape[0] - kick), (shape[1], shape[0] - kick), grey(0.12), 2)
    _handle(image, density)
    return image


def _handle(image: Image, density: int) -> None:
    x, y = image.shape[1] - round(0.07 * density), image.shape[0] - round(1.05 * density)
    plate = round(0.02 * density), round(0.11 * density)
    cv2.rectangle(image, (x - plate[0], y - plate[1]), (x + plate[0], y + plate[1]), grey(0.5), -1)
    cv2.rectangle(image, (x - round(0.13 * density), y - 6), (x + 4, y + 3), grey(0.3), -1)
    cv2.line(image, (x - round(0.13 * density), y + 5), (x + 4, y + 5), grey(0.08), 2)
    cv2.circle(image, (x, y + round(0.07 * density)), 4, grey(0.03), -1, cv2.LINE_AA)


def metal(size: tuple[float, float], albedo: float, rng: Generator, density: int = 200) -> Image:
    """Draw the front of a cabinet of (width, height) [m]: two doors, a lock, louvres, a stuck label or two."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = encode(albedo * (1.0 + 0.01 * cloud((height, width), rng)), rng)
    dark = grey(0.35 * albedo)
    cv2.rectangle(image, (4, 4), (width - 5, height - 5), dark, 2)
    cv2.line(image, (width // 2, 4), (width // 2, height - 5), dark, 3)
    cv2.rectangle(image, (width // 2 + 8, height // 2 - 14), (width // 2 + 16, height // 2 + 14), grey(0.05), -1)
    for i in range(6):
        y = round(0.08 * height) + 9 * i
        for x in (0.12, 0.62):
            cv2.line(image, (round(x * width), y), (round((x + 0.26) * width), y), dark, 2)
    for _ in range(rng.integers(1, 4)):
        label = printed_page((int(rng.integers(24, 44)), int(rng.integers(30, 60))), rng)
        left, top = rng.integers(8, max(9, width - 70)), rng.integers(height // 4, max(height // 4 + 1, height - 70))
        paste(image, label, int(left), int(top))
    return image
