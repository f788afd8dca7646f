"""Layout of a plan's drawing on paper: its scale, and its pieces if it is long.

All lengths on paper are in millimetres. A long corridor drawn whole would be a hair: it is cut across into pieces that
lie one below the other (or beside each other if it runs up the sheet), all at the same scale.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.areas import Rectangle

PAPERS = {"A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0)}
"""Papers, lying: (width, height)."""
COARSE = 125
"""A plan that is drawn smaller than 1 to so many goes on a larger paper, if there is one: a door is then 7 mm wide."""
EDGE = 12.0
"""Free edge of the paper."""
FOOT = 42.0
"""Height of title, legend and scale at the foot."""
GAP = 9.0
"""Margin of each piece below and to the left of it, for the figures along its sides."""
SCALES = (20, 25, 40, 50, 75, 100, 125, 150, 200, 250, 300, 400, 500, 750, 1000, 1500, 2000, 2500, 5000, 10_000)
"""Scales that are used, 1 to so many."""
MOST_PIECES = 6


@dataclass(frozen=True, slots=True)
class SheetPiece:
    """A part of the ground, [m], and where on the paper its lower left corner lies, (2,) [mm]."""

    ground: Rectangle
    corner: Floats


@dataclass(frozen=True, slots=True)
class DrawingSheet:
    """Pieces of a plan in the order of their place, all drawn 1 to ``scale``; ``axis`` is the one that is cut.

    ``paper`` is its name, ``size`` its (width, height) [mm].
    """

    paper: str
    size: Floats
    scale: int
    axis: int
    pieces: tuple[SheetPiece, ...]

    @property
    def lettering(self) -> float:
        """Size of letters over that on the smallest paper: a large sheet is looked at from farther off."""
        return float((self.size[0] / PAPERS["A3"][0]) ** 0.7)


def lay_out(ground: Rectangle) -> DrawingSheet:
    """Choose paper and scale for a rectangle of ground, and the fewest pieces in which it fits at that scale."""
    sheets = (_on_paper(ground, name) for name in PAPERS)
    return next((sheet for sheet in sheets if sheet.scale <= COARSE), _on_paper(ground, [*PAPERS][-1]))


def _on_paper(ground: Rectangle, paper: str) -> DrawingSheet:
    axis, size = int(np.argmax(ground.size)), np.array(PAPERS[paper])
    scales = [_scale(ground, axis, n, size) for n in range(1, MOST_PIECES + 1)]
    scale, count = min(scales), int(np.argmin(scales)) + 1
    grounds = _cut(ground, axis, count)
    taken = grounds[0].size * 1000 / scale + GAP
    pieces = tuple(SheetPiece(g, _corner(i, axis, taken, size)) for i, g in enumerate(grounds))
    return DrawingSheet(paper, size, scale, axis, pieces)


def _scale(ground: Rectangle, axis: int, count: int, paper: Floats) -> int:
    """The largest scale at which ``count`` pieces fit."""
    room = paper - 2 * EDGE - [0.0, FOOT * paper[0] / PAPERS["A3"][0]]
    in_a_row = np.ones(2)
    in_a_row[1 - axis] = count
    size = _cut(ground, axis, count)[0].size * 1000  # (2,) [mm] at 1:1
    needed = np.max(size * in_a_row / (room - GAP * in_a_row))
    return next((scale for scale in SCALES if scale >= needed), SCALES[-1])


def _cut(ground: Rectangle, axis: int, count: int) -> list[Rectangle]:
    cuts = np.linspace(ground.low[axis], ground.high[axis], count + 1)
    pieces = []
    for a, b in pairwise(cuts):
        low, high = ground.low.copy(), ground.high.copy()
        low[axis], high[axis] = a, b
        pieces.append(Rectangle(low, high))
    return pieces


def _corner(i: int, axis: int, taken: Floats, paper: Floats) -> Floats:
    """Lower left corner of piece ``i``: downwards from the top, or to the right from the left edge."""
    top_left = np.array([EDGE + GAP, paper[1] - EDGE - taken[1] + GAP])
    step = np.array([0.0, -taken[1]]) if axis == 0 else np.array([taken[0], 0.0])
    return top_left + i * step
