"""Printed and written surfaces: posters, notice boards, whiteboards, plates and signs.

Every function takes a seeded generator and returns a grey picture (``greyscale``), or draws into one.
"""

from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.parts.greyscale import (
    DENSITY,
    FONT,
    INK,
    PAPER,
    Image,
    Pixels,
    around,
    cloud,
    encode,
    grey,
    noise,
)


def number_plate(label: str, rng: Generator, density: int = DENSITY) -> Image:
    """Draw a door's number plate of 16 cm × 12 cm: the room, and a line with a name."""
    width, height = round(0.16 * density), round(0.12 * density)
    image = np.full((height, width), grey(0.75), np.uint8)
    cv2.rectangle(image, (1, 1), (width - 2, height - 2), grey(0.25), 1)
    cv2.putText(image, label, (6, height // 2), FONT, 0.8, grey(INK), 2, cv2.LINE_AA)
    for i in range(2):
        cv2.putText(image, words(rng, 2), (6, height // 2 + 14 + 12 * i), FONT, 0.3, grey(0.15), 1, cv2.LINE_AA)
    return image


def words(rng: Generator, count: int) -> str:
    """Return ``count`` made-up words."""
    lengths = 2 + rng.poisson(3.5, count)
    return " ".join("".join(rng.choice(list("aaeeiioourstlnmcdpbgvf"), n)) for n in lengths)


def printed_page(shape: tuple[int, int], rng: Generator, scale: float = 0.3) -> Image:
    """Draw a sheet of paper with lines of text, (height, width) [px]."""
    image = np.full(shape, grey(PAPER * (0.85 + 0.15 * rng.random())), np.uint8)
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
            cv2.putText(image, line, (x, row), FONT, scale, grey(ink), 1, cv2.LINE_AA)


def plot(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
    """Draw axes with ticks and either curves, bars or points into ``box`` [px]."""
    x, y, width, height = box
    cv2.rectangle(image, (x, y), (x + width, y + height), grey(0.9), -1)
    left, bottom = x + round(0.12 * width), y + round(0.86 * height)
    right, top = x + round(0.96 * width), y + round(0.08 * height)
    kind = int(rng.integers(3))
    t = np.linspace(0, 1, 9 if kind == 1 else 60)
    for _ in range(1 if kind == 1 else rng.integers(1, 4)):
        values = 0.5 + 0.35 * np.sin(rng.uniform(1, 9) * t + rng.uniform(0, 6)) * np.exp(-rng.uniform(0, 2) * t)
        values = np.clip(values + 0.05 * rng.standard_normal(t.size), 0.02, 1)
        px = (left + t * (right - left)).astype(np.int32)
        py = (bottom - values * (bottom - top)).astype(np.int32)
        shade = grey(rng.uniform(0.03, 0.35))
        _draw_series(image, kind, px, py, bottom, shade)
    cv2.rectangle(image, (left, top), (right, bottom), grey(INK), 1)
    for i in range(6):
        tick = left + (right - left) * i // 5
        cv2.putText(image, str(i * 2), (tick - 4, bottom + 14), FONT, 0.32, grey(INK), 1, cv2.LINE_AA)
        rung = bottom - (bottom - top) * i // 5
        cv2.line(image, (left - 4, rung), (left, rung), grey(INK), 1)


def _draw_series(image: Image, kind: int, px: Pixels, py: Pixels, bottom: int, shade: int) -> None:
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
    cv2.fillPoly(canvas, [points.astype(np.int32)], grey(rng.uniform(0.02, 0.8)), cv2.LINE_AA)


def diagram(image: Image, box: tuple[int, int, int, int], rng: Generator) -> None:
    """Draw labelled boxes joined by arrows into ``box`` [px]."""
    x, y, width, height = box
    cells = [(i, j) for i in range(3) for j in range(3)]
    chosen = [cells[i] for i in rng.permutation(9)[: rng.integers(4, 8)]]
    centres = [(x + round((i + 0.5) * width / 3), y + round((j + 0.5) * height / 3)) for i, j in chosen]
    for a, b in pairwise(centres):
        cv2.arrowedLine(image, a, b, grey(0.1), 2, cv2.LINE_AA, tipLength=0.08)
    for u, v in centres:
        w, h = round(width * rng.uniform(0.09, 0.14)), round(height * rng.uniform(0.05, 0.1))
        cv2.rectangle(image, (u - w, v - h), (u + w, v + h), grey(rng.uniform(0.35, 0.85)), -1)
        cv2.rectangle(image, (u - w, v - h), (u + w, v + h), grey(INK), 2)
        cv2.putText(image, words(rng, 1)[:7], (u - w + 4, v + 4), FONT, 0.36, grey(INK), 1, cv2.LINE_AA)


def poster(size: tuple[float, float], style: str, rng: Generator, density: int = DENSITY) -> Image:
    """Draw a poster of (width, height) [m] in one of the plan's styles: a heading, then a grid filled by the style."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = np.full((height, width), grey(PAPER * rng.uniform(0.75, 1.0)), np.uint8)
    head = round(height * rng.uniform(0.1, 0.18))
    dark = rng.random() < 0.5
    if dark:
        image[:head] = grey(rng.uniform(0.04, 0.2))
    ink = PAPER if dark else INK
    title = words(rng, 4)[: int(width / 24)].upper()
    cv2.putText(image, title, (16, round(0.5 * head)), FONT, 1.1, grey(ink), 3, cv2.LINE_AA)
    cv2.putText(image, words(rng, 6)[: int(width / 10)], (16, round(0.82 * head)), FONT, 0.5, grey(ink), 1, cv2.LINE_AA)
    _fill_cells(image, _cells(width, height, head, style, rng), style, rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), grey(0.2), 2)
    return image


def whiteboard(size: tuple[float, float], rng: Generator, density: int = DENSITY) -> Image:
    """Draw a whiteboard of (width, height) [m]: what was sketched and written, badly wiped, a metal frame."""
    width, height = round(size[0] * density), round(size[1] * density)
    wiped = np.zeros((60, 100), np.float32)
    for _ in range(rng.integers(2, 5)):
        centre, axes = rng.integers((15, 12), (86, 49)).tolist(), rng.integers((10, 5), (25, 12)).tolist()
        cv2.ellipse(wiped, centre, axes, float(rng.uniform(-20, 20)), 0, 360, 1.0, -1)
    smears = cv2.resize(cv2.GaussianBlur(wiped, (0, 0), 2.0), (width, height), interpolation=cv2.INTER_CUBIC)
    image = encode(0.8 * (1.0 - 0.05 * smears), rng)
    columns = max(1, round(size[0] / 0.7))
    for i in range(columns):
        _sketch(image, (round((i + 0.1) * width / columns), round(0.1 * height)), (width / columns, height), rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), grey(0.45), round(0.03 * density))
    return image


def _sketch(image: Image, at: tuple[int, int], room: tuple[float, float], rng: Generator) -> None:
    """Write or draw by hand into one part of a whiteboard; some parts stay empty."""
    (x, y), (width, height) = at, (round(0.8 * room[0]), round(0.75 * room[1]))
    kind, ink = rng.integers(4), rng.uniform(0.04, 0.2)
    if kind == 0:
        walk = np.cumsum(rng.normal(0, 0.06 * height, 40))
        v = np.clip(y + height / 2 + walk - walk.mean(), y, y + height)
        curve = np.stack([np.linspace(x, x + width, 40), v], axis=1).astype(np.int32)
        cv2.polylines(image, [curve], False, grey(ink), 3, cv2.LINE_AA)
        cv2.arrowedLine(image, (x, y + height), (x, y), grey(ink), 3, cv2.LINE_AA, tipLength=0.05)
        cv2.arrowedLine(image, (x, y + height), (x + width, y + height), grey(ink), 3, cv2.LINE_AA, tipLength=0.05)
    elif kind < 3:
        for line in range(y + 40, y + height, 46):
            if rng.random() < 0.75:
                text = words(rng, int(rng.integers(1, 5)))[: max(1, width // 22)]
                skewed = (x + int(rng.integers(0, 20)), line + int(rng.integers(-6, 7)))
                cv2.putText(image, text, skewed, cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, 1.1, grey(ink), 2, cv2.LINE_AA)


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
    cork = encode(0.28 * (1.0 + 0.16 * noise((height, width), rng)), rng)
    image = np.asarray(cv2.GaussianBlur(cork, (0, 0), 0.9), np.uint8)
    columns = (sheets + 1) // 2
    slot = 0.94 * width / columns
    for i in range(sheets):
        row, column = divmod(i, columns)
        w = max(1, round(min(rng.uniform(0.8, 1.05) * slot, 0.36 * density)))
        h = max(1, min(round(w * rng.choice([1.41, 1.41, 0.71, 1.0])), round(0.46 * height)))
        x = 0.03 * width + column * slot + rng.uniform(0, max(1.0, slot - w))
        y = height * (0.05 + 0.45 * row) + rng.uniform(0, max(1.0, 0.45 * height - h))
        _pin(image, _paper((h, w), rng), int(x), int(y), rng)
    cv2.rectangle(image, (0, 0), (width - 1, height - 1), grey(0.12), round(0.045 * density))
    return image


def _paper(shape: tuple[int, int], rng: Generator) -> Image:
    sheet = printed_page(shape, rng, scale=rng.uniform(0.28, 0.5))
    box = (6, 6, shape[1] - 12, shape[0] // 2 - 8)
    if rng.random() < 0.5 and min(box[2:]) > 40:
        (plot, photograph, diagram)[rng.integers(3)](sheet, box, rng)
    else:
        cv2.rectangle(sheet, (0, 0), (shape[1], shape[0] // 8), grey(rng.uniform(0.03, 0.5)), -1)
    return sheet


def _pin(image: Image, sheet: Image, x: int, y: int, rng: Generator) -> None:
    """Paste ``sheet`` turned by a degree or two, with its shadow and a pin."""
    h, w = sheet.shape
    turn = cv2.getRotationMatrix2D((w / 2, h / 2), rng.normal(0, 1.5), 1.0)
    low, high = around(np.array([(x, y), (x + w, y + h)]), max(h, w) // 4 + 16, image.shape)
    turn[:, 2] += (x, y)
    part = np.s_[low[1] : high[1], low[0] : high[0]]

    def placed(patch: Image) -> Image:
        return np.asarray(cv2.warpAffine(patch, turn, image.shape[::-1], flags=cv2.INTER_LINEAR)[part], np.uint8)

    mask = placed(np.full_like(sheet, 255)) / 255.0
    shadow = cv2.GaussianBlur(np.roll(mask, (3, 2), (0, 1)), (0, 0), 2)
    image[part] = image[part] * (1 - 0.35 * shadow)
    image[part] = image[part] * (1 - mask) + mask * placed(sheet)
    cv2.circle(image, (x + w // 2, y + 8), 4, grey(rng.choice([0.05, 0.4, 0.8])), -1, cv2.LINE_AA)


def sign(size: tuple[float, float], rng: Generator, density: int = DENSITY) -> Image:
    """Draw a small sign of (width, height) [m]: an arrow and a word, light on dark."""
    width, height = round(size[0] * density), round(size[1] * density)
    image = np.full((height, width), grey(0.12), np.uint8)
    middle = height // 2
    ends = [(width // 10, middle), (width * 4 // 10, middle)]
    if rng.random() < 0.5:
        ends.reverse()
    cv2.arrowedLine(image, ends[0], ends[1], grey(0.8), 4, cv2.LINE_AA, tipLength=0.4)
    cv2.putText(image, words(rng, 1)[:6].upper(), (width // 2, middle + 8), FONT, 0.7, grey(0.8), 2, cv2.LINE_AA)
    return image
