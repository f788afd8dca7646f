import numpy as np
import pytest

from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.daylight import sun_direction
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.photometry import FRAME_SHARE, GLAZING, photometry
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from tests.worlds.conftest import SMALL, box, in_the_open

PLAN = load_plan("hallway")
UP, DOWN, TO_RIGHT = (0, 0, 1), (0, 0, -1), (0, -1, 0)
DAY = light_named("16:00")


@pytest.fixture(scope="module")
def day() -> Meter:
    return Meter(PLAN, DAY)


@pytest.fixture(scope="module")
def evening() -> Meter:
    return Meter(PLAN, light_named("late-evening"))


@pytest.mark.parametrize(
    ("point", "normal", "lowest", "highest"),
    [((20, 1.2, 1.3), TO_RIGHT, 1000, 4000), ((33.5, 1.2, 1.3), TO_RIGHT, 150, 1200), ((20, 0, 0), UP, 1000, 4000)],
)
def test_daylight_is_of_the_size_that_meters_give(
    day: Meter, point: tuple[float, ...], normal: tuple[float, ...], lowest: float, highest: float
) -> None:
    # 2000 lx by a window on a clear day, 300 far from it (facts: IESVE), within a factor of 2 and 4.
    reading = day.read(point, normal)
    assert lowest < reading.total - reading.sun < highest


@pytest.mark.parametrize(
    ("point", "normal", "standard"), [((30, 0, 0), UP, 100), ((30, 1.2, 1.3), TO_RIGHT, 75), ((30, 0.5, 2.8), DOWN, 50)]
)
def test_lamps_give_about_what_the_standard_asks_for(
    evening: Meter, point: tuple[float, ...], normal: tuple[float, ...], standard: float
) -> None:
    assert standard / 2 < evening.read(point, normal).total < 1.5 * standard


def test_by_a_window_it_is_brighter_than_between_windows(day: Meter) -> None:
    window, blank = (day.read((x, 1.2, 1.3), TO_RIGHT) for x in (20.0, 33.5))
    assert window.sky > 5 * blank.sky
    assert window.total > 2 * blank.total


def test_light_of_a_window_is_that_of_a_luminous_rectangle() -> None:
    # A card opposite the middle of the glass: four quarters, each by Howell's configuration B-3.
    plan = parse_plan(box(6, 5, 0.0, '[[window]]\nname = "w"\nwall = "right"\nat = 3\nwidth = 2\nheight = 1.2'))
    outdoors = photometry(plan, DAY).outdoors
    x, y = 1.0 / 3.0, 0.6 / 3.0
    u, v = np.hypot(1, x), np.hypot(1, y)
    factor = 4 * (x / u * np.arctan(y / u) + y / v * np.arctan(x / v)) / (2 * np.pi)
    outside = (outdoors.sky + 0.2 * outdoors.ground) / 2
    reading = Meter(plan, DAY).read((3, 0.5, 1.5), (0, -1, 0))
    assert reading.sky == pytest.approx((1 - FRAME_SHARE) * GLAZING["double"] * outside * factor, rel=1e-9)


def test_what_looks_up_sees_the_sky_and_what_looks_down_the_ground() -> None:
    meter = Meter(PLAN, light_named("overcast"))
    outdoors = photometry(PLAN, light_named("overcast")).outdoors
    up, down = (meter.read((20, 0, 1.65), normal).sky for normal in (UP, DOWN))  # at half the window's height
    assert up / down == pytest.approx(outdoors.sky / (0.2 * outdoors.ground))


def test_a_lamp_far_off_follows_the_inverse_square() -> None:
    lamp = '[[lamp]]\nname = "l"\nfirst = [3, 0]\nstep = [1, 0]\ncount = 1\nsize = [0.2, 0.2]\nlumen = 1000'
    meter = Meter(parse_plan(box(6, 5, 0.0, lamp)), light_named("23:00,lamps=on"))
    for d in (1.0, 2.0):
        assert meter.read((3, 0, 2.74 - d)).lamps == pytest.approx(1000 / np.pi / d**2, rel=0.02)


def test_the_sun_is_only_in_its_patches(day: Meter) -> None:
    outdoors = photometry(PLAN, DAY).outdoors
    beam = sun_direction(outdoors, PLAN.place.x_azimuth)
    inward = beam / beam[1]
    window = PLAN.window[4]
    middle = np.array([PLAN.wall_named("right").start[0] + window.at, -1.2 - 0.15, window.sill + 0.75])
    lit = middle + inward * middle[2] / -inward[2]
    expected = GLAZING["double"] * outdoors.direct * -beam[2]
    assert day.read((*lit[:2], 0)).sun == pytest.approx(expected)
    assert day.read((*lit[:2], 0), -beam).sun == pytest.approx(GLAZING["double"] * outdoors.direct)
    assert day.read((*lit[:2], 0), DOWN).sun == 0.0
    assert day.read((33.5, 0, 0)).sun == 0.0


def test_readings_add_up_and_repeat(day: Meter) -> None:
    reading = day.read((12.5, 0, 1))
    assert reading == Meter(PLAN, DAY).read((12.5, 0, 1), (0, 0, 3))
    assert reading.total == reading.sun + reading.sky + reading.lamps + reading.indirect
    assert reading.lamps == 0.0


def test_a_camera_gathers_what_the_lamps_colour_gives() -> None:
    warm = PLAN.model_copy(update={"lamp": (PLAN.lamp[0].model_copy(update={"kelvin": 2700.0}),)})
    meter = Meter(warm, light_named("23:00,lamps=on"))
    card = Cards(np.array([[30.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
    assert meter.for_camera(card)[0] / meter.read((30, 0, 0)).total == pytest.approx(1.11, abs=0.01)


def test_at_night_without_lamps_it_is_dark() -> None:
    assert Meter(PLAN, light_named("23:00,lamps=off")).read((30, 0, 0), UP).total < 0.1


def test_without_windows_the_day_is_dark() -> None:
    assert Meter(parse_plan(SMALL.format(top="", end="")), DAY).read((4, 0, 0), UP).total == 0.0


def test_a_card_must_face_somewhere(day: Meter) -> None:
    with pytest.raises(WorldsError) as caught:
        day.read((1, 0, 0), (0, 0, 0))
    assert str(caught.value) == "normal (0, 0, 0) is not valid; it should be the direction that the card faces"


# --- in the open ---


def test_level_ground_in_the_open_gets_sun_and_sky() -> None:
    plan = parse_plan(in_the_open())
    outdoors = photometry(plan, DAY).outdoors
    up, down = (Meter(plan, DAY).read((0, 0, 0.5), normal) for normal in (UP, DOWN))
    assert up.total == pytest.approx(outdoors.ground)
    assert (down.sun, down.sky) == (0.0, 0.0)
    assert down.total == pytest.approx(0.2 * outdoors.ground)
    upright = Meter(plan, DAY).read((0, 0, 0.5), (1, 0, 0))
    assert upright.sky == pytest.approx(outdoors.sky / 2)


def test_under_a_street_lamp_its_light_follows_the_inverse_square() -> None:
    meter = Meter(parse_plan(in_the_open('[[post]]\nname = "p"\nat = [0, 0]')), light_named("23:00"))
    places = np.array([[x, 0.0, z] for x in np.arange(-3, 3, 0.05) for z in (0.0, 2.0)])
    low, high = (max(meter.read(p).lamps for p in places[k::2]) for k in (0, 1))
    assert high / low == pytest.approx((5.0 / 3.0) ** 2, rel=0.05)
    assert 10 < low < 400
