"""The drawing of a plan, as an architect would expect it, on a sheet that can be printed in black and white.

Walls are cut and filled, doors show their leaf as it stands and the way it swings, windows their glass; what hangs on
walls is drawn thicker than it is. Colours are those of Okabe and Ito, which people with any colour vision tell apart;
hatches and dashes tell the same without colour.
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon
from numpy.typing import ArrayLike, NDArray

from worlds.drawing.sheet import EDGE, FOOT, Piece, Sheet, lay_out
from worlds.errors import WorldsError
from worlds.light import LightSetting
from worlds.lighting.daylight import sun_position
from worlds.plans.areas import Rectangle, enclosing, rectangles
from worlds.plans.footprints import Footprint, footprints
from worlds.plans.frame import Frame
from worlds.plans.schema import Door, Fixture, FloorPlan, LampRow, Person, Stairs, Tree, Wall, Window

FORMATS = (".svg", ".png")
DPI = 150
AROUND = 1.6
"""So much of what is around the ground is shown [m]: the doors' leaves and numbers."""
LETTERS = 6.0
"""Size of letters on the smallest paper [pt]; most are given as shares of it."""
MARK = 10.0
"""A route is marked every so many metres."""
SHEET_DEPTH, BOARD_DEPTH, LEAST_DEPTH = 0.12, 0.2, 0.1
"""How thick posters, boards and small things are drawn [m], so that they are seen."""
ASIDE = 0.16
"""Routes lie so far, or a multiple, to the right of the line that they follow [m]: there and back lie side by side."""

INK, PALE = "#222222", "#b0b0b0"
BLUE, ORANGE, SKY, GREEN, RED, PURPLE, YELLOW = (
    *("#0072b2", "#e69f00", "#56b4e9", "#009e73", "#d55e00", "#cc79a7", "#f0e442"),
)
ROUTES = ((GREEN, "-"), (PURPLE, (0, (5, 2))), (BLUE, (0, (1, 1))), (RED, (0, (6, 2, 1, 2))))
FILLS = {
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
STYLE = {
    "svg.fonttype": "none",
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
    with mpl.rc_context({**STYLE, "font.size": LETTERS * sheet.lettering}):
        figure = _figure(plan, sheet, light, wanted)
        figure.savefig(path, dpi=DPI, metadata={"Date": None} if path.suffix == ".svg" else {"Software": None})


def _figure(plan: FloorPlan, sheet: Sheet, light: LightSetting | None, routes: Sequence[str]) -> Figure:
    figure = Figure(figsize=tuple(sheet.size / 25.4))
    for i, piece in enumerate(sheet.pieces):
        axes = _axes(figure, piece, sheet)
        _piece_edges(axes, sheet, i)
        _draw_all(axes, plan, routes)
    _foot(figure, plan, sheet, light, routes)
    return figure


def _axes(figure: Figure, piece: Piece, sheet: Sheet) -> Axes:
    """Axes in which a metre is 1000 / scale millimetres of paper."""
    size = piece.ground.size * 1000 / sheet.scale
    axes = figure.add_axes((*(piece.corner / sheet.size), *(size / sheet.size)))
    axes.set(xlim=(piece.ground.low[0], piece.ground.high[0]), ylim=(piece.ground.low[1], piece.ground.high[1]))
    axes.tick_params(length=2, width=0.4, labelsize="small", colors="#666666", pad=1.5)
    axes.set_xticks(_steps(piece.ground.low[0], piece.ground.high[0]))
    axes.set_yticks(_steps(piece.ground.low[1], piece.ground.high[1]))
    axes.spines[:].set(color=PALE, linewidth=0.4)
    return axes


def _steps(low: float, high: float) -> NDArray[np.float64]:
    """Round coordinates along a side [m]: every 5 m, or every metre of a short one."""
    step = 5.0 if high - low > 12.0 else 1.0
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


def _piece_edges(axes: Axes, sheet: Sheet, i: int) -> None:
    """Dash the sides along which the plan goes on in another piece."""
    before, after = ("left", "right") if sheet.axis == 0 else ("bottom", "top")
    for side, cut in ((before, i > 0), (after, i < len(sheet.pieces) - 1)):
        if cut:
            axes.spines[side].set(color=INK, linewidth=0.9, linestyle=(0, (8, 2, 1, 2)))


# --- what is drawn, from the ground up ---


def _draw_all(axes: Axes, plan: FloorPlan, routes: Sequence[str]) -> None:
    around = enclosing(plan)
    for wall in around:
        _wall(axes, plan, wall, wall.thickness, zorder=1.0)
    for area in rectangles(plan):
        _fill(axes, _box(area.low, area.high), facecolor="white" if plan.ceiling else "#f4f4f4", zorder=2.0)
    for wall in plan.wall:
        if wall not in around:
            _wall(axes, plan, wall, 0.0, zorder=2.5)
    _ground_lines(axes, plan)
    for row in plan.lamp:
        _lamps(axes, row)
    _standing(axes, plan)
    _on_walls(axes, plan)
    for i, name in enumerate(routes):
        _route(axes, plan, name, ASIDE * (1 + i / 2), *ROUTES[i % len(ROUTES)])


def _fill(axes: Axes, corners: ArrayLike, name: str | None = None, **style: object) -> None:
    style = {"linewidth": 0.4, "zorder": 4.0, **style}
    axes.add_patch(Polygon(np.asarray(corners), closed=True, gid=name, **style))


def _line(axes: Axes, points: ArrayLike, **style: object) -> None:
    style = {"color": INK, "linewidth": 0.5, "zorder": 4.0, **style}
    axes.plot(*np.asarray(points).T, **style)


def _box(low: ArrayLike, high: ArrayLike) -> list[tuple[float, float]]:
    (x0, y0), (x1, y1) = low, high  # type: ignore[misc]
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def _slab(frame: Frame, s: tuple[float, float], out: tuple[float, float]) -> NDArray[np.float64]:
    """Corners of a rectangle between two distances along a wall and two out of it, (4, 2) [m]."""
    return np.array([frame.point(s[i], out[j], 0.0)[:2] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])


def _wall(axes: Axes, plan: FloorPlan, wall: Wall, past: float, zorder: float) -> None:
    """Fill a wall between its openings. It goes on ``past`` its ends; inside the room the floor covers that."""
    frame, begin = Frame.of(wall), -past
    solid = {"facecolor": INK, "edgecolor": INK, "zorder": zorder}
    for opening in sorted((o for o in (*plan.window, *plan.door) if o.wall == wall.name), key=lambda o: o.at):
        _fill(axes, _slab(frame, (begin, opening.extent[0]), (-wall.thickness, 0.0)), **solid)
        begin = opening.extent[1]
    _fill(axes, _slab(frame, (begin, wall.length + past), (-wall.thickness, 0.0)), f"wall_{wall.name}", **solid)


def _ground_lines(axes: Axes, plan: FloorPlan) -> None:
    for table in ("marking", "kerb"):
        for line in getattr(plan, table):
            for a, b in pairwise(np.array(line.points)):
                along = (b - a) / np.linalg.norm(b - a)
                aside = np.array([-along[1], along[0]]) * line.width / 2
                style = {
                    **FILLS[table],
                    "facecolor": str(0.6 + 0.4 * plan.material[line.material].albedo),
                    "zorder": 2.8,
                }
                _fill(axes, [a + aside, b + aside, b - aside, a - aside], f"{table}_{line.name}", **style)


def _lamps(axes: Axes, row: LampRow) -> None:
    half = np.array(row.size) / 2
    for middle in row.positions:
        _fill(axes, _box(middle - half, middle + half), f"lamp_{row.name}", **FILLS["lamp"], zorder=3.0)


def _standing(axes: Axes, plan: FloorPlan) -> None:
    for tree in plan.tree:
        _disc(axes, tree.at, tree.crown, f"tree_{tree.name}", **FILLS["tree"], zorder=3.5)
    for table in ("furniture", "stairs", "car", "tree", "post"):
        for item in getattr(plan, table):
            style = FILLS["pillar" if isinstance(item, Tree) or getattr(item, "kind", "") == "pillar" else table]
            for shape in footprints(plan, item):
                _footprint(axes, shape, f"{table}_{item.name}", style)
    for flight in plan.stairs:
        _treads(axes, flight)
    for car in plan.car:
        _windscreen(axes, footprints(plan, car)[0])
    for person in plan.person:
        _person(axes, person)


def _footprint(axes: Axes, shape: Footprint, name: str, style: dict[str, object]) -> None:
    if not shape.length:
        _disc(axes, (shape.x, shape.y), shape.radius, name, **style)
        return
    _fill(axes, _local(shape, [(-1, -1), (1, -1), (1, 1), (-1, 1)]), name, **style)


def _local(shape: Footprint, points: ArrayLike) -> NDArray[np.float64]:
    """Points in shares of a footprint's half sides as points of the plan, (n, 2) [m]."""
    cos, sin = np.cos(shape.heading), np.sin(shape.heading)
    scaled = np.asarray(points, dtype=float) * [shape.length, shape.width]
    return scaled @ np.array([[cos, sin], [-sin, cos]]) + [shape.x, shape.y]


def _disc(axes: Axes, middle: ArrayLike, radius: float, name: str, **style: object) -> None:
    style = {"linewidth": 0.4, "zorder": 4.0, **style}
    axes.add_patch(Circle(tuple(np.asarray(middle)), radius, gid=name, **style))


def _treads(axes: Axes, flight: Stairs) -> None:
    """A line for each step, and an arrow that points up."""
    along = np.array([np.cos(np.radians(flight.heading)), np.sin(np.radians(flight.heading))])
    aside = np.array([-along[1], along[0]]) * flight.width / 2
    for k in range(1, flight.steps):
        edge = np.array(flight.at) + k * flight.run * along
        _line(axes, [edge - aside, edge + aside], linewidth=0.3)
    foot = np.array(flight.at) + 0.3 * flight.run * along
    axes.annotate("", foot + (flight.steps - 0.6) * flight.run * along, foot, arrowprops=_arrow(INK), zorder=4.5)


def _arrow(colour: str) -> dict[str, object]:
    return {"arrowstyle": "-|>", "color": colour, "linewidth": 0.5, "mutation_scale": 7, "shrinkA": 0, "shrinkB": 0}


def _windscreen(axes: Axes, shape: Footprint) -> None:
    _line(axes, _local(shape, [(0.35, -0.8), (0.45, 0.0), (0.35, 0.8)]))
    _line(axes, _local(shape, [(-0.7, -0.8), (-0.7, 0.8)]))


def _person(axes: Axes, person: Person) -> None:
    _line(axes, person.path, color=PURPLE, linestyle=":", linewidth=0.7)
    _disc(axes, person.at, 0.25, f"person_{person.name}", **FILLS["person"])
    heading = np.radians(person.heading)
    _line(axes, [person.at, np.array(person.at) + 0.4 * np.array([np.cos(heading), np.sin(heading)])], linewidth=0.8)


# --- what is on walls ---


def _on_walls(axes: Axes, plan: FloorPlan) -> None:
    for window in plan.window:
        _window(axes, plan.wall_named(window.wall), window)
    for door in plan.door:
        _door(axes, plan.wall_named(door.wall), door)
    for cabinet in plan.cabinet:
        _footprint(axes, footprints(plan, cabinet)[0], f"cabinet_{cabinet.name}", FILLS["cabinet"])
    for one in plan.bin:
        _footprint(axes, footprints(plan, one)[0], f"bin_{one.name}", FILLS["bin"])
    for table, depth in (("poster", SHEET_DEPTH), ("board", BOARD_DEPTH)):
        for item in getattr(plan, table):
            frame = Frame.of(plan.wall_named(item.wall))
            _fill(axes, _slab(frame, item.extent, (0.0, depth)), f"{table}_{item.name}", **FILLS[table], zorder=4.2)
    for fixture in plan.fixture:
        _fixture(axes, Frame.of(plan.wall_named(fixture.wall)), fixture)


def _fixture(axes: Axes, frame: Frame, fixture: Fixture) -> None:
    name, depth = f"fixture_{fixture.name}", max(fixture.depth, LEAST_DEPTH)
    if fixture.kind == "extinguisher":
        _disc(axes, frame.point(fixture.at, depth / 2, 0.0)[:2], depth / 2, name, **FILLS["extinguisher"])
        return
    _fill(axes, _slab(frame, fixture.extent, (0.0, depth)), name, **FILLS[fixture.kind], zorder=4.1)


def _window(axes: Axes, wall: Wall, window: Window) -> None:
    frame, thick = Frame.of(wall), wall.thickness
    opening = _slab(frame, window.extent, (-thick, 0.0))
    _fill(axes, opening, f"window_{window.name}", facecolor="white", edgecolor=INK, zorder=2.6)
    glass = [frame.point(s, -0.7 * thick, 0.0)[:2] for s in window.extent]
    _line(axes, glass, color=SKY, linewidth=1.4)


def _door(axes: Axes, wall: Wall, door: Door) -> None:
    """The opening, the leaf as it stands, the quarter circle that it swings through, and the number."""
    frame = Frame.of(wall)
    _fill(axes, _slab(frame, door.extent, (-wall.thickness, 0.0)), facecolor="white", edgecolor="none", zorder=2.6)
    angles = np.radians(np.linspace(0.0, max(90.0, door.open), 24))
    tips = [_leaf(frame, door, angle).point(door.width, 0.0, 0.0)[:2] for angle in angles]
    _line(axes, tips, color="#888888", linewidth=0.35, linestyle="-" if door.open else ":")
    leaf = _leaf(frame, door, np.radians(door.open))
    _fill(axes, _slab(leaf, (0.0, door.width), (-0.04, 0.0)), f"door_{door.name}", facecolor=INK, edgecolor=INK)
    beyond = door.width + 0.15 if door.open else 0.45
    middle = frame.point(door.at, -wall.thickness - beyond, 0.0)[:2]
    turn = 90.0 if abs(frame.along[1]) > abs(frame.along[0]) else 0.0
    text = door.label or door.name
    axes.text(*middle, text, rotation=turn, ha="center", va="center", fontsize="small", clip_on=True, zorder=6)


def _leaf(frame: Frame, door: Door, angle: float) -> Frame:
    """The frame of a door's leaf, opened by ``angle`` [rad] away from the room."""
    at_start = door.hinge == "start"
    hinge, s = (frame, door.extent[0]) if at_start else (frame.reversed(), -door.extent[1])
    return hinge.turned(s, -door.recess, float(angle))


# --- routes ---


def _route(axes: Axes, plan: FloorPlan, name: str, aside: float, colour: str, dashes: object) -> None:
    """A line to the right of the route, with an arrow and the distance every ``MARK`` metres."""
    points = np.array(plan.routes[name])
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = steps / lengths[:, None]
    right = np.stack([along[:, 1], -along[:, 0]], axis=1) * aside
    _line(axes, _beside(points, right), color=colour, linestyle=dashes, linewidth=0.9, zorder=5.0, gid=f"route_{name}")
    behind = np.concatenate([[0.0], np.cumsum(lengths)])
    for distance in np.arange(0.0, behind[-1] + 1e-9, MARK):
        k = min(int(np.searchsorted(behind, distance, side="right")) - 1, len(lengths) - 1)
        at = points[k] + (distance - behind[k]) * along[k] + right[k]
        _mark(axes, at, along[k], right[k], f"{distance:g}", colour)


def _beside(points: NDArray[np.float64], right: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The line of points moved aside by each leg's vector; where it turns back it goes across."""
    line = [points[0] + right[0]]
    for point, before, after in zip(points[1:-1], right[:-1], right[1:], strict=True):
        both = before @ before + before @ after
        if both > 0.1 * (before @ before):
            line.append(point + (before + after) * (before @ before) / both)
        else:
            line += [point + before, point + after]
    return [*line, points[-1] + right[-1]]


def _mark(
    axes: Axes, at: NDArray[np.float64], along: NDArray[np.float64], right: NDArray[np.float64], text: str, colour: str
) -> None:
    arrow = axes.annotate("", at + 0.5 * along, at - 0.05 * along, arrowprops=_arrow(colour), zorder=5.1)
    arrow.set_clip_on(True)
    label = at + 0.2 * right / np.linalg.norm(right)
    axes.text(*label, text, color=colour, fontsize="small", ha="center", va="center", clip_on=True, zorder=6)


# --- the foot of the sheet ---


def _foot(figure: Figure, plan: FloorPlan, sheet: Sheet, light: LightSetting | None, routes: Sequence[str]) -> None:
    """Title, legend, scale and compass, in millimetres of the smallest paper."""
    width, height = sheet.size / sheet.lettering
    axes = figure.add_axes((0.0, 0.0, 1.0, FOOT / height))
    axes.set(xlim=(0.0, width), ylim=(0.0, FOOT))
    axes.set_axis_off()
    _line(axes, [(EDGE, FOOT - 2), (width - EDGE, FOOT - 2)])
    axes.text(EDGE, FOOT - 10, plan.name, fontsize="xx-large", weight="bold")
    for i, line in enumerate(_title_lines(plan, sheet, light)):
        axes.text(EDGE, FOOT - 15.5 - 4.2 * i, line)
    _scale_bar(axes, sheet.scale * sheet.lettering, np.array([EDGE, 5.0]))
    axes.legend(
        handles=_legend(plan, routes),
        loc="upper left",
        bbox_to_anchor=(150.0, FOOT - 3.0),
        bbox_transform=axes.transData,
        ncols=4,
        frameon=False,
        handlelength=2.4,
        columnspacing=1.6,
    )
    _compass(axes, plan, light, np.array([width - EDGE - 20.0, 19.0]))


def _title_lines(plan: FloorPlan, sheet: Sheet, light: LightSetting | None) -> list[str]:
    size = plan.bounds[1] - plan.bounds[0]
    height = f" × {plan.ceiling.height:g} m high" if plan.ceiling else ", in the open air"
    lines = [plan.title] if plan.title else []
    scale = f"drawn 1:{sheet.scale} on {sheet.paper}; figures along the sides in metres"
    lines.append(f"{size[0]:g} m × {size[1]:g} m{height}; {scale}")
    if light is not None:
        elevation, azimuth = np.degrees(sun_position(plan.place, light.date or plan.place.date, light.hour))
        stands = f"{elevation:.1f}° up in {azimuth:.0f}°" if elevation > 0 else f"{-elevation:.1f}° below the horizon"
        lines.append(f"light {light.name} on {light.date or plan.place.date}: the sun is {stands}")
    return lines


def _scale_bar(axes: Axes, scale: float, at: NDArray[np.float64]) -> None:
    """Five fields of a metre or more, black and white."""
    field = next(f for f in (1, 2, 5, 10, 20, 50, 100) if f * 1000 / scale >= 8.0)
    width = field * 1000 / scale
    for k in range(5):
        low = at + np.array([k * width, 0.0])
        _fill(axes, _box(low, low + np.array([width, 1.6])), facecolor=INK if k % 2 == 0 else "white", edgecolor=INK)
    for k in range(6):
        unit = " m" if k == 5 else ""
        axes.text(at[0] + k * width, at[1] + 2.4, f"{k * field}{unit}", fontsize="small", ha="center")


def _legend(plan: FloorPlan, routes: Sequence[str]) -> list[Patch | Line2D]:
    shown = {table for table in FILLS if getattr(plan, table, ())}
    shown |= {fixture.kind for fixture in plan.fixture}
    shown |= {"pillar"} if any(item.kind == "pillar" for item in plan.furniture) else set()
    handles: list[Patch | Line2D] = [Patch(label=name, linewidth=0.4, **FILLS[name]) for name in FILLS if name in shown]
    if plan.window:
        handles.append(Line2D([], [], color=SKY, linewidth=1.4, label="window"))
    for i, name in enumerate(routes):
        colour, dashes = ROUTES[i % len(ROUTES)]
        length = np.linalg.norm(np.diff(np.array(plan.routes[name]), axis=0), axis=1).sum()
        handles.append(Line2D([], [], color=colour, linestyle=dashes, label=f"route {name}, {length:.0f} m"))
    return handles


def _compass(axes: Axes, plan: FloorPlan, light: LightSetting | None, middle: NDArray[np.float64]) -> None:
    """A rose whose arrow points north; the sun stands on its rim, hollow where it is below the horizon."""
    radius = 11.0
    axes.add_patch(Circle(tuple(middle), radius, fill=False, linewidth=0.4, edgecolor=PALE))
    north = _bearing(plan, 0.0)
    axes.annotate("", middle + 0.8 * radius * north, middle - 0.8 * radius * north, arrowprops=_arrow(INK))
    axes.text(*(middle + 1.25 * radius * north), "N", fontsize="large", weight="bold", ha="center", va="center")
    if light is None:
        return
    elevation, azimuth = sun_position(plan.place, light.date or plan.place.date, light.hour)
    towards = _bearing(plan, float(np.degrees(azimuth)))
    axes.annotate("", middle, middle + radius * towards, arrowprops=_arrow(ORANGE))
    up = elevation > 0.0
    axes.add_patch(
        Circle(tuple(middle + radius * towards), 1.8, facecolor=ORANGE if up else "white", edgecolor=ORANGE, zorder=5)
    )


def _bearing(plan: FloorPlan, degrees: float) -> NDArray[np.float64]:
    """The unit vector on the plan that points along a compass bearing, (2,)."""
    angle = np.radians(plan.place.x_azimuth - degrees)
    return np.array([np.cos(angle), np.sin(angle)])
