"""What light is asked for, and how much of it arrives indoors: the photometry of a plan at a date and hour.

Daylight comes in through the windows, lamps add theirs, and what they all leave after one reflection is spread evenly
over the room's surfaces (split flux: E = Φ ρ / (A (1 − ρ)), as in the integrating sphere).
"""

import datetime
from collections import Counter
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from worlds.daylight import Daylight, Sky, daylight, sun_direction
from worlds.errors import LightError
from worlds.frame import Frame
from worlds.schema import FloorPlan, Window

GLAZING = 0.76
"""Share of light that double glazing lets through (facts: ESP-r)."""
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
class LightSetting:
    """Light as it is asked for: local clock ``hour`` (0..24), whether lamps are on, the sky; no date: the plan's."""

    name: str
    hour: float
    lamps: bool
    sky: Sky = Sky.CLEAR
    date: datetime.date | None = None


PRESETS = MappingProxyType(
    {
        "16:00": LightSetting("16:00", 16.0, lamps=False),
        "18:00": LightSetting("18:00", 18.0, lamps=False),
        "late-evening": LightSetting("late-evening", 21.5, lamps=True),
    }
)


def light_names() -> tuple[str, ...]:
    """Return the names of the lights that can be asked for."""
    return tuple(PRESETS)


def light_named(name: str) -> LightSetting:
    """Return a light by its name; raises ``LightError`` with the valid names."""
    if name not in PRESETS:
        raise LightError(f"unknown light '{name}'; known are {', '.join(PRESETS)}")
    return PRESETS[name]


@dataclass(frozen=True, slots=True)
class Photometry:
    """Light in one plan: luminances [cd/m²], intensities [cd], fluxes [lm], illuminances [lx], areas [m²].

    ``window_luminance`` is that of the glazing as the room sees it, mean of sky and ground; ``sky_luminance`` that of
    the sky behind glass. ``sun`` is the illuminance of sunlight behind glass on a surface that faces it. ``indirect``
    reaches every surface from all sides.
    """

    outdoors: Daylight
    sun: float
    sky_luminance: float
    window_luminance: float
    window_flux: float
    sun_flux: float
    lamp_flux: float
    area: float
    albedo: float
    indirect: float


def photometry(plan: FloorPlan, setting: LightSetting) -> Photometry:
    """Work out all the light in ``plan`` under ``setting``."""
    outdoors = daylight(plan.place, setting.date or plan.place.date, setting.hour, setting.sky)
    sky = GLAZING * outdoors.sky / np.pi
    ground = GLAZING * plan.place.ground_albedo * outdoors.ground / np.pi
    through = (sky + ground) / 2  # a vertical pane sees half sky, half ground
    window_flux = np.pi * through * sum(glass_area(w) for w in plan.window)
    sun_flux = GLAZING * outdoors.direct * sum(_sunlit(plan, w, outdoors) for w in plan.window)
    lamp_flux = sum(row.count * row.lumen for row in plan.lamp) if setting.lamps else 0.0
    area, albedo = _surfaces(plan)
    floor = plan.material[plan.floor.material].albedo  # a high sun falls on the floor first
    first_bounce = ((window_flux + lamp_flux) * albedo + sun_flux * floor) / (area * (1.0 - albedo))
    beyond_lobe = (1.0 - LOBE) * window_flux / area  # what the windows' spot lights leave out at flat angles
    return Photometry(
        outdoors=outdoors,
        sun=GLAZING * outdoors.direct,
        sky_luminance=sky,
        window_luminance=through,
        window_flux=window_flux,
        sun_flux=sun_flux,
        lamp_flux=lamp_flux,
        area=area,
        albedo=albedo,
        indirect=first_bounce + beyond_lobe,
    )


def glass_area(window: Window) -> float:
    """Glass of a window, without its frame [m²]."""
    return (1.0 - FRAME_SHARE) * window.width * window.height


def floor_area(plan: FloorPlan) -> float:
    """Return the area between the walls [m²]: A = -1/2 Σ length · (middle · inward), Gauss' theorem in the plane.

    Where the walls leave a gap, it is the area of the smallest rectangle around them.
    """
    corners = Counter(corner for wall in plan.wall for corner in (wall.start, wall.end))
    if any(walls != 2 for walls in corners.values()):
        low, high = plan.bounds
        return float(np.prod(high - low))
    return -sum(w.length * float(np.add(w.start, w.end) @ Frame.of(w).inward) for w in plan.wall) / 4


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
