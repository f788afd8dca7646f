import numpy as np
import pytest

from refseq_bench.worlds.light import light_named, light_names
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.photometry import (
    GLAZING,
    LAMP_DEPTH,
    REACH,
    glass_area,
    outlook,
    photometry,
    sources,
    spot_illuminance,
    spots,
    transmission,
    window_luminance,
)
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import Post
from tests.worlds.conftest import box

PLAN = load_plan("hallway")


@pytest.mark.parametrize("name", light_names())
def test_lamps_burn_when_it_is_dark_outside(name: str) -> None:
    assert bool(photometry(PLAN, light_named(name)).lit_rows) == (name == "late-evening")


def test_lamps_obey_their_switches() -> None:
    always = PLAN.model_copy(update={"lamp": (PLAN.lamp[0].model_copy(update={"switch": "always"}),)})
    assert photometry(always, light_named("noon")).lit_rows == always.lamp
    assert photometry(always, light_named("late-evening,lamps=off")).lit_rows == ()
    assert photometry(PLAN, light_named("noon,lamps=on")).lit_rows == PLAN.lamp


def test_a_post_and_a_row_of_lamps_of_one_name_have_a_switch_each() -> None:
    post = Post(name="row", at=(0.0, 0.0), switch="always")
    numbers = photometry(PLAN.model_copy(update={"post": (post,)}), light_named("noon"))
    assert (numbers.lit_rows, numbers.lit_posts) == ((), (post,))
    assert not any(spot.kind == "lamp" for spot in spots(PLAN, numbers))


def test_each_window_has_its_own_glass() -> None:
    one, two = PLAN.window[0], PLAN.window[1].model_copy(update={"glazing": "4mm", "width": 1.0})
    plan = PLAN.model_copy(update={"window": (one, two)})
    assert transmission(plan) == pytest.approx((2 * GLAZING["double"] + 1 * GLAZING["4mm"]) / 3)
    lit = sources(plan, photometry(plan, light_named("16:00")))
    assert lit.above[1] / lit.above[0] == pytest.approx(GLAZING["4mm"] / GLAZING["double"])


def test_sources_look_into_the_room_with_their_own_size() -> None:
    lit = sources(PLAN, photometry(PLAN, light_named("late-evening")))
    np.testing.assert_allclose(lit.windows.normals, np.tile([0, 1, 0], (17, 1)), atol=1e-12)
    np.testing.assert_allclose(lit.windows.areas, 3.0)
    np.testing.assert_allclose(lit.lamps.normals, np.tile([0, 0, -1], (25, 1)), atol=1e-12)
    np.testing.assert_allclose(lit.lamps.centres[3], [14, 0, 2.8 - LAMP_DEPTH])
    flux = np.pi * lit.lamp_luminances[:, 0] * lit.lamps.areas
    np.testing.assert_allclose(flux, 1000)


def test_a_camera_gets_more_from_warm_lamps() -> None:
    warm = PLAN.model_copy(update={"lamp": (PLAN.lamp[0].model_copy(update={"kelvin": 2700.0}),)})
    evening = light_named("late-evening")
    lumens, gathered = sources(warm, photometry(warm, evening)).lamp_luminances[0]
    assert gathered / lumens == camera_weight(2700.0) > 1.1
    lamps = ([s for s in spots(p, photometry(p, evening)) if s.kind == "lamp"] for p in (PLAN, warm))
    (plain, *_), (weighted, *_) = lamps
    assert weighted.candela / plain.candela == pytest.approx(camera_weight(2700.0) / camera_weight(4000.0))


def test_a_windows_spot_leans_to_where_its_light_goes() -> None:
    # Under clouds the sky is brighter than the ground: more goes down. Checked against the sum over all directions.
    numbers = photometry(PLAN, light_named("overcast"))
    sky, ground = outlook(PLAN, numbers.outdoors)
    assert sky > 4 * ground
    rng = np.random.default_rng(0)
    rays = rng.standard_normal((200_000, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    rays[:, 1] = np.abs(rays[:, 1])
    weight = rays[:, 1] * np.where(rays[:, 2] < 0, sky, ground)
    mean = weight @ rays
    np.testing.assert_allclose(spots(PLAN, numbers)[0].axis, mean / np.linalg.norm(mean), atol=0.01)


def test_spots_follow_the_inverse_square_up_to_their_reach() -> None:
    numbers = photometry(PLAN, light_named("late-evening"))
    lamp = next(s for s in spots(PLAN, numbers) if s.kind == "lamp")
    points = lamp.pos - np.array([[0, 0, 0.5], [0, 0, 1.0], [0, 0, REACH], [0, 0, 2 * REACH]])
    near, twice, end, beyond = spot_illuminance(lamp, points)[:, 2]
    assert near == pytest.approx(4 * lamp.candela, rel=1e-4)
    assert twice == pytest.approx(lamp.candela, rel=1e-3)
    assert end == beyond == 0.0


def test_a_window_shows_half_sky_and_half_ground() -> None:
    plan = parse_plan(box(6, 5, end='[[window]]\nname = "w"\nwall = "right"\nat = 3\nglazing = "6mm"'))
    outdoors = photometry(plan, light_named("16:00")).outdoors
    expected = 0.87 * (outdoors.sky + 0.2 * outdoors.ground) / (2 * np.pi)
    assert window_luminance(plan, plan.window[0], outdoors) == pytest.approx(expected)
    assert glass_area(plan.window[0]) == pytest.approx(0.85 * 3.0)
