import dataclasses
import datetime

import numpy as np
import pytest

from refseq_bench.worlds.lighting.daylight import daylight, sun_direction, sun_position
from refseq_bench.worlds.plans.schema import Place

SUMMER, AUTUMN = datetime.date(2008, 6, 15), datetime.date(2008, 11, 15)
TABLE_PLACE = Place(latitude=40.2, longitude=-8.4, timezone="Europe/Lisbon", date=SUMMER, x_azimuth=0.0)


@pytest.mark.parametrize(
    ("date", "hour", "elevation", "azimuth"),
    [
        (SUMMER, 9, 30.8, 84.3),
        (SUMMER, 16, 55.0, 252.3),
        (SUMMER, 20, 10.2, 292.0),
        (AUTUMN, 9, 15.4, 131.6),
        (AUTUMN, 16, 11.8, 232.9),
        (AUTUMN, 17, 2.1, 243.4),
    ],
)
def test_the_sun_stands_where_the_almanac_has_it(
    date: datetime.date, hour: float, elevation: float, azimuth: float
) -> None:
    # The figures are for Coimbra, a year apart at most: refraction and the leap year move them by under 0.5°.
    found = np.degrees(sun_position(TABLE_PLACE, date, hour))
    np.testing.assert_allclose(found, [elevation, azimuth], atol=0.5)


def test_sun_in_the_east_shines_west() -> None:
    light = dataclasses.replace(daylight(TABLE_PLACE, SUMMER, 9), elevation=0.0, azimuth=np.pi / 2)
    # x points north, so y (to its left) points west.
    np.testing.assert_allclose(sun_direction(light, x_azimuth=0.0), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(sun_direction(light, x_azimuth=90.0), [-1, 0, 0], atol=1e-12)


def test_daylight_is_of_the_size_that_is_measured() -> None:
    noon = daylight(TABLE_PLACE, SUMMER, 13.5)
    assert 95e3 < noon.direct < 103e3
    assert 10e3 < noon.sky < 25e3
    assert daylight(TABLE_PLACE, SUMMER, 13.5, cloud=1.0).direct == 0.0


@pytest.mark.parametrize("hour", [9.0, 13.5, 19.0])
def test_the_sky_gives_what_the_handbook_says_and_half_a_cloud_the_mean(hour: float) -> None:
    """Level ground gets 800 + 15 500 √sin γ of a clear sky and 300 + 21 000 sin γ of an overcast one [lx]."""
    clear, half, overcast = (daylight(TABLE_PLACE, SUMMER, hour, cloud) for cloud in (0.0, 0.5, 1.0))
    height = np.sin(clear.elevation)
    assert clear.sky == pytest.approx(800.0 + 15_500.0 * np.sqrt(height))
    assert overcast.sky == pytest.approx(300.0 + 21_000.0 * height)
    assert half.sky == pytest.approx((clear.sky + overcast.sky) / 2)
    assert half.direct == pytest.approx(clear.direct / 2)


def test_direct_sun_fades_with_the_air_that_it_passes() -> None:
    # Beer and Lambert: ln E falls by the optical depth of one air mass times 1 / sin(elevation).
    hours = np.arange(8.0, 13.0)
    lights = [daylight(TABLE_PLACE, SUMMER, hour) for hour in hours]
    air = np.array([1.0 / np.sin(light.elevation) for light in lights])
    depth, above_air = np.polyfit(air, np.log([light.direct for light in lights]), 1)
    assert depth == pytest.approx(-0.21)
    assert np.exp(above_air) == pytest.approx(127_500, rel=0.035)  # the Earth's distance changes through the year


def test_the_sun_is_strongest_when_the_earth_is_nearest_to_it() -> None:
    # In January the Earth is 3.4 % nearer than in July: above the air the sun is (1.034 / 0.966) times as strong.
    def above_air(month: int, day: int) -> float:
        light = daylight(TABLE_PLACE, datetime.date(2009, month, day), 13)
        return light.direct * np.exp(0.21 / np.sin(light.elevation))

    assert above_air(1, 2) / above_air(7, 4) == pytest.approx(1.034 / 0.966, rel=1e-3)


def test_daylight_only_falls_through_dusk_into_the_night() -> None:
    hours = np.arange(13.5, 24.0, 0.25)
    ground = np.array([daylight(TABLE_PLACE, AUTUMN, h).ground for h in hours])
    assert (np.diff(ground) <= 0).all()
    assert daylight(TABLE_PLACE, AUTUMN, 17 + 47 / 60).ground == pytest.approx(3.4, rel=0.35)
