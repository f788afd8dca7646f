"""Light in the open against geometry, sums over the sphere, and Filament's pictures."""

from functools import cache

import mujoco
import numpy as np
import pytest

from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.sim.rendering.opening import open_renderer
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.colour import camera_weight
from refseq_bench.worlds.lighting.daylight import Daylight, sun_direction
from refseq_bench.worlds.lighting.open_air import (
    CONE,
    DOME_MATERIAL,
    FACE_SHARES,
    INNER,
    axial,
    face_luminances,
    head_of,
)
from refseq_bench.worlds.lighting.sky import elevations, sky
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan
from tests.worlds.conftest import in_the_open

YARD = """
[[wall]]
name = "north"
start = [-20, 15]
end = [20, 15]
inside = "right"
height = 4.0
material = "asphalt"
[[post]]
name = "p1"
at = [-15, -10]
height = 5.0
lumen = 6000
kelvin = 2700
"""
CARD = 3.0
"""Height of the cards [m]."""
SIDES = {"up": (0, 0, 1), "down": (0, 0, -1), "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0)}
POLE, UP = 2.0, (0, 0, 1)


@cache
def yard() -> FloorPlan:
    return parse_plan(in_the_open(YARD))


@cache
def lit(light: str) -> World:
    return build_world(yard(), light_named(light), seed=0)


def looking(spec: mujoco.MjSpec, name: str, pos: np.ndarray, along: np.ndarray, fovy: float) -> None:
    up = np.array([0.0, 1.0, 0.0]) if abs(along[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
    right = np.cross(along, up)
    spec.worldbody.add_camera(name=name, pos=pos, xyaxes=[*right, *np.cross(right, along)], fovy=fovy)


def pictures(spec: mujoco.MjSpec, size: tuple[int, int]) -> dict[str, np.ndarray]:
    """Luminance that each camera of a spec sees [cd/m²]."""
    prepare_spec(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with open_renderer("filament", model) as renderer:
        return {model.camera(i).name: renderer.radiance(data, model.camera(i).name, *size) for i in range(model.ncam)}


def card_luminances(world: World) -> dict[str, float]:
    """Luminance [cd/m²] of white cards that face all ways, out of the lamp's reach and of each other's shadow."""
    spec = world.spec.copy()
    spec.add_material(name="white", rgba=[1.0] * 4, roughness=1.0, metallic=0.0, specular=0.0)
    for i, (name, normal) in enumerate(SIDES.items()):
        quat = np.zeros(4)
        mujoco.mju_quatZ2Vec(quat, np.array(normal, dtype=float))
        pos = np.array([-10.0 + 5.0 * i, 0.0, CARD])
        spec.worldbody.add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=pos, quat=quat, size=[0.4, 0.4, 0.01], material="white"
        )
        looking(spec, f"at {name}", pos + 1.0 * np.array(normal), -np.array(normal, dtype=float), 10.0)
    return {name.removeprefix("at "): float(seen.mean()) for name, seen in pictures(spec, (32, 24)).items()}


@pytest.mark.quick_cases("13:00")
@pytest.mark.parametrize("light", ["13:00", "13:00,cloud=1", "17:30,cloud=0.4"])
def test_white_cards_that_face_all_ways_have_the_meters_luminance(light: str) -> None:
    seen = card_luminances(lit(light))
    for i, (name, normal) in enumerate(SIDES.items()):
        lux = Meter(yard(), light_named(light)).read((-10.0 + 5.0 * i, 0.0, CARD), normal).total
        assert seen[name] == pytest.approx(lux / np.pi, rel=0.05), name


@pytest.mark.parametrize(("above", "below"), [(1.0, 1.0), (1.0, 0.2), (1.0, 1.2), (3e-2, 6e-3), (1.0, 0.0)])
def test_image_lights_faces_give_what_two_halves_of_a_sphere_would(above: float, below: float) -> None:
    given = FACE_SHARES @ face_luminances(above, below)
    assert given == pytest.approx([above, (above + below) / 2, below], rel=0.05)
    assert (face_luminances(above, below) >= 0.0).all()


# --- how much ---


@pytest.mark.parametrize(
    ("light", "low", "high"),
    [
        ("13:00,date=2008-06-15", 32e3, 120e3),  # direct sun and daylight: 32 000 to 100 000 lx, and the sky
        ("13:00", 32e3, 100e3),
        ("13:00,cloud=1", 1e3, 25e3),  # overcast 1000, daylight without sun 10 000 to 25 000 lx
        ("18:45,lamps=off", 100, 2000),  # sunset, 400 lx
        ("19:12,lamps=off", 1.0, 20.0),  # end of civil dusk, 3.4 lx
        ("02:00,lamps=off", 0.05, 0.2),
    ],
)
def test_level_ground_gets_as_much_as_others_measured(light: str, low: float, high: float) -> None:
    assert low < Meter(yard(), light_named(light)).read((0, 0, 0), (0, 0, 1)).total < high


def test_a_card_in_the_shade_of_a_wall_gets_no_sun() -> None:
    light = light_named("20:00,date=2008-06-15")  # in the north-west, behind the wall
    assert Meter(yard(), light).read((0, 14, 0.5), UP).sun == 0.0
    assert Meter(yard(), light).read((0, 14, 4.5), UP).sun > 0.0


# --- the sky that is seen ---


@pytest.mark.parametrize(
    ("elevation", "cloud"), [(50.0, 0.0), (50.0, 1.0), (8.0, 0.5), (0.5, 0.0), (-4.0, 0.3), (-30.0, 0.0)]
)
def test_the_sky_in_the_picture_gives_the_skys_illuminance(elevation: float, cloud: float) -> None:
    light = Daylight(np.radians(elevation), 2.0, 0.0, 1234.0, cloud)
    field = sky((640, 256), light, 0.7, np.random.default_rng(1))
    rng = np.random.default_rng(0)
    # Directions as a level card sees them: uniform on the disc below the dome (Malley).
    height, azimuth = np.arccos(np.sqrt(rng.random(200_000))), rng.uniform(-np.pi, np.pi, 200_000)
    row = np.searchsorted(-elevations(256), -height).clip(0, 255)
    column = ((np.pi - azimuth) / (2 * np.pi) * 640).astype(int)
    assert np.pi * field[row, column].mean() == pytest.approx(1234.0, rel=0.02)


def test_the_clear_sky_is_brightest_around_the_sun_and_darkest_opposite() -> None:
    sun = np.radians(40.0)
    field = sky((360, 180), Daylight(np.radians(35.0), 0.0, 0.0, 1e4), sun, np.random.default_rng(0))
    row, column = np.unravel_index(np.argmax(field), field.shape)
    assert np.degrees(elevations(180)[row]) == pytest.approx(35.0, abs=8.0)
    assert 180 - column == pytest.approx(40.0, abs=8.0)
    band = field[np.searchsorted(-elevations(180), -np.radians(35.0))]
    assert abs(180 - int(np.argmin(band)) - 40) > 60


def test_the_dome_shows_the_sun_where_it_shines_from() -> None:
    world = lit("17:30,cloud=0.4")
    beam = sun_direction(world.photometry.outdoors, 70.0)
    spec = world.spec.copy()
    for k in range(12):
        along = np.array([np.cos(np.pi * k / 6), np.sin(np.pi * k / 6), 0.0])
        looking(spec, str(k), np.array([0.0, 0.0, 5.0]), along, 15.0)
    upper = [seen[:12].mean() for seen in pictures(spec, (32, 24)).values()]
    toward_sun = np.degrees(np.arctan2(-beam[1], -beam[0])) % 360.0
    assert abs((30.0 * int(np.argmax(upper)) - toward_sun + 180.0) % 360.0 - 180.0) <= 31.0


def test_an_overcast_sky_is_three_times_as_bright_above_as_at_the_horizon() -> None:
    # Moon and Spencer, as the CIE has it: L = L_zenith (1 + 2 sin γ) / 3. The mean around evens the clouds out.
    light = Daylight(np.radians(40.0), 0.0, 0.0, 1e4, 1.0)
    fields = [sky((256, 128), light, 0.0, np.random.default_rng(seed)).mean(axis=1) for seed in range(6)]
    around, up = np.mean(fields, axis=0), np.maximum(elevations(128), 0.0)
    slope, horizon = np.polyfit(np.sin(up), around, 1)
    assert slope / horizon == pytest.approx(2.0, rel=0.15)


def test_clouds_cover_their_share() -> None:
    light = Daylight(np.radians(40.0), 0.0, 0.0, 1e4, 0.3)
    clear = sky((256, 128), Daylight(light.elevation, 0.0, 0.0, 1e4), 0.0, np.random.default_rng(3))
    broken = sky((256, 128), light, 0.0, np.random.default_rng(3))
    ratio = broken / clear
    elsewhere = np.median(ratio)  # most of the sky is clear: the same but for one factor
    assert np.mean(abs(ratio / elsewhere - 1.0) > 0.005) == pytest.approx(0.3, abs=0.12)


# --- street lamps ---


def test_a_street_lamp_gives_all_its_lumen() -> None:
    (post,) = yard().post
    theta = np.linspace(0.0, CONE, 200_001)
    outer, inner = np.cos([CONE, INNER])
    candela = axial(post) * np.clip((np.cos(theta) - outer) / (inner - outer), 0.0, 1.0) ** 2
    assert np.trapezoid(2 * np.pi * candela * np.sin(theta), theta) == pytest.approx(6000.0, rel=1e-6)


def test_below_a_street_lamp_light_falls_with_the_square_of_the_distance() -> None:
    night, (post,) = light_named("02:00"), yard().post
    x, y, z = head_of(post)
    lux = [Meter(yard(), night).read((x, y, z - d), (0, 0, 1)).lamps for d in (1.0, 2.0, 4.0)]
    assert np.array(lux) * [1.0, 4.0, 16.0] == pytest.approx(axial(post))


def test_ground_under_a_street_lamp_is_as_bright_as_the_meter_says() -> None:
    world, (post,) = lit("02:00"), yard().post
    spec = world.spec.copy()
    x, y, _ = head_of(post)
    spec.add_material(name="white", rgba=[1.0] * 4, roughness=1.0, metallic=0.0, specular=0.0)
    for i, off in enumerate((0.0, 3.0, 6.0)):
        pos = np.array([x + off, y, 0.05])
        spec.worldbody.add_geom(
            name=f"card_{i}", type=mujoco.mjtGeom.mjGEOM_BOX, pos=pos, size=[0.2, 0.2, 0.005], material="white"
        )
        looking(spec, f"at {i}", np.add(pos, [0, 0, 1.5]), np.array([0.0, 0.0, -1.0]), 5.0)
    seen = pictures(spec, (32, 24))
    for i, off in enumerate((0.0, 3.0, 6.0)):
        reading = Meter(yard(), light_named("02:00")).read((x + off, y, 0.055), UP)
        lux = camera_weight(2700.0) * reading.lamps + reading.sky + reading.indirect
        assert seen[f"at {i}"].mean() == pytest.approx(lux / np.pi, rel=0.05)


def test_lamps_burn_in_the_dark_and_by_hand() -> None:
    assert lit("13:00").photometry.lit_posts == ()
    assert lit("02:00").photometry.lit_posts == yard().post
    assert Meter(yard(), light_named("13:00,lamps=on")).read((-14, -10, 0), UP).lamps > 30.0
    assert Meter(yard(), light_named("02:00,lamps=off")).read((-14, -10, 0), UP).lamps == 0.0


# --- shadows ---


@pytest.mark.quick_cases("13:00")
@pytest.mark.parametrize("light", ["10:00", "13:00"])
def test_a_poles_shadow_is_as_long_as_the_suns_elevation_says(light: str) -> None:
    world = lit(light)
    outdoors = world.photometry.outdoors
    beam = sun_direction(outdoors, 70.0)
    along = beam[:2] / np.linalg.norm(beam[:2])
    length = POLE / np.tan(outdoors.elevation)
    spec = world.spec.copy()
    spec.worldbody.add_geom(
        name="pole", type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[0, 0, POLE / 2], size=[0.15, POLE / 2, 0]
    )
    spec.worldbody.add_geom(  # white ground: no stains that could be taken for shadow
        name="sheet", type=mujoco.mjtGeom.mjGEOM_BOX, pos=[0, 0, 0.01], size=[8, 8, 0.01], castshadow=False
    )
    height, fovy, pixels = 30.0, 20.0, 480
    spec.worldbody.add_camera(name="above", pos=[0, 0, height], xyaxes=[1, 0, 0, 0, 1, 0], fovy=fovy)
    seen = pictures(spec, (pixels, pixels))["above"]
    metre = pixels / (2 * (height - 0.02) * np.tan(np.radians(fovy / 2)))  # pixels
    steps = np.arange(1.0, length + 2.0, 0.01)
    columns, rows = pixels / 2 + metre * steps * along[0], pixels / 2 - metre * steps * along[1]
    profile = seen[rows.astype(int), columns.astype(int)]
    middle = (profile[0] + profile[-1]) / 2
    assert profile[0] < 0.5 * profile[-1]
    measured = steps[np.argmax(profile > middle)]
    # The top is a disc, whose far edge throws the shadow's tip.
    assert measured == pytest.approx(length - 0.02 / np.tan(outdoors.elevation) + 0.15, rel=0.04)


# --- the whole ---


def test_the_same_seed_draws_the_same_and_another_one_another_sky() -> None:
    def sky(seed: int) -> bytes:
        return build_world(yard(), light_named("13:00,cloud=1"), seed).spec.texture(DOME_MATERIAL).data

    assert sky(0) == lit("13:00,cloud=1").spec.texture(DOME_MATERIAL).data
    assert sky(1) != lit("13:00,cloud=1").spec.texture(DOME_MATERIAL).data
