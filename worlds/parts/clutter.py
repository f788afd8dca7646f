"""Things that stand on tables and shelves: instruments, screens, books, cartons, robots; all made of boxes.

A thing stands at the origin of its own frame, its front towards positive ``out``. Sizes are common ones, not measured.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Block, Span

GREYS = {"black": 0.03, "dark": 0.1, "grey": 0.3, "light": 0.55, "paper": 0.78}
"""Albedo of what things are made of."""


class GreyBox(NamedTuple):
    """A box of one grey."""

    grey: str
    block: Block


@dataclass(frozen=True, slots=True)
class ClutterItem:
    """Boxes within ``size``: width, depth, height [m]; from the middle of the footprint on."""

    size: tuple[float, float, float]
    parts: tuple[GreyBox, ...]

    @property
    def hull(self) -> Block:
        """The box around its parts, which may be less than ``size``."""
        spans = np.array([part.block for part in self.parts])
        s, out, z = np.stack([spans[..., 0].min(axis=0), spans[..., 1].max(axis=0)], axis=1).tolist()
        return tuple(s), tuple(out), tuple(z)


Maker = Callable[[Generator], ClutterItem]


class Placed(NamedTuple):
    """A thing and where its middle stands: along and out [m], turned by ``turn`` [rad]."""

    s: float
    out: float
    turn: float
    thing: ClutterItem


def row(
    makers: tuple[Maker, ...], room: tuple[float, float, float], gap: float, turn: float, rng: Generator
) -> Iterator[Placed]:
    """Set things side by side into a ``room`` of (width, depth, height) [m] whose middle is the origin.

    Gaps are exponential of mean ``gap`` [m], at least 3 cm; ``turn`` [rad] is the standard deviation of the angles.
    What is drawn and does not fit is left out.
    """
    width, depth, height = room
    s = -width / 2 + rng.exponential(gap)
    while s < width / 2 - 0.1:
        thing = makers[rng.integers(len(makers))](rng)
        wide, deep, high = thing.size
        if s + wide <= width / 2 and deep <= depth and high <= height:
            out = (depth - deep) / 2 * rng.uniform(-0.9, 0.9)
            yield Placed(s + wide / 2, out, turn * float(rng.standard_normal()), thing)
            s += wide
        s += 0.03 + rng.exponential(gap)


# --- what instruments and screens are made of ---


def _slab(width: float, depth: float, low: float, high: float, s: float = 0.0, out: float = 0.0) -> Block:
    """A box about (s, out)."""
    return (s - width / 2, s + width / 2), (out - depth / 2, out + depth / 2), (low, high)


def _on_face(out: float, s: Span, z: Span, proud: float = 0.006) -> Block:
    """A plate that stands out of a face at ``out``."""
    return s, (out, out + proud), z


def instrument(rng: Generator) -> ClutterItem:
    """Draw an oscilloscope or power supply: a screen, rows of knobs, sockets."""
    width, depth, height = rng.uniform(0.3, 0.44), rng.uniform(0.24, 0.36), rng.uniform(0.13, 0.22)
    return ClutterItem((width, depth, height), tuple(_instrument(width, depth, 0.0, height, rng)))


def rack(rng: Generator) -> ClutterItem:
    """Draw two or three instruments on top of each other."""
    width, depth, height = 0.43, rng.uniform(0.3, 0.38), 0.0
    parts: list[GreyBox] = []
    for _ in range(rng.integers(2, 4)):
        low, height = height, height + rng.uniform(0.1, 0.17)
        parts += _instrument(width, depth, low + 0.004, height, rng)
    return ClutterItem((width, depth, height), tuple(parts))


def _instrument(width: float, depth: float, low: float, high: float, rng: Generator) -> Iterator[GreyBox]:
    face, split = depth / 2 - 0.02, width * rng.uniform(-0.1, 0.15)
    dark = rng.random() < 0.5
    yield GreyBox("dark" if dark else "light", _slab(width, depth - 0.03, low + 0.012, high, out=-0.005))
    yield GreyBox("black", _slab(width - 0.06, depth - 0.08, low, low + 0.012))
    left, right, front = -width / 2, width / 2, face + 0.006
    yield GreyBox(
        "grey" if dark else "paper", _on_face(face, (left + 0.008, right - 0.008), (low + 0.02, high - 0.008))
    )
    yield GreyBox("black", _on_face(front, (left + 0.025, split), (low + 0.055, high - 0.025), 0.002))
    pitch = rng.uniform(0.028, 0.04)
    for s in np.arange(split + 0.03, right - 0.02, pitch).tolist():
        for z in np.arange(low + 0.06, high - 0.02, pitch).tolist():
            half, grey = rng.uniform(0.004, 0.011), "dark" if rng.random() < 0.7 else "light"
            yield GreyBox(grey, _on_face(front, (s - half, s + half), (z - half, z + half), 0.012))
    for s in np.arange(left + 0.03, right - 0.02, 0.045).tolist():
        yield GreyBox("black", _on_face(front, (s - 0.008, s + 0.008), (low + 0.026, low + 0.042), 0.008))


def monitor(rng: Generator) -> ClutterItem:
    """Draw a flat screen on its foot, switched off."""
    width, tall, lift = rng.uniform(0.38, 0.52), rng.uniform(0.3, 0.34), rng.uniform(0.08, 0.13)
    return ClutterItem((width, 0.2, lift + tall), tuple(_monitor(width, tall, lift, 0.0)))


def _monitor(width: float, tall: float, lift: float, out: float) -> Iterator[GreyBox]:
    yield GreyBox("dark", _slab(0.24, 0.19, 0.0, 0.018, out=out))
    yield GreyBox("dark", _slab(0.06, 0.03, 0.018, lift + tall / 2, out=out - 0.03))
    yield GreyBox("dark", _slab(width, 0.045, lift, lift + tall, out=out + 0.005))
    edge, face = width / 2, out + 0.0275
    yield GreyBox("black", _on_face(face, (-edge + 0.018, edge - 0.018), (lift + 0.03, lift + tall - 0.018), 0.002))
    yield GreyBox("light", _on_face(face, (edge - 0.05, edge - 0.03), (lift + 0.009, lift + 0.018), 0.003))


def workplace(rng: Generator) -> ClutterItem:
    """Draw a screen with its keyboard and mouse, and a mug or a sheet of paper beside them."""
    width, tall, lift = rng.uniform(0.38, 0.52), rng.uniform(0.3, 0.34), rng.uniform(0.06, 0.12)
    parts = [*_monitor(width, tall, lift, -0.16), *_keyboard(-0.04, 0.14)]
    parts.append(GreyBox("dark", _slab(0.06, 0.1, 0.0, 0.03, s=0.26, out=0.14)))
    parts.append(GreyBox("paper", _slab(0.21, 0.297, 0.0, rng.uniform(0.002, 0.03), s=0.44, out=0.08)))
    parts.append(GreyBox("light", _slab(0.08, 0.08, 0.0, 0.095, s=-0.42, out=rng.uniform(-0.1, 0.1))))
    return ClutterItem((1.1, 0.54, lift + tall), tuple(parts))


def _keyboard(s: float, out: float) -> Iterator[GreyBox]:
    yield GreyBox("dark", _slab(0.45, 0.16, 0.0, 0.018, s=s, out=out))
    for line in np.arange(5) * 0.026 + out - 0.052:
        yield GreyBox("grey", _slab(0.42, 0.019, 0.018, 0.024, s=s, out=float(line)))


def laptop(rng: Generator) -> ClutterItem:
    """Draw an open laptop."""
    grey = "grey" if rng.random() < 0.5 else "black"
    parts = (
        GreyBox(grey, _slab(0.34, 0.25, 0.0, 0.025)),
        GreyBox("dark", _slab(0.29, 0.11, 0.025, 0.028, out=-0.04)),
        GreyBox(grey, _slab(0.34, 0.016, 0.025, 0.26, out=-0.13)),
        GreyBox("black", _on_face(-0.122, (-0.155, 0.155), (0.045, 0.245), 0.002)),
    )
    return ClutterItem((0.34, 0.276, 0.26), parts)


def computer(rng: Generator) -> ClutterItem:
    """Draw a computer's tower."""
    grey = "light" if rng.random() < 0.6 else "dark"
    other = "grey" if grey == "light" else "black"
    body = GreyBox(grey, _slab(0.19, 0.42, 0.0, 0.42))
    slots = [GreyBox(other, _on_face(0.21, (-0.075, 0.075), (z, z + 0.03))) for z in (0.37, 0.325, 0.28)]
    grill = [GreyBox("black", _on_face(0.21, (-0.05, 0.05), (z, z + 0.006))) for z in np.arange(0.05, 0.16, 0.018)]
    button = GreyBox("black", _on_face(0.21, (0.03, 0.06), (0.22, 0.25), 0.008))
    return ClutterItem((0.19, 0.436, 0.42), (body, *slots, *grill, button))


# --- paper and cartons ---


def papers(rng: Generator) -> ClutterItem:
    """Draw a few stacks of sheets."""
    parts = [
        GreyBox("paper", _slab(0.21, 0.297, 0.0, rng.uniform(0.002, 0.05), s=s, out=rng.uniform(-0.04, 0.04)))
        for s in (-0.14, 0.12)
    ]
    return ClutterItem((0.5, 0.38, 0.05), tuple(parts))


def pile(rng: Generator) -> ClutterItem:
    """Draw books that lie on top of each other."""
    parts: list[GreyBox] = []
    z = 0.0
    for _ in range(rng.integers(2, 7)):
        low, z = z, z + rng.uniform(0.012, 0.045)
        width, depth = rng.uniform(0.22, 0.3), rng.uniform(0.16, 0.22)
        s, out = rng.normal(0.0, 0.008, 2).clip(-0.02, 0.02)
        parts.append(GreyBox(_cover(rng), _slab(width, depth, low, z, s=float(s), out=float(out))))
        edge = float(out) + depth / 2
        parts.append(
            GreyBox("paper", _on_face(edge, (float(s) - 0.3 * width, float(s)), (low + 0.004, z - 0.004), 0.001))
        )
    return ClutterItem((0.34, 0.27, z), tuple(parts))


def books(rng: Generator) -> ClutterItem:
    """Draw a row of books that stand upright."""
    widths, parts = rng.uniform(0.014, 0.05, rng.integers(5, 14)), []
    s = -float(widths.sum()) / 2
    for width in widths.tolist():
        high, front = rng.uniform(0.2, 0.3), rng.uniform(0.09, 0.11)
        grey = _cover(rng)
        parts.append(GreyBox(grey, ((s, s + 0.94 * width), (-0.1, front), (0.0, high))))
        label = "paper" if grey in ("black", "dark", "grey") else "dark"
        z = high * rng.uniform(0.35, 0.6)
        parts.append(GreyBox(label, _on_face(front, (s + 0.2 * width, s + 0.74 * width), (z, z + 0.28 * high), 0.001)))
        s += width
    return ClutterItem((float(widths.sum()), 0.222, 0.3), tuple(parts))


def binders(rng: Generator) -> ClutterItem:
    """Draw a row of ring binders: labelled spines with a ring to pull them out by."""
    count, width, grey = int(rng.integers(3, 9)), float(rng.choice([0.055, 0.08])), _cover(rng)
    parts: list[GreyBox] = []
    for i in range(count):
        cover = _cover(rng) if rng.random() < 0.25 else grey
        parts += _binder((i - count / 2) * width, width, 0.14 - rng.uniform(0.0, 0.012), cover, rng)
    return ClutterItem((count * width, 0.29, 0.318), tuple(parts))


def _binder(a: float, width: float, front: float, cover: str, rng: Generator) -> Iterator[GreyBox]:
    b, middle = a + width - 0.003, a + width / 2
    yield GreyBox(cover, ((a, b), (-0.14, front), (0.0, 0.318)))
    yield GreyBox("paper", _on_face(front, (a + 0.012, b - 0.012), (0.14, 0.28), 0.001))
    for z in np.arange(0.16, 0.27, rng.uniform(0.02, 0.05)).tolist():
        yield GreyBox("dark", _on_face(front + 0.001, (a + 0.017, b - 0.02), (z, z + 0.008), 0.001))
    yield GreyBox("black", _on_face(front, (middle - 0.012, middle + 0.012), (0.06, 0.084), 0.002))


def carton(rng: Generator) -> ClutterItem:
    """Draw a carton with its tape and a label."""
    width, depth, height = rng.uniform(0.2, 0.42), rng.uniform(0.18, 0.3), rng.uniform(0.12, 0.3)
    return ClutterItem((width, depth, height), tuple(carton_parts(width, depth, height, rng)))


def carton_parts(width: float, depth: float, height: float, rng: Generator) -> Iterator[GreyBox]:
    """Yield a carton of that size: its body, tape along the top and down the front, a label."""
    face = depth / 2 - 0.002
    tape, edge = 0.12 * min(width, height), rng.uniform(0.1, 0.3) * width
    grey, sides, deep = "grey" if rng.random() < 0.75 else "paper", (-width / 2, width / 2), (-depth / 2, face)
    yield GreyBox(grey, (sides, deep, (0.0, height - 0.001)))
    yield GreyBox("light", ((-tape / 2, tape / 2), deep, (height - 0.001, height)))
    yield GreyBox("light", _on_face(face, (-tape / 2, tape / 2), (0.7 * height, height), 0.001))
    label, line = (edge - 0.1 * width, edge + 0.2 * width), (edge - 0.05 * width, edge + 0.1 * width)
    yield GreyBox("paper", _on_face(face, label, (0.2 * height, 0.55 * height), 0.001))
    yield GreyBox("black", _on_face(face + 0.001, line, (0.3 * height, 0.36 * height), 0.001))


def _cover(rng: Generator) -> str:
    return str(rng.choice(["black", "dark", "grey", "light", "paper"], p=[0.2, 0.25, 0.3, 0.15, 0.1]))


# --- robots and their bits ---


def arm(rng: Generator) -> ClutterItem:
    """Draw a small robot arm: base, column, two links, gripper."""
    column, reach = rng.uniform(0.26, 0.36), rng.uniform(0.2, 0.28)
    top, base = column + 0.09, -(0.035 + reach) / 2
    wrist = base + 0.1 + reach
    parts = (
        GreyBox("dark", _slab(0.24, 0.24, 0.0, 0.02, s=base)),
        GreyBox("light", _slab(0.15, 0.15, 0.02, 0.11, s=base)),
        GreyBox("grey", _slab(0.085, 0.085, 0.11, column, s=base)),
        GreyBox("dark", _slab(0.12, 0.14, column, top, s=base)),
        GreyBox("light", _slab(reach, 0.07, column + 0.01, top - 0.01, s=base + 0.06 + reach / 2)),
        GreyBox("dark", _slab(0.09, 0.1, column - 0.02, top, s=wrist)),
        GreyBox("light", _slab(0.05, 0.05, 0.2, column - 0.02, s=wrist)),
        GreyBox("dark", _slab(0.11, 0.04, 0.165, 0.2, s=wrist)),
        GreyBox("grey", _slab(0.015, 0.03, 0.09, 0.165, s=wrist - 0.04)),
        GreyBox("grey", _slab(0.015, 0.03, 0.09, 0.165, s=wrist + 0.04)),
    )
    return ClutterItem((0.275 + reach, 0.25, top), parts)


def rover(rng: Generator) -> ClutterItem:
    """Draw a small wheeled robot: plates on posts, wheels, boards, a scanner on top."""
    length, width = rng.uniform(0.28, 0.4), rng.uniform(0.24, 0.3)
    corners = [(s, out) for s in (-1, 1) for out in (-1, 1)]
    levels = (0.06 + np.cumsum(rng.uniform(0.05, 0.1, rng.integers(2, 4)))).tolist()
    top, track, inner = levels[-1] + 0.008, width / 2 - 0.015, 0.42 * width - 0.03
    parts = [GreyBox("black", _slab(0.1, 0.03, 0.0, 0.1, s=0.3 * s * length, out=o * track)) for s, o in corners]
    parts += [GreyBox("light", _slab(0.012, 0.012, 0.06, top, s=0.42 * s * length, out=o * inner)) for s, o in corners]
    parts += [GreyBox("dark" if z == levels[0] else "grey", _slab(length, width - 0.07, z, z + 0.008)) for z in levels]
    for low in levels[:-1]:
        board, box = rng.uniform(-0.05, 0.05), rng.uniform(-0.08, 0.08)
        parts.append(GreyBox("light", _slab(0.5 * length, 0.3 * width, low + 0.012, low + 0.03, s=board)))
        parts.append(GreyBox("dark", _slab(0.1, 0.06, low + 0.008, low + 0.045, s=box, out=0.2 * width)))
    parts.append(GreyBox("black", _slab(0.07, 0.07, top, top + 0.06, s=0.25 * length)))
    return ClutterItem((length, width, top + 0.06), tuple(parts))


def cables(rng: Generator) -> ClutterItem:
    """Draw a heap of cables: thin runs to and fro."""
    corners = np.cumsum(rng.normal(0.0, 0.11, (14, 2)), axis=0)
    corners = np.clip(corners - corners.mean(axis=0), (-0.22, -0.11), (0.22, 0.11))
    parts = []
    for (s0, o0), (s1, o1) in zip(corners[:-1].tolist(), corners[1:].tolist(), strict=True):
        z = rng.uniform(0.0, 0.02)
        parts.append(GreyBox("black", ((min(s0, s1), max(s0, s1) + 0.008), (o0, o0 + 0.008), (z, z + 0.008))))
        parts.append(GreyBox("black", ((s1, s1 + 0.008), (min(o0, o1), max(o0, o1) + 0.008), (z, z + 0.008))))
    return ClutterItem((0.46, 0.24, 0.03), tuple(parts))


def vice(rng: Generator) -> ClutterItem:
    """Draw a bench vice."""
    gap = rng.uniform(0.01, 0.06)
    parts = (
        GreyBox("dark", _slab(0.16, 0.14, 0.0, 0.03)),
        GreyBox("dark", _slab(0.08, 0.3, 0.03, 0.09)),
        GreyBox("grey", _slab(0.13, 0.05, 0.09, 0.17, out=-0.05)),
        GreyBox("grey", _slab(0.13, 0.05, 0.06, 0.17, out=gap)),
        GreyBox("light", _slab(0.2, 0.015, 0.05, 0.065, out=0.155)),
    )
    return ClutterItem((0.2, 0.33, 0.17), parts)


def pot(rng: Generator) -> ClutterItem:
    """Draw a pot of pens and screwdrivers."""
    parts = [GreyBox(_cover(rng), _slab(0.08, 0.08, 0.0, 0.1))]
    for _ in range(rng.integers(3, 8)):
        s, out = rng.uniform(-0.03, 0.03, 2)
        parts.append(
            GreyBox(_cover(rng), _slab(0.008, 0.008, 0.1, rng.uniform(0.13, 0.19), s=float(s), out=float(out)))
        )
    return ClutterItem((0.08, 0.08, 0.19), tuple(parts))
