"""A robot's model drawn from the side, from ahead and from above, to one scale, with its measures."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import mujoco
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Patch, Polygon, Rectangle
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from refseq_bench.scenarios.robot_checks.body import Body, BodyBox
from refseq_bench.scenarios.robot_checks.sources import BODY, VEHICLE, RobotMeasure, sourced
from refseq_bench.worlds.arrays import Floats

INK, SOURCE, MEASURE = "#222222", "#d55e00", "#0072b2"
AROUND = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)
RING = np.stack([np.cos(AROUND), np.sin(AROUND), np.zeros_like(AROUND)], axis=1)  # (32, 3)
SPREAD = 0.16
"""Room between two lines of measures [m on paper]."""


class DrawingSide(Enum):
    """Where one looks from: the axes that go right and up on paper, and the one that comes towards the eye."""

    RIGHT = ((1, 0, 0), (0, 0, 1), (0, -1, 0))
    FRONT = ((0, 1, 0), (0, 0, 1), (1, 0, 0))
    ABOVE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))

    @property
    def axes(self) -> Floats:
        """Axes as rows, (3, 3): right, up, near."""
        return np.array(self.value, float)


@dataclass(frozen=True, slots=True)
class PlacedView:
    """A view on the sheet: seen from ``side``, the robot's origin at ``at`` (2,) [m on paper]."""

    side: DrawingSide
    at: Floats

    def on_paper(self, points: Floats) -> Floats:
        """Points (n, 3) of the robot on the sheet, (n, 2)."""
        return points @ self.side.axes[:2].T + self.at

    def box(self, box: BodyBox) -> tuple[Floats, Floats]:
        """Lower left corner and size of a box on the sheet, (2,) each."""
        ends = self.on_paper(np.array([box.low, box.high]))
        return ends.min(axis=0), np.abs(ends[1] - ends[0])


def draw_views(axes: Axes, body: Body) -> None:
    """Fill ``axes`` with the three views, their measures in blue, and sourced sizes as dashed outlines."""
    whole = body.whole
    side = PlacedView(DrawingSide.RIGHT, np.zeros(2))
    front = PlacedView(DrawingSide.FRONT, np.array([whole.high[0] + whole.size[1] / 2 + 0.45, 0.0]))
    above = PlacedView(DrawingSide.ABOVE, np.array([0.0, -(whole.high[1] + 0.5)]))
    for place, name in ((side, "right side"), (front, "front"), (above, "top")):
        _draw_model(axes, place, body)
        _draw_sourced(axes, place, body)
        low, size = place.box(whole)
        axes.text(low[0] + size[0] / 2, low[1] + size[1] + 0.05, name, ha="center", va="bottom", color=INK, fontsize=10)
    for place in (side, front):
        low, size = place.box(whole)
        axes.plot([low[0] - 0.1, low[0] + size[0] + 0.1], [0, 0], color=INK, lw=0.8, zorder=0)
    _heights(axes, side, body)
    _lengths(axes, side, front, above, body)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.autoscale_view()


# --- the model ---


def _draw_model(axes: Axes, place: PlacedView, body: Body) -> None:
    """Draw all geoms that are seen as filled outlines, the far ones first."""
    shapes = [(geom, surface(body.model, body.data, geom)) for geom in map(int, body.seen)]
    near = place.side.axes[2]
    for geom, points in sorted(shapes, key=lambda shape: float((shape[1] @ near).max())):
        flat = place.on_paper(points)
        grey = 0.25 + 0.75 * _colour(body.model, geom)
        axes.add_patch(Polygon(flat[ConvexHull(flat).vertices], facecolor=(grey,) * 3, edgecolor=INK, lw=0.4, zorder=2))


def _colour(model: mujoco.MjModel, geom: int) -> float:
    number = int(model.geom_matid[geom])
    return float(model.mat_rgba[number, 0] if number >= 0 else model.geom_rgba[geom, 0])


def surface(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """Points on a geom's surface that span its outline from any side, (n, 3) [m] in the world."""
    local = _local(model, geom)
    return local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]


def _local(model: mujoco.MjModel, geom: int) -> Floats:
    size, kind = model.geom_size[geom], mujoco.mjtGeom(model.geom_type[geom])
    up = np.array([0.0, 0.0, 1.0])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        ring = RING * size[0]
        return np.vstack([ring + size[1] * up, ring - size[1] * up])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        ball = _ball() * size[0]
        return np.vstack([ball + size[1] * up, ball - size[1] * up])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return _ball() * size[0]
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return _ball() * size
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return model.mesh_vert[first : first + count].astype(float)
    # A box, or the box around what has no outline of its own here.
    middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    return middle + half * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T


def _ball() -> Floats:
    """Points on a sphere of radius 1, (n, 3)."""
    tilts = np.linspace(-np.pi / 2, np.pi / 2, 17)
    return np.vstack([RING * np.cos(tilt) + (0.0, 0.0, np.sin(tilt)) for tilt in tilts])


# --- sourced sizes ---


def _draw_sourced(axes: Axes, place: PlacedView, body: Body) -> None:
    """Draw outlines of the sizes that sources give, where the model has what they are the sizes of."""
    for box, known in _sourced_boxes(body):
        if known[place.side.axes[:2].any(axis=0)].all():  # a side that nobody gives would be the model's own
            low, size = place.box(box)
            axes.add_patch(_dashed(Rectangle((low[0], low[1]), size[0], size[1])))
    wheel = sourced(body).get(RobotMeasure.WHEEL)
    if wheel is not None and place.side is DrawingSide.RIGHT:
        radius = wheel.value / 2
        axes.add_patch(_dashed(Circle((place.at[0] + body.hubs[0, 0], place.at[1] + radius), radius)))


def _dashed(outline: Patch) -> Patch:
    """The outline of a sourced size, as all of them are drawn: over the model, and not filled."""
    outline.set_fill(False)
    outline.set_edgecolor(SOURCE)
    outline.set_linewidth(1.1)
    outline.set_linestyle((0, (4, 2)))
    outline.set_zorder(4)
    return outline


def _sourced_boxes(body: Body) -> Iterator[tuple[BodyBox, NDArray[np.bool_]]]:
    """Boxes of sourced size from the rear and the bottom of the model's on, and which sides (3,) sources give."""
    known = sourced(body)
    for box, names in ((body.vehicle, VEHICLE), (body.chassis, BODY)):
        if box is not None:
            given = np.array([name in known for name in names])
            size = np.array([known[name].value if name in known else 0.0 for name in names])
            low = np.array([box.low[0], box.middle[1] - size[1] / 2, box.low[2]])
            yield BodyBox(low, low + size), given


# --- measures ---


def _heights(axes: Axes, place: PlacedView, body: Body) -> None:
    """Heights above the floor, left of the view from the side, the lowest nearest."""
    robot, data = body.robot, body.data
    heights = {
        "wheel": body.wheel.high[2],
        "scan plane": data.site(robot.laser).xpos[2],
        **({"body": body.chassis.high[2]} if body.chassis is not None else {}),
        "vehicle": body.vehicle.high[2],
        **{name: data.camera(name).xpos[2] for name in robot.cameras},
        "mast": body.whole.high[2],
    }
    left = place.box(body.whole)[0][0] - 0.12
    for i, (name, height) in enumerate(sorted(heights.items(), key=lambda item: item[1])):
        x = left - SPREAD * i
        axes.plot([x - 0.03, place.at[0]], [height] * 2, color=MEASURE, lw=0.3, zorder=1)
        _line(axes, (x, 0.0), (x, height), f"{name} {height:.3f}", upright=True)


def _lengths(axes: Axes, side: PlacedView, front: PlacedView, above: PlacedView, body: Body) -> None:
    """Lengths under the views from the side and from above, widths under that from ahead."""
    low, size = side.box(body.vehicle)
    _line(axes, (low[0], -0.1), (low[0] + size[0], -0.1), f"length {size[0]:.3f}")
    low, size = front.box(body.vehicle)
    ends = front.on_paper(body.hubs)[:, 0]
    _line(axes, (min(ends), -0.1), (max(ends), -0.1), f"track {body.track:.3f}")
    _line(axes, (low[0], -0.1 - SPREAD), (low[0] + size[0], -0.1 - SPREAD), f"width {size[0]:.3f}")
    low, size = above.box(body.vehicle)
    axle, y = above.at[0], low[1] - 0.1
    for start, end in ((low[0], axle), (axle, low[0] + size[0])):
        _line(axes, (start, y), (end, y), f"{end - start:.3f}")
    axes.plot([axle] * 2, [y - 0.03, low[1] + size[1] + 0.03], color=MEASURE, lw=0.5, ls=(0, (8, 2, 2, 2)), zorder=3)


def _line(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, *, upright: bool = False
) -> None:
    """A line with an arrow at both ends and its text beside it."""
    axes.annotate(
        "", start, end, arrowprops={"arrowstyle": "<->", "color": MEASURE, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
    )
    x, y = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    if upright:
        axes.text(x - 0.015, y, text, rotation=90, ha="right", va="center", color=MEASURE, fontsize=8)
    else:
        axes.text(x, y - 0.015, text, ha="center", va="top", color=MEASURE, fontsize=8)
