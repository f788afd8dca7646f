"""Picture of a merged map's plan, in metres or on a floor plan."""

from collections.abc import Callable
from pathlib import Path

import cv2
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar
from numpy.typing import NDArray

from refseq.files import replacing_at
from refseq.map.map import Map
from refseq_bench.scenarios.maps.drawings.matrix import PICTURES
from refseq_bench.scenarios.maps.floor_plan import LaidFloor
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN

WIDTH, DPI, FLOOR_DPI = 9.0, 120, 220
"""Of the picture [inch], and its dots an inch; of one on a floor plan, whose lines are fine."""
FAINT = 0.5
"""Share of a floor plan's darkness that is drawn: with more of it paths are hard to see, with less walls are."""
NUMBERED = 25
"""Places that have their number beside them, at most: more would hide small plans, fewer are far from any corner."""


def draw_plan(file: Path, map_: Map, floor: LaidFloor | None = None) -> None:
    """Draw the paths that are joined: full where a path holds its places, dotted where another path does.

    Without a floor plan they are in metres, from where one of them began; with one, on its picture.
    """
    with mpl.rc_context({**AS_WRITTEN, "font.size": 8, "svg.hashsalt": "refseq"}), replacing_at(file) as drawn:
        figure = _in_metres(map_) if floor is None else _on_floor(map_, floor)
        figure.savefig(drawn, facecolor="white", metadata=PICTURES[file.suffix.lower()])


def _in_metres(map_: Map) -> Figure:
    figure, axes = _sheet(np.ptp(_spots(map_), axis=0) + 1.0, DPI)
    _draw_paths(axes, map_, lambda points: points)
    axes.set_xlabel("[m], from where one of them began")
    axes.legend()
    return figure


def _on_floor(map_: Map, floor: LaidFloor) -> Figure:
    """The paths in the frame of the floor plan's picture, which stays upright; crosses where places were marked."""
    height, width = floor.picture.shape
    corners = np.array([(0.0, 0.0), (width, height)])
    figure, axes = _sheet(np.ptp(np.concatenate([floor.fit.pixels(_spots(map_)), corners]), axis=0), FLOOR_DPI)
    smaller = min(1.0, WIDTH * FLOOR_DPI / width)
    size = max(1, round(smaller * width)), max(1, round(smaller * height))
    # Lines of a large scan would be lost where single pixels are left out.
    shown = cv2.resize(floor.picture, size, interpolation=cv2.INTER_AREA)
    frame = (-0.5, width - 0.5, height - 0.5, -0.5)
    axes.imshow(255 - FAINT * (255.0 - shown), cmap="gray", vmin=0, vmax=255, extent=frame)
    _draw_paths(axes, map_, floor.fit.pixels)
    marked = np.array([(mark.x, mark.y) for mark in floor.marks])
    axes.plot(*marked.T, "+", color="black", markersize=9, label="marked")
    axes.add_artist(_scale_bar(axes, width, floor.fit.metres_a_pixel))
    axes.tick_params(left=False, bottom=False, labelleft=False, labelbottom=False)
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _spots(map_: Map) -> NDArray[np.float64]:
    """All views of the joined paths, (n, 2) [m]."""
    return np.concatenate([path.poses[:, :2] for path in map_.paths if len(path.poses)])


def _sheet(size: NDArray[np.float64], dpi: int) -> tuple[Figure, Axes]:
    """A figure for axes of a size (2,), width and height in any unit."""
    high = float(np.clip(WIDTH * size[1] / size[0], 3.0, 12.0)) + 0.8
    figure = Figure(figsize=(WIDTH, high), dpi=dpi, layout="constrained")
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_title("full: places of the path, by number; dotted: another path holds them; dot: its begin", wrap=True)
    return figure, axes


def _draw_paths(axes: Axes, map_: Map, laid: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
    """Paths and numbers of places, from the map's frame (n, 2) [m] ``laid`` to that of the axes."""
    for colour, path in enumerate(path for path in map_.paths if len(path.poses)):
        spots = laid(path.poses[:, :2])
        own = map_.names.index(path.name) if path.name in map_.names else -1
        held = np.where((path.sequences == own)[:, None], spots, np.nan)
        axes.plot(*spots.T, ":", color=f"C{colour}", linewidth=1)
        axes.plot(*held.T, "-", color=f"C{colour}", linewidth=1.5, label=path.name)
        axes.plot(*spots[0], "o", color=f"C{colour}", markersize=5)
    for place in range(0, len(map_), _round(len(map_) / NUMBERED)):
        if pose := map_.joined_poses[place]:
            spot = laid(np.array([(pose.x, pose.y)]))[0]
            axes.annotate(f"{place}", spot, (3, 3), textcoords="offset points", fontsize=6)


def _scale_bar(axes: Axes, width: int, metres_a_pixel: float) -> AnchoredSizeBar:
    """A bar of a round number of metres, a tenth to a quarter of a picture so wide [pixels]."""
    metres = _round(width * metres_a_pixel / 10)
    bar = metres / metres_a_pixel
    return AnchoredSizeBar(
        axes.transData, bar, f"{metres} m", "lower left", pad=0.5, borderpad=0.8, size_vertical=bar / 60
    )


def _round(least: float) -> int:
    """The least of 1, 2, 5, 10, 20, 50 and so on that is no smaller."""
    return next(step * ten for ten in (10**n for n in range(19)) for step in (1, 2, 5) if step * ten >= least)
