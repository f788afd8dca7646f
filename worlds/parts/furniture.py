"""Furniture that stands free on the floor, and the things on it.

What a robot bumps into and a beam ends on are boxes of the plan's own measures; what a camera sees is one geom for each
grey of grey. Things on table tops are only seen: they stand above a robot's bumpers and its laser.
"""

from collections import defaultdict
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.random import Generator

from refseq_bench.worlds.arrays import Block, Span
from refseq_bench.worlds.parts import clutter, textures
from refseq_bench.worlds.parts.clutter import GREYS, ClutterItem, Maker
from refseq_bench.worlds.parts.greyscale import Image
from refseq_bench.worlds.parts.shell import PROUD
from refseq_bench.worlds.parts.site import Site
from refseq_bench.worlds.plans.frame import LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, Furniture, Material

Draw = Callable[[tuple[float, float], float, Generator], Image]
"""Draws a surface of (width, height) [m] and some albedo."""

BENCH_CLUTTER: tuple[Maker, ...] = (
    *(clutter.instrument, clutter.instrument, clutter.rack, clutter.monitor, clutter.arm, clutter.rover, clutter.vice),
    *(clutter.pile, clutter.carton, clutter.papers, clutter.cables, clutter.laptop, clutter.pot),
)
TABLE_CLUTTER: tuple[Maker, ...] = (clutter.workplace, clutter.workplace, clutter.laptop, clutter.papers, clutter.pile)
SHELF_CLUTTER: tuple[Maker, ...] = (clutter.binders, clutter.binders, clutter.carton, clutter.books, clutter.computer)
LIGHT_CLUTTER: tuple[Maker, ...] = (clutter.carton, clutter.books, clutter.pile, clutter.pot, clutter.instrument)
ASKEW = np.radians(7.0)
"""Angle by which things that people put down are off square (standard deviation); a choice."""
BUMPED = 0.8
"""Things in a shelf on a lower board than this [m] are solid: above, a robot has only its mast."""


def furnish(site: Site, plan: FloorPlan) -> None:
    """Put up all furniture."""
    if plan.furniture:
        for grey, albedo in GREYS.items():
            site.plain(_grey(grey), Material(albedo=albedo, roughness=0.6))
    for item in plan.furniture:
        key = f"{item.kind}:{item.name}"
        pile = _Pile(site, key, LocalFrame.under(item), plan.material[item.material])
        _MAKERS[item.kind](pile, item, site.rng(key))
        pile.put_up()


def _grey(grey: str) -> str:
    return f"furniture:{grey}"


class _Pile:
    """The boxes of one piece of furniture: those that are seen by their material, and those that are touched."""

    def __init__(self, site: Site, key: str, frame: LocalFrame, material: Material) -> None:
        self._site, self._key, self._frame, self._material = site, key, frame, material
        self._seen: dict[str, list[tuple[LocalFrame, Block]]] = defaultdict(list)
        self._touched: list[tuple[str, Block]] = []

    def solid(self, material: str, *blocks: Block) -> None:
        """Add boxes that are seen and touched."""
        self.shown(material, *blocks)
        self._touched += [(material, block) for block in blocks]

    def shown(self, material: str, *blocks: Block) -> None:
        """Add boxes that are only seen."""
        self._seen[material] += [(self._frame, block) for block in blocks]

    def stand(self, thing: ClutterItem, s: float, out: float, z: float, turn: float = 0.0, solid: bool = False) -> None:
        """Stand a thing at (s, out), ``z`` above the floor; a solid one is touched as the box around it."""
        frame = self._frame.turned(s, out, turn)
        for grey, block in thing.parts:
            self._seen[_grey(grey)].append((frame, _lifted(block, z)))
        if solid:
            (a, b), (c, d), rise = thing.hull
            self._touched.append((_grey("grey"), _lifted(((a + s, b + s), (c + out, d + out), rise), z)))

    def fill(self, makers: tuple[Maker, ...], room: Block, gap: float, rng: Generator, solid: bool = False) -> None:
        """Set a row of things into a room; solid ones stand square."""
        spans = np.array(room)
        (s, out, _), z = spans.mean(axis=1), spans[2, 0]
        width, depth, height = np.diff(spans, axis=1)[:, 0]
        for placed in clutter.row(makers, (width, depth, height), gap, 0.0 if solid else ASKEW, rng):
            self.stand(placed.thing, s + placed.s, out + placed.out, z, placed.turn, solid)

    def front(self, s: Span, out: float, z: Span, draw: Draw) -> None:
        """Add a picture of what the whole piece is made of, on its front at ``out``."""
        self._site.panel(f"{self._key}:front", self._frame, s, out + PROUD, z, self._drawn((s, z), draw))

    def block(self, block: Block, draw: Draw) -> None:
        """Add a solid box that shows a picture of what the whole piece is made of on each face."""
        self._site.solid(f"{self._key}:block", self._frame, block, self._drawn((block[0], block[2]), draw))

    def _drawn(self, face: tuple[Span, Span], draw: Draw) -> str:
        name, (width, height) = f"{self._key}:face", np.diff(face, axis=1)[:, 0].tolist()
        drawn = partial(draw, (width, height), self._material.albedo, self._site.rng(name))
        return self._site.picture(name, drawn, self._material)

    def put_up(self) -> None:
        """Build all boxes: one geom a material to see, one a box to touch."""
        for material, placed in self._seen.items():
            self._site.boxes(f"{self._key}:of:{material}", placed, material)
        for i, (material, block) in enumerate(self._touched):
            self._site.touched(f"{self._key}:{i}", self._frame, block, material)


def _lifted(block: Block, z: float) -> Block:
    s, out, (low, high) = block
    return s, out, (low + z, high + z)


# --- the kinds: width along s, depth along out, the front at positive out ---


def _bench(pile: _Pile, item: Furniture, rng: Generator) -> None:
    """Drawers with leg room between them, a back, a top, a rail of sockets and a board above it for light things."""
    w, d, h = item.width / 2, item.depth / 2, item.height
    under, pedestals = h - 0.04, max(2, round(item.width / 1.0))
    pile.solid(item.material, ((-w, w), (-d, d), (under, h)))
    pile.solid(_grey("light"), ((-w + 0.03, w - 0.03), (-d + 0.02, -d + 0.04), (0.25, under)))
    wide = min(0.48, item.width / (2 * pedestals))
    for s in np.linspace(-w + 0.03 + wide / 2, w - 0.03 - wide / 2, pedestals).tolist():
        _pedestal(pile, (s - wide / 2, s + wide / 2), (-d + 0.06, d - 0.06), under)
    pile.shown(_grey("light"), ((-w, w), (-d, -d + 0.06), (h, h + 0.09)))
    sockets = np.arange(-w + 0.1, w - 0.1, 0.22).tolist()
    pile.shown(_grey("dark"), *[((s, s + 0.06), (-d + 0.06, -d + 0.064), (h + 0.02, h + 0.07)) for s in sockets])
    _upper_board(pile, item, rng)
    pile.fill(BENCH_CLUTTER, ((-w + 0.05, w - 0.05), (-d + 0.12, d - 0.04), (h, h + 0.6)), 0.15, rng)


def _pedestal(pile: _Pile, s: Span, out: Span, high: float) -> None:
    """A dark carcass on a plinth that lies back, and the drawers' fronts with their handles before it."""
    (a, b), (back, front) = s, out
    pile.solid(_grey("dark"), (s, (back, front), (0.0, high)))
    edges = np.linspace(0.1, high, 5)
    for low, top in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        pile.shown(_grey("light"), ((a + 0.004, b - 0.004), (front, front + 0.018), (low + 0.004, top - 0.004)))
        middle, z = (a + b) / 2, top - 0.045
        pile.shown(_grey("dark"), ((middle - 0.07, middle + 0.07), (front + 0.018, front + 0.036), (z, z + 0.012)))
    sides = (a - 0.002, a + 0.004), (b - 0.004, b + 0.002)
    pile.shown(_grey("light"), *[(side, (back - 0.002, front + 0.001), (0.1, high)) for side in sides])


def _upper_board(pile: _Pile, item: Furniture, rng: Generator) -> None:
    w, d, low = item.width / 2, item.depth / 2, item.height + 0.45
    posts = np.linspace(-w + 0.02, w - 0.02, max(2, round(item.width / 1.0) + 1)).tolist()
    pile.shown(_grey("dark"), *[((s - 0.02, s + 0.02), (-d + 0.005, -d + 0.045), (item.height, low)) for s in posts])
    pile.shown(item.material, ((-w, w), (-d, -d + 0.24), (low, low + 0.025)))
    room = ((-w + 0.03, w - 0.03), (-d + 0.01, -d + 0.23), (low + 0.025, low + 0.35))
    pile.fill(LIGHT_CLUTTER, room, 0.3, rng)


def _table(pile: _Pile, item: Furniture, rng: Generator) -> None:
    """A top on four legs; a workplace or papers on it, a computer under it."""
    w, d, h, leg = item.width / 2, item.depth / 2, item.height, 0.05
    under = h - 0.03
    pile.solid(item.material, ((-w, w), (-d, d), (under, h)))
    pile.solid(_grey("dark"), *_legs(w - 0.02, d - 0.02, leg, under))
    pile.shown(_grey("dark"), ((-w + 0.04, w - 0.04), (-d + 0.03, -d + 0.06), (under - 0.08, under)))
    pile.fill(TABLE_CLUTTER, ((-w + 0.04, w - 0.04), (-d + 0.03, d - 0.03), (h, h + 0.6)), 0.08, rng)
    tower = clutter.computer(rng)
    if item.width > 1.0 and item.depth > 0.55 and under > tower.size[2]:
        side = w - 0.25 if rng.random() < 0.5 else -w + 0.25
        pile.stand(tower, side, 0.0, 0.0, solid=True)


def _legs(w: float, d: float, leg: float, high: float) -> list[Block]:
    """Four square legs whose outer edges are at ±w and ±d."""
    sides = [((-w, -w + leg), (w - leg, w)), ((-d, -d + leg), (d - leg, d))]
    return [(s, out, (0.0, high)) for s in sides[0] for out in sides[1]]


def _chair(pile: _Pile, item: Furniture, _: Generator) -> None:
    """Four legs, the rear ones going up to the back; whoever sits on it looks to its front."""
    w, d, leg, seat = item.width / 2, item.depth / 2, 0.026, 0.53 * item.height
    legs = _legs(w, d, leg, seat)
    pile.solid(item.material, *legs)
    stiles = [(s, out, (seat, item.height)) for s, out, _ in legs if out[0] < 0.0]
    pile.shown(item.material, *stiles)
    pile.solid(item.material, ((-w, w), (-d + leg, d), (seat, seat + 0.035)))
    back = (0.72 * item.height, item.height)
    pile.solid(item.material, ((-w, w), (-d, -d + 0.024), back))


def _cupboard(pile: _Pile, item: Furniture, rng: Generator) -> None:
    """A closed body; its front is a picture; cartons on top where somebody could put them."""
    w, d, h = item.width / 2, item.depth / 2, item.height
    pile.solid(item.material, ((-w, w), (-d, d), (0.0, h)))
    pile.front((-w, w), d, (0.0, h), textures.metal)
    if h < 2.0:
        pile.fill(LIGHT_CLUTTER, ((-w + 0.03, w - 0.03), (-d + 0.03, d - 0.03), (h, h + 0.4)), 0.25, rng)


def _shelf(pile: _Pile, item: Furniture, rng: Generator) -> None:
    """Boards between two sides, full of things."""
    w, d, h = item.width / 2, item.depth / 2, item.height
    pile.solid(item.material, ((-w, -w + 0.025), (-d, d), (0.0, h)), ((w - 0.025, w), (-d, d), (0.0, h)))
    levels = np.linspace(0.08, h - 0.025, max(2, round(h / 0.4) + 1)).tolist()
    for low, top in zip(levels, [*levels[1:], h + 0.35], strict=True):
        pile.solid(item.material, ((-w + 0.025, w - 0.025), (-d, d), (low, low + 0.025)))
        room = ((-w + 0.04, w - 0.04), (-d + 0.01, d - 0.01), (low + 0.025, top - 0.02))
        pile.fill(SHELF_CLUTTER, room, 0.06, rng, solid=low < BUMPED)


def _pillar(pile: _Pile, item: Furniture, _: Generator) -> None:
    """A pillar, plastered, with a skirting."""
    w, d, skirting = item.width / 2, item.depth / 2, 0.012
    pile.block(((-w, w), (-d, d), (0.0, item.height)), textures.plaster)
    pile.shown(_grey("dark"), ((-w - skirting, w + skirting), (-d - skirting, d + skirting), (0.0, 0.08)))


def _box(pile: _Pile, item: Furniture, rng: Generator) -> None:
    """A carton on the floor."""
    size = (item.width, item.depth, item.height)
    pile.stand(ClutterItem(size, tuple(clutter.carton_parts(*size, rng))), 0.0, 0.0, 0.0, solid=True)


_MAKERS: dict[str, Callable[[_Pile, Furniture, Generator], None]] = {
    "bench": _bench,
    "table": _table,
    "chair": _chair,
    "cupboard": _cupboard,
    "shelf": _shelf,
    "pillar": _pillar,
    "box": _box,
}
