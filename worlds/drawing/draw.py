"""Draw a plan as an architect would, on a sheet that can be printed in black and white.

Walls are cut and filled, doors show their leaf as it stands and the way it swings, windows their glass; what hangs on
walls is drawn thicker than it is. Colours are those of Okabe and Ito, which people with any colour vision tell apart;
hatches and dashes tell the same without colour.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.drawing.routes import draw_routes
from refseq_bench.worlds.drawing.sheet import DrawingSheet, SheetPiece, lay_out
from refseq_bench.worlds.drawing.style import INK, PALE, ROUTES
from refseq_bench.worlds.drawing.symbols import draw_things
from refseq_bench.worlds.drawing.title_block import draw_title_block
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import LightSetting
from refseq_bench.worlds.plans.areas import Rectangle
from refseq_bench.worlds.plans.schema import FloorPlan

FORMATS = (".svg", ".png")
DPI = 150
AROUND = 1.6
"""So much of what is around the ground is shown [m]: the doors' leaves and numbers."""
LETTERS = 6.0
"""Size of letters on the smallest paper [pt]; most are given as shares of it."""

RC: dict[Any, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,  # names from outside are drawn as they are written
    "svg.hashsalt": "worlds",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "hatch.linewidth": 0.4,
}


def check_picture(path: Path) -> None:
    """Raise ``WorldsError`` if a drawing cannot be written as that kind of file."""
    if path.suffix not in FORMATS:
        raise WorldsError(f"{path}: cannot draw a '{path.suffix}' file; valid are {', '.join(FORMATS)}")


def draw_plan(
    plan: FloorPlan, path: Path, light: LightSetting | None = None, routes: Sequence[str] | None = None
) -> None:
    """Write the drawing of a plan, .svg or .png; the same plan gives the same bytes.

    ``routes`` names those that are drawn; None: the first four, as more would hide each other. Raises ``WorldsError``
    for another kind of file and for a route that the plan does not have.
    """
    check_picture(path)
    wanted = tuple(plan.routes)[: len(ROUTES)] if routes is None else tuple(dict.fromkeys(routes))
    for name in wanted:
        if name not in plan.routes:
            raise WorldsError(f"unknown route '{name}' in world '{plan.name}'; known are {', '.join(plan.routes)}")
    low, high = plan.bounds
    sheet = lay_out(Rectangle(low - AROUND, high + AROUND))
    with mpl.rc_context({**RC, "font.size": LETTERS * sheet.lettering}):
        figure = _figure(plan, sheet, light, wanted)
        figure.savefig(path, dpi=DPI, metadata={"Date": None} if path.suffix == ".svg" else {"Software": None})


def _figure(plan: FloorPlan, sheet: DrawingSheet, light: LightSetting | None, routes: Sequence[str]) -> Figure:
    figure = Figure(figsize=tuple(sheet.size / 25.4))
    for i, piece in enumerate(sheet.pieces):
        axes = _axes(figure, piece, sheet)
        _piece_edges(axes, sheet, i)
        draw_things(axes, plan)
        draw_routes(axes, plan, routes)
    draw_title_block(figure, plan, sheet, light, routes)
    return figure


def _axes(figure: Figure, piece: SheetPiece, sheet: DrawingSheet) -> Axes:
    """Axes in which a metre is 1000 / scale millimetres of paper."""
    size = piece.ground.size * 1000 / sheet.scale
    axes = figure.add_axes((*(piece.corner / sheet.size), *(size / sheet.size)))
    axes.set(xlim=(piece.ground.low[0], piece.ground.high[0]), ylim=(piece.ground.low[1], piece.ground.high[1]))
    axes.tick_params(length=2, width=0.4, labelsize="small", colors="#666666", pad=1.5)
    axes.set_xticks(_steps(piece.ground.low[0], piece.ground.high[0]))
    axes.set_yticks(_steps(piece.ground.low[1], piece.ground.high[1]))
    axes.spines[:].set(color=PALE, linewidth=0.4)
    return axes


def _steps(low: float, high: float) -> Floats:
    """Round coordinates along a side [m]: every 5 m, or every metre of a short one."""
    step = 5.0 if high - low > 12.0 else 1.0
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


def _piece_edges(axes: Axes, sheet: DrawingSheet, i: int) -> None:
    """Dash the sides along which the plan goes on in another piece."""
    before, after = ("left", "right") if sheet.axis == 0 else ("bottom", "top")
    for side, cut in ((before, i > 0), (after, i < len(sheet.pieces) - 1)):
        if cut:
            axes.spines[side].set(color=INK, linewidth=0.9, linestyle=(0, (8, 2, 1, 2)))
