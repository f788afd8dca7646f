"""Style of the report's plots: colours, lines and markers, and SVG text that takes the colour of the page around it."""

import html
import io
import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from refseq.belief import Stage
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN

INK = "#010203"
"""Stands for the colour of the page's text; no plot uses it for anything else."""

Dashes = str | tuple[int, tuple[int, ...]]
"""As matplotlib takes it: a word, or an offset and lengths of dashes and gaps."""

MethodStyle = tuple[str, Dashes, str]
"""Colour, line and marker: methods are told apart with any colour vision, and without colour."""

STAGE_STYLES: Mapping[str, MethodStyle] = {
    Stage.UNIFORM: ("#8a8a8a", ":", "o"),
    Stage.PRIOR: ("#2a8fd4", "--", "s"),
    Stage.CHAIN: ("#d55e00", "-", "x"),
}
"""Of the first profile in a plot, or of stages without one."""

OTHER_STYLES: Sequence[MethodStyle] = (
    ("#2a9d6f", "-.", "^"),
    ("#9467bd", (0, (5, 1, 1, 1, 1, 1)), "D"),
    ("#b8860b", (0, (1, 1)), "v"),
    ("#2f9aa8", (0, (8, 2)), "P"),
    ("#d6409f", (0, (3, 1)), "*"),
    ("#a0695d", (0, (6, 2, 2, 2)), "<"),
    ("#4a78c8", (0, (2, 2)), ">"),
    ("#7f9c1f", (0, (10, 2, 2, 2)), "h"),
    ("#e0685e", (0, (1, 3)), "p"),
    ("#3f7f00", (0, (8, 2, 1, 2, 1, 2)), "X"),
    ("#5b5bd6", (0, (4, 4)), "d"),
    ("#a14fa8", (0, (12, 3)), "H"),
    ("#00798c", (0, (3, 1, 1, 1)), "8"),
    ("#c46a2b", (0, (6, 1, 1, 1, 1, 1, 1, 1)), "1"),
    ("#6b7a8f", (0, (2, 1, 6, 1)), "2"),
    ("#c4383b", (0, (14, 2, 4, 2)), "3"),
)
"""For other methods, one after the other; when they are used up they come again. All stand out from light
paper and from dark, three to one at least."""

REFERENCE, QUERY, WALL = "#2a8fd4", "#d55e00", "#8a8a8a"
BELIEF, TRUTH = QUERY, REFERENCE
RIGHT, WRONG = "#2a9d6f", "#d6409f"

FAULTY = "#c4383b"
"""Of what is plainly wrong."""
DRIVE_COLOURS = ("#2a8fd4", "#d55e00", "#2a9d6f", "#d6409f", "#b8860b", "#5b5bd6", "#2f9aa8", "#a0695d")
DRIVE_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
"""Of drives, one after the other; as there are more colours than markers, 56 drives are told apart, and the first seven
without colour."""

page_style = mpl.rc_context(
    {
        **AS_WRITTEN,
        "svg.fonttype": "none",
        "svg.hashsalt": "refseq",
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
        "font.size": 9,
        "axes.titlesize": 10,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "legend.frameon": False,
        "figure.facecolor": "none",
        "axes.facecolor": "none",
        "savefig.facecolor": "none",
        "text.color": INK,
        "axes.edgecolor": INK,
        "axes.labelcolor": INK,
        "xtick.color": INK,
        "ytick.color": INK,
    }
)
"""Decorates whatever draws a plot."""


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """An entry of a legend: a ``swatch`` as SVG text, and the name of what looks like it."""

    swatch: str
    label: str


@dataclass(frozen=True, slots=True)
class Plot:
    """A drawing as SVG text, what a reader must know about its scale, and its legend.

    The page writes the legend above the drawing, where it breaks into lines as a paragraph does: within the drawing it
    would be cut off by a narrow screen.
    """

    svg: str
    note: str = ""
    legend: tuple[LegendEntry, ...] = ()

    @property
    def standalone(self) -> str:
        """The drawing with its legend below it as SVG text, for a file that no page surrounds."""
        width, height = (float(size) for size in re.findall(r'(?:width|height)="([\d.]+)pt"', self.svg)[:2])
        rows = -(-len(self.legend) // LEGEND_COLUMNS)
        entries = "".join(
            _entry_at(entry, k % LEGEND_COLUMNS * width / LEGEND_COLUMNS, height + k // LEGEND_COLUMNS * LEGEND_LINE)
            for k, entry in enumerate(self.legend)
        )
        whole = height + rows * LEGEND_LINE
        size = f'width="{width}pt" height="{whole}pt" viewBox="0 0 {width} {whole}"'
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {size}>'
            f"{_without_units(self.svg)}{entries}</svg>\n"
        )


LEGEND_COLUMNS, LEGEND_LINE = 3, 16
"""Of the legend of a file that stands alone: entries beside each other, and the height of a line [pt]."""


def _entry_at(entry: LegendEntry, x: float, y: float) -> str:
    return (
        f'<g transform="translate({x + 8:.1f} {y:.1f})">{_without_units(entry.swatch)}<text x="30" y="10" '
        f'style="font: 9px sans-serif" fill="currentColor">{html.escape(entry.label)}</text></g>'
    )


def _without_units(svg: str) -> str:
    """The same within another drawing of points."""
    return re.sub(r'(width|height)="([\d.]+)pt"', r'\1="\2"', svg, count=2)


WIDTH, NARROW_WIDTH = 10.0, 6.4
"""Widths of a figure across the page, and of one that a phone shows whole, its text still readable [inch]."""


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """A figure so high [inch], by default as wide as the page."""
    return Figure(figsize=(width, height), layout="constrained")


def with_legend(figure: Figure, note: str = "") -> Plot:
    """Finish a plot with the legend of all that has a label."""
    named = (axes.get_legend_handles_labels() for axes in figure.axes)
    shown = [entry for handles, labels in named for entry in zip(handles, labels, strict=True)]
    return Plot(as_svg(figure), note, tuple(legend_entry(handle, label) for handle, label in shown))


def legend_entry(handle: Any, label: str) -> LegendEntry:
    """An entry for what matplotlib has drawn, or would draw, of a ``label``."""
    figure = Figure(figsize=(0.34, 0.17))
    look = {"borderpad": 0, "borderaxespad": 0, "handletextpad": 0, "handlelength": 2.4}
    figure.legend([handle], [""], loc="center", **look)
    return LegendEntry(as_svg(figure), label)


def method_styles(methods: Iterable[str]) -> dict[str, MethodStyle]:
    """A style for each method; the stages of the first profile among them have those of stages."""
    others, first = itertools.cycle(OTHER_STYLES), None
    styles: dict[str, MethodStyle] = {}
    for method in methods:
        profile, _, stage = method.rpartition("/")
        first = profile if first is None and stage in STAGE_STYLES else first
        styles[method] = STAGE_STYLES[stage] if profile == first and stage in STAGE_STYLES else next(others)
    return styles


def draw_grid(*panels: Axes) -> None:
    """A faint grid behind what is drawn."""
    for axes in panels:
        axes.grid(color=INK, alpha=0.12, linewidth=0.6)


def as_svg(figure: Figure) -> str:
    """Write the figure as an ``<svg>`` element in the page's own ink."""
    buffer = io.StringIO()
    # ``savefig`` would draw all of it twice, the first time for its layout alone, which one drawing begins with too.
    canvas: Any = FigureCanvasSVG(figure)  # its method has no types
    canvas.print_svg(buffer, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :].replace(INK, "currentColor")
