"""Colours, fills and strokes of a plan's drawing, as functions over matplotlib's axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import ArrayLike

Style = dict[str, Any]
"""Keywords of a matplotlib patch or line."""
Dashes = Any
"""A matplotlib line style: a word such as "-", or an offset and the lengths of strokes and gaps [pt]."""

INK, PALE = "#222222", "#b0b0b0"
BLUE, ORANGE, SKY, GREEN, RED, PURPLE, YELLOW = (
    *("#0072b2", "#e69f00", "#56b4e9", "#009e73", "#d55e00", "#cc79a7", "#f0e442"),
)
ROUTES: tuple[tuple[str, Dashes], ...] = (
    (GREEN, "-"),
    (PURPLE, (0, (5, 2))),
    (BLUE, (0, (1, 1))),
    (RED, (0, (6, 2, 1, 2))),
)
FILLS: Mapping[str, Style] = {
    "poster": {"facecolor": BLUE, "edgecolor": BLUE},
    "board": {"facecolor": ORANGE, "edgecolor": INK, "hatch": "////"},
    "cabinet": {"facecolor": "#c8c8c8", "edgecolor": INK},
    "bin": {"facecolor": "white", "edgecolor": INK},
    "radiator": {"facecolor": "white", "edgecolor": RED, "hatch": "|||||"},
    "extinguisher": {"facecolor": RED, "edgecolor": RED},
    "switch": {"facecolor": INK, "edgecolor": INK},
    "sign": {"facecolor": GREEN, "edgecolor": GREEN},
    "furniture": {"facecolor": "#e4e4e4", "edgecolor": INK},
    "pillar": {"facecolor": INK, "edgecolor": INK},
    "stairs": {"facecolor": "white", "edgecolor": INK},
    "car": {"facecolor": "#dfe8f0", "edgecolor": INK},
    "tree": {"facecolor": "#d5e8d8", "edgecolor": GREEN, "linestyle": "--"},
    "kerb": {"facecolor": "#c8c8c8", "edgecolor": INK},
    "marking": {"facecolor": "white", "edgecolor": PALE},
    "post": {"facecolor": YELLOW, "edgecolor": INK},
    "person": {"facecolor": PURPLE, "edgecolor": INK},
    "lamp": {"facecolor": YELLOW, "edgecolor": ORANGE, "alpha": 0.5},
}


def fill(axes: Axes, corners: ArrayLike, name: str | None = None, **style: Any) -> None:
    """Fill a polygon, (n, 2); ``name`` is its id in an SVG file."""
    axes.add_patch(Polygon(np.asarray(corners), closed=True, gid=name, **{"linewidth": 0.4, "zorder": 4.0, **style}))


def disc(axes: Axes, middle: ArrayLike, radius: float, name: str | None = None, **style: Any) -> None:
    """Fill a circle."""
    x, y = np.asarray(middle, dtype=float)
    axes.add_patch(Circle((x, y), radius, gid=name, **{"linewidth": 0.4, "zorder": 4.0, **style}))


def line(axes: Axes, points: ArrayLike, **style: Any) -> None:
    """Draw a line through ``points``, (n, 2)."""
    axes.plot(*np.asarray(points).T, **{"color": INK, "linewidth": 0.5, "zorder": 4.0, **style})


def arrow(axes: Axes, tip: ArrayLike, foot: ArrayLike, colour: str = INK, zorder: float | None = None) -> None:
    """Draw an arrow from ``foot`` to ``tip``, (2,) each; what reaches beyond the axes is cut off."""
    (x, y), (x0, y0) = np.asarray(tip, dtype=float), np.asarray(foot, dtype=float)
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": 0.5, "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0}
    options: Style = {} if zorder is None else {"zorder": zorder}
    axes.annotate("", (x, y), (x0, y0), arrowprops=look, **options)


def label(axes: Axes, middle: ArrayLike, text: str, **style: Any) -> None:
    """Write a text about a point, (2,)."""
    x, y = np.asarray(middle, dtype=float)
    axes.text(x, y, text, **{"ha": "center", "va": "center", "fontsize": "small", **style})


def box(low: ArrayLike, high: ArrayLike) -> list[tuple[float, float]]:
    """Return the corners of an upright rectangle, counter-clockwise."""
    (x0, y0), (x1, y1) = np.asarray(low, dtype=float).tolist(), np.asarray(high, dtype=float).tolist()
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
