"""Grey textures drawn by code: what hangs on the walls, lies on the floor and is seen out of the windows.

Every function takes a seeded generator and returns (height, width) uint8. The values are sRGB codes of the albedo
(``srgb``), so that dark print keeps its steps; row 0 is the upper edge.
"""

from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from worlds.arrays import Floats

Image = NDArray[np.uint8]

DENSITY = 640
"""Pixels a metre on what is seen from near: a camera of 45° and 640 columns, 1.2 m away, sees as much."""
FONT = cv2.FONT_HERSHEY_SIMPLEX
INK, PAPER = 0.03, 0.82
SKY_BY_DAY, SKY_BY_NIGHT = 0.9, 0.004
"""Luminance of the sky over the brightest thing outside, by day and by night."""


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
    code = cv2.pow(albedo, 1 / 2.4)  # as ``srgb``, in a quarter of the time
    code *= 1.055
    code -= 0.055
    np.copyto(code, 12.92 * albedo, where=albedo <= 0.0031308)
    code *= 255.0
    code += rng.random(albedo.shape, dtype=np.float32)
    return np.minimum(code, 255, out=code).astype(np.uint8)


def tone(albedo: float) -> int:
    """Return the byte for one albedo."""
    return round(255 * float(srgb(albedo)))


def cloud(
    shape: tuple[int, int], rng: Generator, coarsest: int = 4, octaves: int = 5, fall: float = 0.55
) -> NDArray[np.float32]:
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


def noise(shape: tuple[int, int], rng: Generator) -> NDArray[np.float32]:
    """Draw a number for each pixel, zero mean and unit deviation."""
    return rng.standard_normal(shape, dtype=np.float32)


# --- surfaces ---


def plaster(size: tuple[float, float], albedo: float, rng: Generator, density: int = 100) -> Image:
    """Draw painted plaster of (width, height) [m]: faint mottling, a few scuffs."""
    shape = round(size[1] * density), round(size[0] * density)
    field = albedo * (1.0 + 0.006 * cloud(shape, rng, coarsest=3, octaves=6, fall=0.8))
    for _ in range(rng.poisson(0.35 * size[0])):
        _scuff(field, rng, 0.9 + 0.08 * rng.random())
    return encode(field, rng)


def _scuff(field: NDArray, rng: Generator, darken: float) -> None:
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


def _joints(across: NDArray, pixels: int, strips: int) -> NDArray[np.bool_]:
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
    image[-kick:] = tone(0.35)
    cv2.line(image, (0, shape[0] - kick), (shape[1], shape[0] - kick), tone(0.12), 2)
    _handle(image, density)
    return image


def _handle(image: Image, density: int) -> None:
    x, y = image.shape[1] - round(0.07 * density), image.shape[0] - round(1.05 * density)
    plate = round(0.02 * density), round(0.11 * density)
    cv2.rectangle(image, (x - plate[0], y - plate[1]), (x + plate[0], y + plate[1]), tone(0.5), -1)
    cv2.rectangle(image, (x - round(0.13 * density), y - 6), (x + 4, y + 3), tone(0.3), -1)
    cv2.line(image, (x - round(0.13 * density), y + 5), (x + 4, y + 5), tone(0.08), 2)
    cv2.circle(image, (x, y + round(0.07 * density)), 4, tone(0.03), -1, cv2.LINE_AA)


def metal(size: tuple[float, float], albedo: float, rng: Generator, density: int = 200) -> Image:
    """Draw the front of a cabinet of (width, height) [m]: two doors, a lock, louvres, a stuck label or two."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = encode(albedo * (1.0 + 0.01 * cloud((height, width), rng)), rng)
    dark = tone(0.35 * albedo)
    cv2.rectangle(image, (4, 4), (width - 5, height - 5), dark, 2)
    cv2.line(image, (width // 2, 4), (width // 2, height - 5), dark, 3)
    cv2.rectangle(image, (width // 2 + 8, height // 2 - 14), (width // 2 + 16, height // 2 + 14), tone(0.05), -1)
    for i in range(6):
        y = round(0.08 * height) + 9 * i
        for x in (0.12, 0.62):
            cv2.line(image, (round(x * width), y), (round((x + 0.26) * width), y), dark, 2)
    for _ in range(rng.integers(1, 4)):
        label = printed((rng.integers(24, 44), rng.integers(30, 60)), rng)
        x, y = rng.integers(8, max(9, width - 70)), rng.integers(height // 4, max(height // 4 + 1, height - 70))
        _paste(image, label, x, y)
    return image


def number_plate(label: str, rng: Generator, density: int = DENSITY) -> Image:
    """Draw a door's number plate of 16 cm × 12 cm: the room, and a line with a name."""
    width, height = round(0.16 * density), round(0.12 * density)
    image = np.full((height, width), tone(0.75), np.uint8)
    cv2.rectangle(image, (1, 1), (width - 2, height - 2), tone(0.25), 1)
    cv2.putText(image, label, (6, height // 2), FONT, 0.8, tone(INK), 2, cv2.LINE_AA)
    for i in range(2):
        cv2.putText(image, words(rng, 2), (6, height // 2 + 14 + 12 * i), FONT, 0.3, tone(0.15), 1, cv2.LINE_AA)
    return image


# --- print ---


def words(rng: Generator, count: int) -> str:
    """Return ``count`` made-up words."""
    lengths = 2 + rng.poisson(3.5, count)
    return " ".join("".join(rng.choice(list("aaeeiioourstlnmcdpbgvf"), n)) for n in lengths)


def printed(shape: tuple[int, int], rng: Generator, scale: float = 0.3) -> Image:
    """Draw a sheet of paper with lines of text, (height, width) [px]."""
    image = np.full(shape, tone(PAPER * (0.85 + 0.15 * rng.random())), np.uint8)
    text_block(image, (4, 4, shape[1] - 8, shape[0] - 8), rng, scale)
    return image


def text_block(image: Image, box: tuple[int, int, int, int], rng: Generator, scale: float, ink: float = INK) -> None:
    """Fill ``box`` (x, y, width, height) [px] with paragraphs of text."""
    x, y, width, height = box
    leading, letter = max(5, round(40 * scale)), 18 * scale
    for row in range(y + leading, y + height, leading):
        share = 1.0 if rng.random() < 0.8 else rng.uniform(0.2, 0.8)
        line = words(rng, 2 + int(width * share / (6 * letter)))[: max(1, int(width * share / letter))]
        if rng.random() < 0.93:
            cv2.putText(image, line, (x, row), FONT, scale, tone(ink), 1, cv2.LINE_AA)


def plot(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
    """Draw axes with ticks and either curves, bars or points into ``box`` [px]."""
    x, y, width, height = box
    cv2.rectangle(image, (x, y), (x + width, y + height), tone(0.9), -1)
    left, bottom = x + round(0.12 * width), y + round(0.86 * height)
    right, top = x + round(0.96 * width), y + round(0.08 * height)
    kind = rng.integers(3)
    t = np.linspace(0, 1, 9 if kind == 1 else 60)
    for _ in range(1 if kind == 1 else rng.integers(1, 4)):
        values = 0.5 + 0.35 * np.sin(rng.uniform(1, 9) * t + rng.uniform(0, 6)) * np.exp(-rng.uniform(0, 2) * t)
        values = np.clip(values + 0.05 * rng.standard_normal(t.size), 0.02, 1)
        px = (left + t * (right - left)).astype(np.int32)
        py = (bottom - values * (bottom - top)).astype(np.int32)
        shade = tone(rng.uniform(0.03, 0.35))
        _draw_series(image, kind, px, py, bottom, shade)
    cv2.rectangle(image, (left, top), (right, bottom), tone(INK), 1)
    for i in range(6):
        tick = left + (right - left) * i // 5
        cv2.putText(image, str(i * 2), (tick - 4, bottom + 14), FONT, 0.32, tone(INK), 1, cv2.LINE_AA)
        rung = bottom - (bottom - top) * i // 5
        cv2.line(image, (left - 4, rung), (left, rung), tone(INK), 1)


def _draw_series(image: Image, kind: int, px: NDArray, py: NDArray, bottom: int, shade: int) -> None:
    if kind == 0:
        cv2.polylines(image, [np.stack([px, py], 1)], False, shade, 2, cv2.LINE_AA)
    elif kind == 1:
        step = max(3, int(px[1] - px[0]) // 3)
        for u, v in zip(px.tolist(), py.tolist(), strict=True):
            cv2.rectangle(image, (u - step, v), (u + step, bottom), shade, -1)
    else:
        for u, v in zip(px.tolist(), py.tolist(), strict=True):
            cv2.circle(image, (u, v), 3, shade, -1, cv2.LINE_AA)


def photograph(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
    """Fill ``box`` [px] with something like a photograph: a horizon, light from above, soft and hard shapes."""
    x, y, width, height = box
    field = 0.3 + 0.1 * cloud((height, width), rng, coarsest=3, octaves=7, fall=0.6)
    horizon = round(height * rng.uniform(0.3, 0.7))
    field[:horizon] += 0.25 * np.linspace(1.2, 0.5, horizon)[:, None]
    canvas = encode(field, rng)
    for _ in range(rng.integers(4, 12)):
        _shape(canvas, rng)
    grain = cloud((height, width), rng, coarsest=24, octaves=3)
    image[y : y + height, x : x + width] = np.clip(cv2.GaussianBlur(canvas, (0, 0), 0.8) + 5 * grain, 5, 250)


def _shape(canvas: Image, rng: Generator) -> None:
    height, width = canvas.shape
    centre = rng.uniform(0, 1, 2) * (width, height)
    size = rng.uniform(0.04, 0.22) * min(width, height)
    corners = rng.integers(3, 9)
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radius = size * rng.uniform(0.5, 1.2, corners)
    points = centre + np.stack([np.cos(angle), np.sin(angle)], 1) * radius[:, None]
    cv2.fillPoly(canvas, [points.astype(np.int32)], tone(rng.uniform(0.02, 0.8)), cv2.LINE_AA)


def diagram(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
    """Draw labelled boxes joined by arrows into ``box`` [px]."""
    x, y, width, height = box
    cells = [(i, j) for i in range(3) for j in range(3)]
    chosen = [cells[i] for i in rng.permutation(9)[: rng.integers(4, 8)]]
    centres = [(x + round((i + 0.5) * width / 3), y + round((j + 0.5) * height / 3)) for i, j in chosen]
    for a, b in pairwise(centres):
        cv2.arrowedLine(image, a, b, tone(0.1), 2, cv2.LINE_AA, tipLength=0.08)
    for u, v in centres:
        w, h = round(width * rng.uniform(0.09, 0.14)), round(height * rng.uniform(0.05, 0.1))
        cv2.rectangle(image, (u - w, v - h), (u + w, v + h), tone(rng.uniform(0.35, 0.85)), -1)
        cv2.rectangle(image, (u - w, v - h), (u + w, v + h), tone(INK), 2)
        cv2.putText(image, words(rng, 1)[:7], (u - w + 4, v + 4), FONT, 0.36, tone(INK), 1, cv2.LINE_AA)


def poster(size: tuple[float, float], style: str, rng: Generator, density: int = DENSITY) -> Image:
    """Draw a poster of (width, height) [m] in one of the plan's styles: a heading, then a grid filled by the style."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = np.full((height, width), tone(PAPER * rng.uniform(0.75, 1.0)), np.uint8)
    head = round(height * rng.uniform(0.1, 0.18))
    dark = rng.random() < 0.5
    if dark:
        image[:head] = tone(rng.uniform(0.04, 0.2))
    ink = PAPER if dark else INK
    title = words(rng, 4)[: int(width / 24)].upper()
    cv2.putText(image, title, (16, round(0.5 * head)), FONT, 1.1, tone(ink), 3, cv2.LINE_AA)
    cv2.putText(image, words(rng, 6)[: int(width / 10)], (16, round(0.82 * head)), FONT, 0.5, tone(ink), 1, cv2.LINE_AA)
    _fill_cells(image, _cells(width, height, head, style, rng), style, rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), tone(0.2), 2)
    return image


def whiteboard(size: tuple[float, float], rng: Generator, density: int = DENSITY) -> Image:
    """Draw a whiteboard of (width, height) [m]: what was sketched and written, badly wiped, a metal frame."""
    width, height = round(size[0] * density), round(size[1] * density)
    smears = np.zeros((60, 100), np.float32)
    for _ in range(rng.integers(2, 5)):
        centre, axes = rng.integers((15, 12), (86, 49)).tolist(), rng.integers((10, 5), (25, 12)).tolist()
        cv2.ellipse(smears, centre, axes, float(rng.uniform(-20, 20)), 0, 360, 1.0, -1)
    smears = cv2.resize(cv2.GaussianBlur(smears, (0, 0), 2.0), (width, height), interpolation=cv2.INTER_CUBIC)
    image = encode(0.8 * (1.0 - 0.05 * smears), rng)
    columns = max(1, round(size[0] / 0.7))
    for i in range(columns):
        _sketch(image, (round((i + 0.1) * width / columns), round(0.1 * height)), (width / columns, height), rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), tone(0.45), round(0.03 * density))
    return image


def _sketch(image: Image, at: tuple[int, int], room: tuple[float, float], rng: Generator) -> None:
    """Write or draw by hand into one part of a whiteboard; some parts stay empty."""
    (x, y), (width, height) = at, (round(0.8 * room[0]), round(0.75 * room[1]))
    kind, ink = rng.integers(4), rng.uniform(0.04, 0.2)
    if kind == 0:
        walk = np.cumsum(rng.normal(0, 0.06 * height, 40))
        v = np.clip(y + height / 2 + walk - walk.mean(), y, y + height)
        curve = np.stack([np.linspace(x, x + width, 40), v], axis=1).astype(np.int32)
        cv2.polylines(image, [curve], False, tone(ink), 3, cv2.LINE_AA)
        cv2.arrowedLine(image, (x, y + height), (x, y), tone(ink), 3, cv2.LINE_AA, tipLength=0.05)
        cv2.arrowedLine(image, (x, y + height), (x + width, y + height), tone(ink), 3, cv2.LINE_AA, tipLength=0.05)
    elif kind < 3:
        for line in range(y + 40, y + height, 46):
            if rng.random() < 0.75:
                text = words(rng, int(rng.integers(1, 5)))[: max(1, width // 22)]
                skewed = (x + int(rng.integers(0, 20)), line + int(rng.integers(-6, 7)))
                cv2.putText(image, text, skewed, cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, 1.1, tone(ink), 2, cv2.LINE_AA)


def _cells(width: int, height: int, head: int, style: str, rng: Generator) -> list[tuple[int, int, int, int]]:
    columns = 1 if style == "photo" else int(rng.integers(2, 4))
    rows = 1 if style == "photo" else int(rng.integers(2, 5))
    cuts = head + np.cumsum([0.0, *rng.dirichlet(np.full(rows, 8.0))]) * (height - head)
    w = width // columns
    return [
        (i * w + 12, int(cuts[j]) + 12, w - 24, int(cuts[j + 1] - cuts[j]) - 24)
        for i in range(columns)
        for j in range(rows)
    ]


def _fill_cells(image: Image, cells: list[tuple[int, int, int, int]], style: str, rng: Generator) -> None:
    def text(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
        text_block(image, box, rng, 0.42)

    fillers: dict[str, tuple[Callable[..., None], ...]] = {
        "text": (text, text, text, plot),
        "plots": (plot, plot, text),
        "photo": (photograph,),
        "mixed": (text, plot, photograph, diagram),
        "diagram": (diagram, text),
    }
    for box in cells:
        if min(box[2:]) > 30:
            choice = fillers[style]
            choice[rng.integers(len(choice))](image, box, rng)


def notice_board(size: tuple[float, float], sheets: int, rng: Generator, density: int = DENSITY) -> Image:
    """Draw a cork board of (width, height) [m] with a dark frame and two rows of pinned, slightly askew papers."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = encode(0.28 * (1.0 + 0.16 * noise((height, width), rng)), rng)
    image = cv2.GaussianBlur(image, (0, 0), 0.9)
    columns = (sheets + 1) // 2
    slot = 0.94 * width / columns
    for i in range(sheets):
        row, column = divmod(i, columns)
        w = round(min(rng.uniform(0.8, 1.05) * slot, 0.36 * density))
        h = min(round(w * rng.choice([1.41, 1.41, 0.71, 1.0])), round(0.46 * height))
        x = 0.03 * width + column * slot + rng.uniform(0, max(1.0, slot - w))
        y = height * (0.05 + 0.45 * row) + rng.uniform(0, max(1.0, 0.45 * height - h))
        _pin(image, _paper((h, w), rng), int(x), int(y), rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), tone(0.12), round(0.045 * density))
    return image


def _paper(shape: tuple[int, int], rng: Generator) -> Image:
    sheet = printed(shape, rng, scale=rng.uniform(0.28, 0.5))
    box = (6, 6, shape[1] - 12, shape[0] // 2 - 8)
    if rng.random() < 0.5 and min(box[2:]) > 40:
        (plot, photograph, diagram)[rng.integers(3)](sheet, box, rng)
    else:
        cv2.rectangle(sheet, (0, 0), (shape[1], shape[0] // 8), tone(rng.uniform(0.03, 0.5)), -1)
    return sheet


def _pin(image: Image, sheet: Image, x: int, y: int, rng: Generator) -> None:
    """Paste ``sheet`` turned by a degree or two, with its shadow and a pin."""
    h, w = sheet.shape
    turn = cv2.getRotationMatrix2D((w / 2, h / 2), rng.normal(0, 1.5), 1.0)
    low, high = _around(np.array([(x, y), (x + w, y + h)]), max(h, w) // 4 + 16, image.shape)
    turn[:, 2] += (x, y)
    part = np.s_[low[1] : high[1], low[0] : high[0]]

    def placed(patch: Image) -> Image:
        return cv2.warpAffine(patch, turn, image.shape[::-1], flags=cv2.INTER_LINEAR)[part]

    mask = placed(np.full_like(sheet, 255)) / 255.0
    shadow = cv2.GaussianBlur(np.roll(mask, (3, 2), (0, 1)), (0, 0), 2)
    image[part] = image[part] * (1 - 0.35 * shadow)
    image[part] = image[part] * (1 - mask) + mask * placed(sheet)
    cv2.circle(image, (x + w // 2, y + 8), 4, tone(rng.choice([0.05, 0.4, 0.8])), -1, cv2.LINE_AA)


def _around(points: NDArray[np.integer], margin: int, shape: tuple[int, ...]) -> tuple[NDArray, NDArray]:
    """Corners (x, y) of the part of an image of that shape that lies around ``points`` (n, 2) [px]."""
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return np.clip(low, 0, shape[::-1]), np.clip(high, 0, shape[::-1])


def _paste(image: Image, patch: Image, x: int, y: int) -> None:
    h, w = patch.shape
    room = image[y : y + h, x : x + w]
    room[:] = patch[: room.shape[0], : room.shape[1]]


def sign(size: tuple[float, float], rng: Generator, density: int = DENSITY) -> Image:
    """Draw a small sign of (width, height) [m]: an arrow and a word, light on dark."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = np.full((height, width), tone(0.12), np.uint8)
    middle = height // 2
    ends = [(width // 10, middle), (width * 4 // 10, middle)]
    if rng.random() < 0.5:
        ends.reverse()
    cv2.arrowedLine(image, *ends, tone(0.8), 4, cv2.LINE_AA, tipLength=0.4)
    cv2.putText(image, words(rng, 1)[:6].upper(), (width // 2, middle + 8), FONT, 0.7, tone(0.8), 2, cv2.LINE_AA)
    return image


# --- out of the windows: linear luminance as a share of the brightest, not albedo ---


def outside(width: int, height: int, horizon: float, day: bool, rng: Generator) -> Image:
    """Draw what is seen out of the windows, (height, width) [px], as sRGB code of luminance over its peak.

    ``horizon`` is the height of the horizon as a share of the picture. By day: sky, houses, trees, a lawn. By night:
    the same shapes nearly black, with some lit windows and street lamps.
    """
    line = round((1.0 - horizon) * height)
    field = np.full((height, width), SKY_BY_DAY if day else SKY_BY_NIGHT, np.float32)
    fade = np.clip(np.linspace(0.0, 2.0, height, dtype=np.float32), 0.0, 1.0)[
        :, None
    ]  # the plain sky goes on above the picture
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
    return encode(cv2.GaussianBlur(field, (0, 0), 1.0), rng)


def _trees(field: NDArray, line: int, day: bool, rng: Generator) -> None:
    height, width = field.shape
    largest = 4 + height // 22
    for _ in range(width // 60):
        centre = int(rng.integers(width)), line - int(rng.integers(0, height // 8))
        circles = [
            (centre[0] + rng.normal(0, height / 14), centre[1] + rng.normal(0, height / 18), rng.integers(4, largest))
            for _ in range(14)
        ]
        low, high = _around(np.array(circles, int)[:, :2], largest, field.shape)
        blob = np.zeros((high - low)[::-1], np.uint8)
        for x, y, radius in circles:
            cv2.circle(blob, (int(x) - int(low[0]), int(y) - int(low[1])), int(radius), 255, -1, cv2.LINE_AA)
        part = field[low[1] : high[1], low[0] : high[0]]
        part[blob > 127] = (0.1 if day else 0.001) * rng.uniform(0.6, 1.5)


def _house(field: NDArray, x: int, width: int, line: int, day: bool, rng: Generator) -> None:
    height = field.shape[0]
    top = line - int(rng.integers(height // 10, max(height // 10 + 1, line)))
    field[max(0, top) : line + height // 30, x : x + width] = (0.45 if day else 0.003) * rng.uniform(0.5, 1.4)
    step = max(8, height // 16)
    for u in range(x + step // 2, x + width - step, step + step // 2):
        for v in range(max(0, top) + step // 2, line - step, step + step // 2):
            lit = not day and rng.random() < 0.12
            shade = rng.uniform(0.2, 0.6) if lit else (0.08 if day else 0.001)
            field[v : v + step, u : u + step] = shade * rng.uniform(0.7, 1.3)


def _street_lamps(field: NDArray, line: int, rng: Generator) -> None:
    for x in range(int(rng.integers(40, 120)), field.shape[1], 260):
        cv2.circle(field, (x, max(3, line - field.shape[0] // 6)), 3, 1.0, -1)
