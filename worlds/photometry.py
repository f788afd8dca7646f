"""How much light arrives indoors: the photometry of a plan under a light.

Daylight comes in through the windows, lamps add theirs, and what they all leave after one reflection is spread evenly
over the room's surfaces (split flux: E = Φ ρ / (A (1 − ρ)), as in the integrating sphere).
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from worlds.areas import floor_area
from worlds.daylight import Daylight, daylight, sun_direction
from worlds.frame import Frame
from worlds.light import Lamps, LightSetting
from worlds.schema import FloorPlan, LampRow, Window

GLAZING = MappingProxyType({"4mm": 0.89, "6mm": 0.87, "double": 0.76})
"""Share of light that each glazing lets through (facts: ESP-r)."""
LAMPS_BELOW = 2000.0
"""Lamps that nobody switches by hand burn while the ground outside gets less than this [lx]; a choice."""
FRAME_SHARE = 0.15
"""Share of a window's opening that its frame takes; a choice that fits the frame that is built."""
CUTOFF = 80.0
"""Half angle of the cone that a window or lamp shines into [deg]; wider ones would light the wall they are in."""
LOBE = 2.0 / 3.0 * (1.0 - np.cos(np.radians(CUTOFF)))
"""Flux of a spot light of full softness over that of a diffuse source of the same luminance.

Filament's spot falls with ((cosθ - c) / (1 - c))^2, c = cos(CUTOFF), which sums to 2 π (1 - c) / 3; cosθ sums to π.
"""
REACH = 7.0
"""How far a window or lamp shines [m]; a choice that keeps the number of lights that reach a pixel, and with it the
rendering time, low: Filament lets each fade by (1 - (d / REACH)^4)^2, 5 % at the opposite wall."""
NIGHT_PEAK = 60.0
"""Luminance of the brightest thing outside at night, a street lamp's globe [cd/m²]; a choice."""


@dataclass(frozen=True, slots=True)
class Photometry:
    """Light in one plan: fluxes [lm], illuminances [lx], areas [m²]; ``indirect`` reaches every surface from all sides.

    ``burning`` names the rows of lamps that are on.
    """

    outdoors: Daylight
    burning: tuple[str, ...]
    window_flux: float
    sun_flux: float
    lamp_flux: float
    area: float
    albedo: float
    indirect: float


def photometry(plan: FloorPlan, setting: LightSetting) -> Photometry:
    """Work out all the light in ``plan`` under ``setting``."""
    outdoors = daylight(plan.place, setting.date or plan.place.date, setting.hour, setting.cloud)
    lit = [row for row in plan.lamp if burns(row, setting, outdoors)]
    window_flux = np.pi * sum(window_luminance(plan, w, outdoors) * glass_area(w) for w in plan.window)
    sun_flux = outdoors.direct * sum(GLAZING[w.glazing] * _sunlit(plan, w, outdoors) for w in plan.window)
    lamp_flux = sum(row.count * row.lumen for row in lit)
    area, albedo = _surfaces(plan)
    floor = plan.material[plan.floor.material].albedo  # a high sun falls on the floor first
    first_bounce = ((window_flux + lamp_flux) * albedo + sun_flux * floor) / (area * (1.0 - albedo))
    beyond_lobe = (1.0 - LOBE) * window_flux / area  # what the windows' spot lights leave out at flat angles
    return Photometry(
        outdoors=outdoors,
        burning=tuple(row.name for row in lit),
        window_flux=window_flux,
        sun_flux=sun_flux,
        lamp_flux=lamp_flux,
        area=area,
        albedo=albedo,
        indirect=first_bounce + beyond_lobe,
    )


def burns(row: LampRow, setting: LightSetting, outdoors: Daylight) -> bool:
    """Whether a row of lamps is on."""
    if setting.lamps is not Lamps.AUTO:
        return setting.lamps is Lamps.ON
    return row.switch == "always" or outdoors.ground < LAMPS_BELOW


def transmission(plan: FloorPlan) -> float:
    """Share of light that the plan's windows let through, the mean of their glass; 1 in the open."""
    areas = {w.name: glass_area(w) for w in plan.window}
    if plan.ceiling is None or not areas:
        return 1.0
    return sum(GLAZING[w.glazing] * areas[w.name] for w in plan.window) / sum(areas.values())


def window_luminance(plan: FloorPlan, window: Window, outdoors: Daylight) -> float:
    """Luminance of the glazing as the room sees it [cd/m²]: a vertical pane sees half sky, half ground."""
    ground = plan.place.ground_albedo * outdoors.ground
    return GLAZING[window.glazing] * (outdoors.sky + ground) / (2 * np.pi)


def glass_area(window: Window) -> float:
    """Glass of a window, without its frame [m²]."""
    return (1.0 - FRAME_SHARE) * window.width * window.height


def _sunlit(plan: FloorPlan, window: Window, outdoors: Daylight) -> float:
    """Area of the sun's beam that gets through a window, across the beam [m²]: the reveal cuts slanting light."""
    wall = plan.wall_named(window.wall)
    frame = Frame.of(wall)
    beam = sun_direction(outdoors, plan.place.x_azimuth)
    inward = float(beam[:2] @ frame.inward)
    if inward <= 0.0 or outdoors.direct == 0.0:
        return 0.0
    sideways = wall.thickness * abs(float(beam[:2] @ frame.along)) / inward
    downward = wall.thickness * abs(float(beam[2])) / inward
    opening = max(0.0, window.width - sideways) * max(0.0, window.height - downward)
    return (1.0 - FRAME_SHARE) * opening * inward


def _surfaces(plan: FloorPlan) -> tuple[float, float]:
    """Area of the room's inner surfaces [m²] and their mean albedo; a window reflects nothing back."""
    level = floor_area(plan)
    glass = sum(w.width * w.height for w in plan.window)
    parts = [(level, plan.material[plan.floor.material].albedo), (level, plan.material[plan.ceiling.material].albedo)]
    parts += [(w.length * plan.ceiling.height, plan.material[w.material].albedo) for w in plan.wall]
    parts.append((-glass, plan.material[plan.wall[0].material].albedo))
    area = sum(a for a, _ in parts) + glass
    return area, sum(a * albedo for a, albedo in parts) / area
