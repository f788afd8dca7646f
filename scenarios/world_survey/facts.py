"""Facts about worlds: the library, one world, light at a point, and the room that robots take."""

import math
from collections.abc import Iterator, Mapping, Sequence

import mujoco
import numpy as np
from rich.table import Table
from rich.text import Text

from refseq_bench import robots
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import TextTable, plural
from refseq_bench.scenarios.world_survey.library import length, size_text, things
from refseq_bench.worlds.check import RobotBox, geom_boxes
from refseq_bench.worlds.light import PRESETS, LightSetting, clock_text, light_named
from refseq_bench.worlds.lighting.daylight import sun_position
from refseq_bench.worlds.meter import Reading
from refseq_bench.worlds.plans.areas import inside, rectangles, valid_areas
from refseq_bench.worlds.plans.schema import FloorPlan, LampRow, Post

FACINGS: Mapping[str, tuple[float, float, float]] = {"up": (0.0, 0.0, 1.0), "down": (0.0, 0.0, -1.0)}


# --- show ---


def world_table(plan: FloorPlan) -> Table:
    """All about one world, for a terminal of 80 characters."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold")
    table.add_column()
    for about, line in _about(plan):
        table.add_row(about, Text(line))
    return table


def _about(plan: FloorPlan) -> Iterator[tuple[str, str]]:
    place, floor = plan.place, plan.floor
    yield plan.name, plan.title
    yield "place", f"latitude {place.latitude:g}°, longitude {place.longitude:g}°; {place.timezone}, {place.date}"
    yield "", f"the x axis points to {place.x_azimuth:g}° on the compass"
    (x0, y0), (x1, y1) = plan.bounds
    yield "size", f"{size_text(plan)} m, x {x0:g} to {x1:g}, y {y0:g} to {y1:g}"
    yield "floor", f"{floor.pattern} of {floor.tile:g} m, albedo {plan.material[floor.material].albedo:g}"
    yield "ceiling", _ceiling_text(plan)
    yield "walls", f"{len(plan.wall)}, {sum(wall.length for wall in plan.wall):.0f} m in all"
    if plan.window:
        yield "windows", f"{_glazed_share(plan):.0%} of the length of the walls that have any".replace("%", " %")
    yield "things", _things_text(plan)
    lamps: tuple[LampRow | Post, ...] = (*plan.lamp, *plan.post)
    for lamp in lamps:
        count = plural(lamp.count, "lamp") if isinstance(lamp, LampRow) else "a street lamp"
        yield f"lamp {lamp.name}", f"{count} of {lamp.lumen:g} lm, {lamp.kelvin:g} K, switch {lamp.switch}"
    for name, points in plan.routes.items():
        (x0, y0), (x1, y1) = points[0], points[-1]
        ends = f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g})"
        yield f"route {name}", f"{length(points):.1f} m, {len(points)} points {ends}"
    for name in PRESETS:
        yield f"light {name}", sun_text(plan, light_named(name))


def _ceiling_text(plan: FloorPlan) -> str:
    if plan.ceiling is None:
        return "none: in the open air"
    return f"{plan.ceiling.height:g} m high, albedo {plan.material[plan.ceiling.material].albedo:g}"


def _glazed_share(plan: FloorPlan) -> float:
    """Share of the length of those walls with windows that is window; windows above each other count once."""
    walls = {window.wall for window in plan.window}
    spans = {(window.wall, *window.extent) for window in plan.window}
    return sum(last - first for _, first, last in spans) / sum(plan.wall_named(name).length for name in walls)


def _things_text(plan: FloorPlan) -> str:
    ajar = sum(door.open > 0 for door in plan.door)
    told = [f"{kind} {count}" + (f" ({ajar} open)" if kind == "door" else "") for kind, count in things(plan).items()]
    return ", ".join(told) or "none"


def sun_text(plan: FloorPlan, setting: LightSetting) -> str:
    """The hour of a light and where the sun then stands, [deg]."""
    elevation, azimuth = np.degrees(sun_position(plan.place, setting.date or plan.place.date, setting.hour))
    clock = clock_text(setting.hour)
    clouds = f", cloud {setting.cloud:g}" if setting.cloud else ""
    if elevation <= 0.0:
        return f"{clock}{clouds}, the sun is {-elevation:.1f}° below the horizon"
    return f"{clock}{clouds}, the sun is {elevation:.1f}° up in {azimuth:.0f}°"


# --- check ---


def robot_boxes() -> tuple[RobotBox, ...]:
    """The room that each robot takes as it is loaded, from the boxes around all its geoms."""
    return tuple(robot_box(name) for name in robots.names())


def robot_box(name: str) -> RobotBox:
    """The room that a robot takes around its base, [m]."""
    robot = robots.load(name)
    model = robot.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    low, high = geom_boxes(model, data)
    (back, right, bottom), (front, left, top) = low.min(axis=0), high.max(axis=0)
    x, y, _ = data.body(robot.base).xpos
    half_width = max(left - y, y - right)
    return RobotBox(name, *map(float, (front - x, x - back, half_width, top - bottom)))


# --- lux ---


def point_in(plan: FloorPlan, text: str) -> tuple[float, float, float]:
    """Read ``X,Y,Z`` [m], a point between the walls, floor and ceiling."""
    point = _triple("at", text, "X,Y,Z in metres, such as 12.5,0,1")
    top = math.inf if plan.ceiling is None else plan.ceiling.height
    if not inside(plan, point[:2]) or not 0.0 <= point[2] <= top:
        heights = "z from 0" if plan.ceiling is None else f"z 0 to {top:g}"
        raise ScenarioError(f"at '{text}' lies outside '{plan.name}'; {valid_areas(rectangles(plan))}; {heights}")
    return point


def direction(text: str) -> tuple[float, float, float]:
    """Read which way a card faces: up, down or ``X,Y,Z``."""
    valid = "up, down or X,Y,Z, a direction such as 0,1,0"
    found = FACINGS.get(text) or _triple("facing", text, valid)
    if not any(found):
        raise ScenarioError(f"facing '{text}' is not valid; it should be {valid}")
    return found


def _triple(what: str, text: str, valid: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        raise ScenarioError(f"{what} '{text}' is not valid; it should be {valid}")
    return x, y, z


def lux_table(readings: Sequence[tuple[str, Reading]]) -> TextTable:
    """Illuminance by point and by where it comes from [lx]."""
    table = TextTable("at [m]", ">sun [lx]", ">sky", ">lamps", ">reflected", ">total")
    for at, reading in readings:
        parts = (reading.sun, reading.sky, reading.lamps, reading.indirect, reading.total)
        table.add_row(at, *map(lux_text, parts))
    return table


def lux_text(lux: float) -> str:
    """An illuminance in full, to two digits where it is faint [lx]."""
    return f"{lux:.0f}" if lux >= 10 else f"{lux:.2g}"
