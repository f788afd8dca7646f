import dataclasses

import numpy as np
import pytest

from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.daylight import Daylight, sun_direction
from refseq_bench.worlds.lighting.photometry import FRAME_SHARE, GLAZING, photometry
from refseq_bench.worlds.lighting.radiosity import (
    Interior,
    exchange,
    lay_patches,
    light_up,
    solve,
    sun_on_faces,
)
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan
from tests.worlds.conftest import SMALL, box

LAMP = '[[lamp]]\nname = "one"\nfirst = [3, 0]\nstep = [1, 0]\ncount = 1\nsize = [0.1, 0.1]\nlumen = 1000'
WINDOW = '[[window]]\nname = "w"\nwall = "right"\nat = 3'
NIGHT = light_named("23:00,lamps=on")


def lit(plan: FloorPlan, light: str) -> Interior:
    return light_up(plan, photometry(plan, light_named(light)))


def flux(interior: Interior, lux: np.ndarray) -> float:
    return float(interior.patches.faces.areas @ lux)


@pytest.mark.parametrize("albedo", [0.1, 0.5, 0.9])
def test_a_closed_box_is_an_integrating_sphere(albedo: float) -> None:
    # Mean irradiance Φ / (A (1 - ρ)) for a source of flux Φ.
    room = lit(parse_plan(box(6, 5, albedo, LAMP)), "23:00,lamps=on")
    area = room.patches.faces.areas.sum()
    assert area == pytest.approx(2 * (6 * 5 + 6 * 2.8 + 5 * 2.8))
    falling = flux(room, room.exitance[:, 0] / albedo) / area
    assert falling == pytest.approx(1000 / (area * (1 - albedo)), rel=0.01)


@pytest.mark.quick_cases("16:00-hallway", "late-evening-annex")
@pytest.mark.parametrize("world", ["hallway", "annex"])
@pytest.mark.parametrize("light", ["16:00", "18:00", "late-evening"])
def test_what_the_sources_give_is_what_the_surfaces_take_in(world: str, light: str) -> None:
    room = lit(load_plan(world), light)
    albedo = room.patches.albedo
    taken = flux(room, room.exitance[:, 0] / albedo * (1 - albedo))
    assert taken == pytest.approx(flux(room, room.direct[:, 0]), rel=1e-3)


def test_all_light_of_windows_and_lamps_falls_somewhere() -> None:
    plan = load_plan("hallway")
    numbers = photometry(plan, light_named("overcast,lamps=on"))
    room = light_up(plan, numbers)
    outside = numbers.outdoors.sky + plan.place.ground_albedo * numbers.outdoors.ground
    window = (1 - FRAME_SHARE) * sum(GLAZING[w.glazing] * w.width * w.height for w in plan.window) * outside / 2
    assert flux(room, room.direct[:, 0]) == pytest.approx(window + 25 * 1000, rel=0.01)


def test_all_sun_that_passes_the_reveals_falls_somewhere() -> None:
    plan = parse_plan(box(6, 5, end=WINDOW))
    outdoors = Daylight(np.radians(30), np.radians(110 + 90 - 20), 50_000.0, 10_000.0)
    beam = sun_direction(outdoors, plan.place.x_azimuth)
    assert beam[1] > 0.5  # in through the right wall
    faces = lay_patches(plan).faces
    # A beam across an opening of depth t is as wide as the opening less t tan(angle), each way.
    opening = (2.0 - 0.3 * abs(beam[0]) / beam[1]) * (1.5 - 0.3 * abs(beam[2]) / beam[1]) * beam[1]
    expected = (1 - FRAME_SHARE) * GLAZING["double"] * 50_000 * opening
    assert faces.areas @ sun_on_faces(plan, faces, outdoors) == pytest.approx(expected, rel=0.1)


def test_in_a_black_room_there_is_only_direct_light() -> None:
    plan = parse_plan(box(6, 5, 0.0, LAMP))
    assert Meter(plan, NIGHT).read((3, 0, 0)).indirect == 0.0
    assert Meter(plan, NIGHT).read((3, 0, 0)).lamps > 10.0


def test_an_open_end_lets_light_out() -> None:
    end = LAMP.replace("[3, 0]", "[4, 0]")
    sealed, gaping = parse_plan(box(8, 2.4, 0.7, end)), parse_plan(SMALL.format(top="", end=end))
    inside, half_out = (Meter(plan, NIGHT).read((4, 0, 0)) for plan in (sealed, gaping))
    assert half_out.lamps == pytest.approx(inside.lamps)
    assert half_out.indirect < 0.95 * inside.indirect


def test_form_factors_are_the_same_both_ways_and_leave_nothing_out() -> None:
    plan = load_plan("annex")
    faces = lay_patches(plan).faces
    between = exchange(faces, plan)
    np.testing.assert_allclose(between.sum(axis=1), 1.0, atol=1e-5)
    sent = between.multiply(faces.areas[:, None]).tocsr()
    assert abs(sent - sent.T).max() < 1e-12


def test_solution_is_that_of_the_linear_system() -> None:
    plan = parse_plan(box(4, 3, 0.8, LAMP))
    room = lit(plan, "23:00,lamps=on")
    between = exchange(room.patches.faces, plan).toarray()
    rho = room.patches.albedo
    exact = np.linalg.solve(np.eye(len(rho)) - rho[:, None] * between, rho[:, None] * room.direct)
    np.testing.assert_allclose(room.exitance, exact, rtol=1e-3)


def test_walls_that_take_in_nothing_still_get_an_answer() -> None:
    plan = parse_plan(box(3, 3))
    faces = lay_patches(plan).faces
    found = solve(np.ones(len(faces)), np.ones((len(faces), 1)), exchange(faces, plan))
    assert np.isfinite(found).all()


def test_a_dead_end_without_windows_gets_darker_and_darker() -> None:
    plan = load_plan("annex")
    lamps_off = dataclasses.replace(light_named("16:00,lamps=off"))
    meter = Meter(plan, lamps_off)
    up = [meter.read((34, y, 0)).total for y in np.arange(3, 42, 2.0)]
    assert (np.diff(up) < 0).all()
    assert up[0] > 50 * up[9] > 0.0


def test_a_symmetric_room_is_lit_symmetrically() -> None:
    meter = Meter(parse_plan(box(6, 4, end=LAMP)), NIGHT)
    here = meter.read((1.2, 0.7, 0.4), (0.6, 0, 0.8)).total
    for mirrored in (((1.2, -0.7, 0.4), (0.6, 0, 0.8)), ((4.8, 0.7, 0.4), (-0.6, 0, 0.8))):
        assert meter.read(*mirrored).total == pytest.approx(here, rel=1e-6)


def test_patches_take_the_albedo_of_doors_and_windows_by_area() -> None:
    plan = parse_plan(
        box(6, 5, 0.7, f'{WINDOW}\n[[door]]\nname = "d"\nwall = "left"\nat = 2.5\n').replace(
            "[material]", "[material]\ndoor = { albedo = 0.2, roughness = 0.5 }"
        )
    )
    patches = lay_patches(plan)
    reflecting = patches.faces.areas @ patches.albedo
    bare = 0.7 * patches.faces.areas.sum()
    of_window = 0.15 * 0.6  # the share of its frame, and the frame's albedo
    assert reflecting == pytest.approx(bare - 3.0 * (0.7 - of_window) - 0.9 * 2.05 * (0.7 - 0.2))
