"""The light sources of a plan under a light: what is on, how bright windows and lamps are, and what a renderer gets.

Indoors each source is known twice: as what it is, a luminous rectangle (``Sources``), for all that is measured; and as
the spot light that stands for it in a picture (``Spot``), which has no size, a narrower lobe and an end.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.light import Lamps, LightSetting
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import Daylight, daylight
from refseq_bench.worlds.lighting.form_factors import Quads
from refseq_bench.worlds.plans.frame import UP, LocalFrame
from refseq_bench.worlds.plans.schema import FloorPlan, LampRow, Post, Window

GLAZING = MappingProxyType({"4mm": 0.89, "6mm": 0.87, "double": 0.76})
"""Share of light that each glazing lets through (facts: ESP-r)."""
LAMPS_BELOW = 2000.0
"""Lamps that nobody switches by hand burn while the ground outside gets less than this [lx]; a choice."""
FRAME_SHARE = 0.15
"""Share of a window's opening that its frame takes; a choice that fits the frame that is built."""
LAMP_DEPTH = 0.06
"""Depth of a lamp's face below the ceiling [m]; a choice."""
CUTOFF = 80.0
"""Half angle of the cone that a window or lamp shines into [deg]; wider ones would light the wall they are in."""
LOBE = 2.0 / 3.0 * (1.0 - np.cos(np.radians(CUTOFF)))
"""Flux of a spot light of full softness over that of a diffuse source of the same luminance.

Filament's spot falls with ((cosθ - c) / (1 - c))^2, c = cos(CUTOFF), which sums to 2 π (1 - c) / 3; cosθ sums to π.
"""
REACH = 7.0
"""Range of a window or lamp [m]; a choice that keeps the number of lights that reach a pixel, and with it the
rendering time, low: Filament lets each fade by (1 - (d / REACH)^4)^2, 5 % at the opposite wall."""
NIGHT_PEAK = 60.0
"""Luminance of the brightest thing outside at night, a street lamp's globe [cd/m²]; a choice."""


@dataclass(frozen=True, slots=True)
class Photometry:
    """The light that a plan gets: daylight ``outdoors``, and the rows of lamps and the posts that burn."""

    outdoors: Daylight
    lit_rows: tuple[LampRow, ...]
    lit_posts: tuple[Post, ...]


def photometry(plan: FloorPlan, setting: LightSetting) -> Photometry:
    """Look up the sky and the switches for ``plan`` under ``setting``."""
    outdoors = daylight(plan.place, setting.date or plan.place.date, setting.hour, setting.cloud)
    rows = tuple(row for row in plan.lamp if burns(row, setting, outdoors))
    posts = tuple(post for post in plan.post if burns(post, setting, outdoors))
    return Photometry(outdoors, rows, posts)


def burns(row: LampRow | Post, setting: LightSetting, outdoors: Daylight) -> bool:
    """Tell whether a row of lamps or a post is on."""
    if setting.lamps is not Lamps.AUTO:
        return setting.lamps is Lamps.ON
    return row.switch == "always" or outdoors.ground < LAMPS_BELOW


# --- windows ---


def transmission(plan: FloorPlan) -> float:
    """Share of light that the plan's windows let through, the mean of their glass; 1 in the open."""
    areas = {w.name: glass_area(w) for w in plan.window}
    if plan.ceiling is None or not areas:
        return 1.0
    return sum(GLAZING[w.glazing] * areas[w.name] for w in plan.window) / sum(areas.values())


def window_luminance(plan: FloorPlan, window: Window, outdoors: Daylight) -> float:
    """Mean luminance of the glazing as the room sees it [cd/m²]: a vertical pane sees half sky, half ground."""
    return float(np.mean([GLAZING[window.glazing] * half for half in outlook(plan, outdoors)]))


def outlook(plan: FloorPlan, outdoors: Daylight) -> tuple[float, float]:
    """Luminance of what lies above and below the horizon outside [cd/m²], each the same all over: a choice."""
    return outdoors.sky / np.pi, plan.place.ground_albedo * outdoors.ground / np.pi


def glass_area(window: Window) -> float:
    """Glass of a window, without its frame [m²]."""
    return (1.0 - FRAME_SHARE) * window.width * window.height


# --- what the sources are ---


@dataclass(frozen=True, slots=True)
class Sources:
    """Luminous rectangles indoors and their luminances [cd/m²].

    A window is as bright as the sky for who looks up to it and as the ground for who looks down: ``above`` and
    ``below`` (w,). It lies in the wall's inner face: its reveal is taken to be as bright as the glass.
    ``lamp_luminances`` are (l, 2): as they are, and weighted with what a camera gathers from the lamp's colour.
    """

    windows: Quads
    above: Floats
    below: Floats
    lamps: Quads
    lamp_luminances: Floats


def sources(plan: FloorPlan, numbers: Photometry) -> Sources:
    """Return the windows and the burning lamps of a plan with a ceiling."""
    lit = numbers.lit_rows
    shares = np.array([(1.0 - FRAME_SHARE) * GLAZING[w.glazing] for w in plan.window])
    above, below = outlook(plan, numbers.outdoors)
    return Sources(
        windows=Quads.joined([_pane(plan, window) for window in plan.window]),
        above=shares * above,
        below=shares * below,
        lamps=Quads.joined([_lamp(plan, row, at) for row in lit for at in row.positions]),
        lamp_luminances=np.array([_lamp_luminance(row) for row in lit for _ in range(row.count)]).reshape(-1, 2),
    )


def _pane(plan: FloorPlan, window: Window) -> Quads:
    frame = LocalFrame.of(plan.wall_named(window.wall))
    return frame_face(frame, window.extent, window.rise)


def frame_face(
    frame: LocalFrame, s: tuple[float, float], z: tuple[float, float], tiles: tuple[int, int] = (1, 1)
) -> Quads:
    """Cut a rectangle on a wall's face, spans along it and up [m]; it looks into the room."""
    start, end = s if frame.handed < 0 else s[::-1]
    along = np.append((end - start) * frame.along, 0.0)
    return Quads.tiled(frame.point(start, 0.0, z[0]), along, (z[1] - z[0]) * UP, tiles)


def _lamp(plan: FloorPlan, row: LampRow, at: Floats) -> Quads:
    low = np.append(at - np.array(row.size) / 2, plan.roof.height - LAMP_DEPTH)
    return Quads.tiled(low, [0.0, row.size[1], 0.0], [row.size[0], 0.0, 0.0])


def _lamp_luminance(row: LampRow) -> tuple[float, float]:
    luminance = row.lumen / (np.pi * row.size[0] * row.size[1])
    return luminance, camera_weight(row.kelvin) * luminance


# --- what a renderer gets ---


@dataclass(frozen=True, slots=True)
class Spot:
    """A spot light of ``candela`` on its ``axis`` (3,) at ``pos`` (3,) [m]; ``kind`` is window or lamp.

    A lamp's candela are weighted with what a camera gathers from its colour.
    """

    name: str
    kind: str
    candela: float
    pos: Floats
    axis: Floats


def spots(plan: FloorPlan, numbers: Photometry) -> tuple[Spot, ...]:
    """Return the spot lights that stand for the windows and the burning lamps."""
    found = [_window_spot(plan, window, numbers.outdoors) for window in plan.window]
    for row in numbers.lit_rows:
        candela = camera_weight(row.kelvin) * row.lumen / (np.pi * LOBE)
        height = plan.roof.height - LAMP_DEPTH
        found += [
            Spot(f"lamp:{row.name}:{i}", "lamp", candela, np.append(at, height), -UP)
            for i, at in enumerate(row.positions)
        ]
    return tuple(found)


def _window_spot(plan: FloorPlan, window: Window, outdoors: Daylight) -> Spot:
    """I = L A, along the mean direction of what comes through: light of the sky goes down, of the ground up.

    A half hemisphere of one luminance sends 2/3 of it down and π/3 inwards: ∫ cosθ ω dΩ.
    """
    wall = plan.wall_named(window.wall)
    frame, (sky, ground) = LocalFrame.of(wall), outlook(plan, outdoors)
    fall = 2 / np.pi * (sky - ground) / (sky + ground)
    candela = window_luminance(plan, window, outdoors) * glass_area(window)
    pos = frame.point(window.at, -wall.thickness, window.sill + window.height / 2)
    axis = np.append(frame.inward, -fall) / np.hypot(1.0, fall)
    return Spot(f"window:{window.name}", "window", candela, pos, axis)


def spot_illuminance(spot: Spot, points: Floats) -> Floats:
    """Return what a card at each of ``points`` (m, 3) gets that faces the spot, as a vector towards the light, (m, 3).

    E = I(θ) / d², faded towards ``REACH`` as Filament does it [lx].
    """
    ray = points - spot.pos
    d = np.linalg.norm(ray, axis=1)
    edge = np.cos(np.radians(CUTOFF))
    cone = np.maximum(0.0, (ray @ spot.axis / d - edge) / (1.0 - edge)) ** 2
    fade = np.maximum(0.0, 1.0 - (d / REACH) ** 4) ** 2
    return -ray * (spot.candela * cone * fade / d**3)[:, None]
