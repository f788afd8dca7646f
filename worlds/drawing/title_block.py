"""Title block of a plan's drawing: name, legend, scale bar and compass."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.drawing.sheet import EDGE, FOOT, DrawingSheet
from refseq_bench.worlds.drawing.style import FILLS, INK, ORANGE, PALE, ROUTES, SKY, arrow, box, disc, fill, label, line
from refseq_bench.worlds.light import LightSetting
from refseq_bench.worlds.lighting.daylight import sun_position
from refseq_bench.worlds.plans.schema import FloorPlan


def draw_title_block(
    figure: Figure, plan: FloorPlan, sheet: DrawingSheet, light: LightSetting | None, routes: Sequence[str]
) -> None:
    """Title, legend, scale and compass, in millimetres of the smallest paper."""
    width, height = sheet.size / sheet.lettering
    axes = figure.add_axes((0.0, 0.0, 1.0, FOOT / height))
    axes.set(xlim=(0.0, width), ylim=(0.0, FOOT))
    axes.set_axis_off()
    line(axes, [(EDGE, FOOT - 2), (width - EDGE, FOOT - 2)])
    axes.text(EDGE, FOOT - 10, plan.name, fontsize="xx-large", weight="bold")
    for i, text in enumerate(_title_lines(plan, sheet, light)):
        axes.text(EDGE, FOOT - 15.5 - 4.2 * i, text)
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


def _title_lines(plan: FloorPlan, sheet: DrawingSheet, light: LightSetting | None) -> list[str]:
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


def _scale_bar(axes: Axes, scale: float, at: Floats) -> None:
    """Five fields of a metre or more, black and white."""
    field = next(f for f in (1, 2, 5, 10, 20, 50, 100) if f * 1000 / scale >= 8.0)
    width = field * 1000 / scale
    for k in range(5):
        low = at + np.array([k * width, 0.0])
        fill(axes, box(low, low + np.array([width, 1.6])), facecolor=INK if k % 2 == 0 else "white", edgecolor=INK)
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


def _compass(axes: Axes, plan: FloorPlan, light: LightSetting | None, middle: Floats) -> None:
    """A rose whose arrow points north; the sun stands on its rim, hollow where it is below the horizon."""
    radius = 11.0
    disc(axes, middle, radius, fill=False, edgecolor=PALE, zorder=1.0)
    north = _bearing(plan, 0.0)
    arrow(axes, middle + 0.8 * radius * north, middle - 0.8 * radius * north)
    label(axes, middle + 1.25 * radius * north, "N", fontsize="large", weight="bold")
    if light is None:
        return
    elevation, azimuth = sun_position(plan.place, light.date or plan.place.date, light.hour)
    towards = middle + radius * _bearing(plan, float(np.degrees(azimuth)))
    arrow(axes, middle, towards, ORANGE)  # as its light falls
    disc(
        axes, towards, 1.8, facecolor=ORANGE if elevation > 0.0 else "white", edgecolor=ORANGE, linewidth=1.0, zorder=5
    )


def _bearing(plan: FloorPlan, degrees: float) -> Floats:
    """The unit vector on the plan that points along a compass bearing, (2,)."""
    angle = np.radians(plan.place.x_azimuth - degrees)
    return np.array([np.cos(angle), np.sin(angle)])
