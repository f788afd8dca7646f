import dataclasses
import datetime

import mujoco
import numpy as np
import pytest

from worlds.areas import floor_area
from worlds.build import World, build
from worlds.daylight import daylight, sun_direction, sun_position
from worlds.errors import LightError
from worlds.light import Lamps, LightSetting, light_named, light_names
from worlds.meter import illuminance
from worlds.photometry import photometry, transmission, window_luminance
from worlds.plan import load_plan, parse_plan
from worlds.schema import Place

PLAN = load_plan("hallway")
SUMMER, AUTUMN = datetime.date(2008, 6, 15), datetime.date(2008, 11, 15)
TABLE_PLACE = Place(latitude=40.2, longitude=-8.4, timezone="Europe/Lisbon", date=SUMMER, x_azimuth=0.0)
UP, TO_RIGHT = (0, 0, 1), (0, -1, 0)


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
    assert 32e3 < noon.direct < 100e3 + 15e3
    assert 10e3 < noon.sky < 25e3
    assert daylight(TABLE_PLACE, SUMMER, 13.5, cloud=1.0).direct == 0.0


def test_daylight_only_falls_through_dusk_into_the_night() -> None:
    hours = np.arange(13.5, 24.0, 0.25)
    ground = np.array([daylight(TABLE_PLACE, AUTUMN, h).ground for h in hours])
    assert (np.diff(ground) <= 0).all()
    assert daylight(TABLE_PLACE, AUTUMN, 17 + 47 / 60).ground == pytest.approx(3.4, rel=0.35)


FORM = "HH:MM with any of cloud=0..1, lamps=auto|on|off, date=YYYY-MM-DD after it, commas between"


@pytest.mark.parametrize(
    ("text", "setting"),
    [
        ("17:45", LightSetting("17:45", 17.75)),
        ("late-evening", LightSetting("late-evening", 21.5)),
        ("overcast,lamps=on", LightSetting("overcast,lamps=on", 13.0, cloud=1.0, lamps=Lamps.ON)),
        (
            "6:00,cloud=0.5,lamps=off,date=2008-06-15",
            LightSetting("6:00,cloud=0.5,lamps=off,date=2008-06-15", 6.0, 0.5, Lamps.OFF, SUMMER),
        ),
    ],
)
def test_any_hour_is_a_light(text: str, setting: LightSetting) -> None:
    assert light_named(text) == setting


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("dusk", f"unknown light 'dusk'; known are morning, noon, 16:00, 18:00, overcast, late-evening, or {FORM}"),
        ("24:30", f"unknown light '24:30'; known are morning, noon, 16:00, 18:00, overcast, late-evening, or {FORM}"),
        ("12:00,fog=1", f"light '12:00,fog=1': unknown option 'fog=1'; valid is {FORM}"),
        ("12:00,cloud=2", "light '12:00,cloud=2': cloud '2' is not valid; it should be a share from 0 to 1"),
        ("12:00,cloud=nan", "light '12:00,cloud=nan': cloud 'nan' is not valid; it should be a share from 0 to 1"),
        ("noon,lamps=dim", "light 'noon,lamps=dim': lamps 'dim' is not valid; it should be auto, on or off"),
        (
            "noon,date=1 May",
            "light 'noon,date=1 May': date '1 May' is not valid; it should be a day such as 2008-06-15",
        ),
    ],
)
def test_what_is_no_light(text: str, message: str) -> None:
    with pytest.raises(LightError) as caught:
        light_named(text)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("light", "point", "normal", "lowest", "highest"),
    [
        ("16:00", (20, 1.2, 1.3), TO_RIGHT, 1000, 4000),
        ("18:00", (20, 1.2, 1.3), TO_RIGHT, 300, 1500),
        ("late-evening", (30, 0, 0), UP, 60, 150),
        ("late-evening", (32, 0, 0), UP, 60, 150),
        ("late-evening", (20, 1.2, 1.3), TO_RIGHT, 30, 120),
    ],
)
def test_illuminance_is_of_the_size_that_standards_and_meters_give(
    light: str, point: tuple[float, ...], normal: tuple[float, ...], lowest: float, highest: float
) -> None:
    assert lowest < illuminance(PLAN, light_named(light), point, normal) < highest


def test_by_a_window_it_is_brighter_than_between_windows() -> None:
    day = light_named("16:00")
    window, blank = (illuminance(PLAN, day, (x, 1.2, 1.3), TO_RIGHT) for x in (20.0, 33.5))
    assert window > 1.3 * blank


def test_light_between_the_walls_is_what_the_room_absorbs() -> None:
    # Energy: all surfaces take in (1 − ρ) of what falls on them. Lamps only, so that all flux is diffuse.
    numbers = photometry(PLAN, light_named("late-evening"))
    falling = numbers.lamp_flux + numbers.indirect * numbers.area
    taken = (1 - numbers.albedo) * falling
    assert taken == pytest.approx(numbers.lamp_flux, rel=0.01)


def test_the_floor_is_what_lies_between_the_walls() -> None:
    from tests.worlds.conftest import SMALL, corner

    assert floor_area(PLAN) == 100 * 2.4
    for x in (0.0, 100.0):
        assert floor_area(parse_plan(corner(x, length=6, depth=5))) == pytest.approx(6 * 2 + 2 * 4)
    open_at_both_ends = parse_plan(SMALL.format(top="", end=""))
    assert floor_area(open_at_both_ends) == pytest.approx(8 * 2.4)


def test_lamps_off_at_night_is_dark() -> None:
    dark = light_named("23:00,lamps=off")
    assert illuminance(PLAN, dark, (30, 0, 0), UP) < 0.1


def lights(world: World) -> dict[str, mujoco.MjsLight]:
    return {light.name: light for light in world.spec.lights}


def test_only_the_sun_casts_shadows(hallway: World) -> None:
    assert [n for n, light in lights(hallway).items() if light.castshadow] == ["sun"]


def test_intensities_are_photometric(hallway: World) -> None:
    found, numbers = lights(hallway), hallway.photometry
    sun = found["sun"]
    assert sun.intensity * sun.diffuse[0] == pytest.approx(transmission(PLAN) * numbers.outdoors.direct)
    window = found["window_w01"]
    candela = window_luminance(PLAN, PLAN.window[0], numbers.outdoors) * 0.85 * 2.0 * 1.5
    assert window.intensity * window.diffuse[0] == pytest.approx(candela, rel=1e-5)
    assert found["between_walls"].intensity * np.pi == pytest.approx(numbers.indirect, rel=1e-5)


def test_the_evening_has_lamps_and_no_sun() -> None:
    small = PLAN.model_copy(update={"poster": (), "board": (), "window": PLAN.window[:2]})
    found = lights(build(small, light_named("late-evening"), seed=0))
    assert "sun" not in found
    assert sum(n.startswith("lamp_") for n in found) == 25


@pytest.mark.parametrize("name", light_names())
def test_lamps_burn_when_it_is_dark_outside(name: str) -> None:
    assert bool(photometry(PLAN, light_named(name)).burning) == (name == "late-evening")


def test_lamps_obey_their_switches() -> None:
    always = PLAN.model_copy(update={"lamp": (PLAN.lamp[0].model_copy(update={"switch": "always"}),)})
    assert photometry(always, light_named("noon")).burning == ("row",)
    assert photometry(always, light_named("late-evening,lamps=off")).burning == ()
    assert photometry(PLAN, light_named("noon,lamps=on")).burning == ("row",)


def test_a_plan_without_windows_is_dark_by_day() -> None:
    from tests.worlds.conftest import SMALL

    plan = parse_plan(SMALL.format(top="", end=""))
    assert photometry(plan, light_named("16:00")).indirect == 0.0
