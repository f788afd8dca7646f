"""Daylight: position of the sun, illuminance of sun and sky.

The illuminance formulas are the daylight availability model of the IES Lighting Handbook (DiLaura), with its
constants for clear and overcast skies: common knowledge, not looked up again (tag M).
"""

import datetime
from dataclasses import dataclass
from zoneinfo import ZoneInfo

import numpy as np
from astral import Observer
from astral import sun as astral_sun

from refseq_bench.worlds.arrays import Floats
from refseq_bench.worlds.plans.schema import Place

SOLAR_CONSTANT = 127_500.0
"""Illuminance of the sun above the air, yearly mean [lx]."""
NIGHT_SKY = 0.1
"""Illuminance of a town's sky on level ground after dusk [lx]; a choice."""
DUSK = 3.4
"""Illuminance at the end of civil dusk, the sun 6° below the horizon [lx] (facts: teckxpert)."""
DARK = 50.0
"""Under a sky that gives less than this [lx] windows and street lamps show as lights; a choice."""

CLEAR_EXTINCTION = 0.21
"""Optical depth of clear air for direct sun, one air mass."""
CLEAR_SKY, OVERCAST_SKY = (800.0, 15_500.0, 0.5), (300.0, 21_000.0, 1.0)
"""A, B [lx] and C of a sky's horizontal illuminance A + B sin^C(elevation)."""


@dataclass(frozen=True, slots=True)
class Daylight:
    """Light outdoors at one moment; angles in [rad], illuminances in [lx].

    ``azimuth`` is a compass bearing (clockwise from north); ``direct`` falls on a surface that faces the sun, ``sky``
    on level ground from the sky alone; ``cloud`` is the share of the sky under clouds.
    """

    elevation: float
    azimuth: float
    direct: float
    sky: float
    cloud: float = 0.0

    @property
    def ground(self) -> float:
        """Sun and sky on level ground [lx]."""
        return self.sky + self.direct * max(0.0, float(np.sin(self.elevation)))

    @property
    def night(self) -> bool:
        """Tell whether what is outside is drawn as by night."""
        return self.sky < DARK


def daylight(place: Place, date: datetime.date, hour: float, cloud: float = 0.0) -> Daylight:
    """Compute the light at ``hour`` (0..24, local clock time) of ``date`` under a share ``cloud`` of clouds (0..1).

    Between the handbook's clear and overcast skies the light is mixed in proportion, as its mean over a while would
    be: a choice. Real clouds cover the sun or do not.
    """
    elevation, azimuth = sun_position(place, date, hour)
    clear, overcast = _sky(elevation, CLEAR_SKY), _sky(elevation, OVERCAST_SKY)
    direct = (1.0 - cloud) * _direct(elevation, date)
    return Daylight(elevation, azimuth, direct, (1.0 - cloud) * clear + cloud * overcast, cloud)


def sun_position(place: Place, date: datetime.date, hour: float) -> tuple[float, float]:
    """Return elevation (with refraction) and compass azimuth of the sun [rad], by ``astral``."""
    midnight = datetime.datetime.combine(date, datetime.time(), tzinfo=ZoneInfo(place.timezone))
    moment = midnight + datetime.timedelta(hours=hour)
    observer = Observer(place.latitude, place.longitude)
    elevation = astral_sun.elevation(observer, moment)
    return float(np.radians(elevation)), float(np.radians(astral_sun.azimuth(observer, moment)))


def sun_direction(light: Daylight, x_azimuth: float) -> Floats:
    """Return the unit vector from the sun to the world, (3,); ``x_azimuth`` [deg] as in the plan."""
    bearing = np.radians(x_azimuth) - light.azimuth
    level = np.cos(light.elevation)
    return -np.array([level * np.cos(bearing), level * np.sin(bearing), np.sin(light.elevation)])


def _direct(elevation: float, date: datetime.date) -> float:
    """E = E0 (1 + 0.034 cos(2π (J − 2) / 365)) exp(−c m), air mass m = 1 / sin(elevation)."""
    if elevation <= 0.0:
        return 0.0
    day = date.timetuple().tm_yday
    above_air = SOLAR_CONSTANT * (1.0 + 0.034 * np.cos(2 * np.pi * (day - 2) / 365))
    return float(above_air * np.exp(-CLEAR_EXTINCTION / np.sin(elevation)))


def _sky(elevation: float, terms: tuple[float, float, float]) -> float:
    """IES sky by day; below the horizon an exponential through ``DUSK`` at −6°, down to ``NIGHT_SKY``."""
    a, b, c = terms
    if elevation > 0.0:
        return float(a + b * np.sin(elevation) ** c)
    decay = np.log(a / DUSK) / np.radians(6.0)
    return float(max(NIGHT_SKY, a * np.exp(decay * elevation)))
