"""Baked light against the meter in an empty room, against the sky's, and against form factors."""

import numpy as np
import pytest

from refseq_bench.sim.rendering.baked.still_light import light_still
from refseq_bench.sim.rendering.baked.surfaces import surfaces_of
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.lighting.baking import Baked, Shell, about, bake, hemisphere, sunny_patches, world_light
from refseq_bench.worlds.lighting.form_factors import Cards
from refseq_bench.worlds.lighting.occluders import Occluders
from refseq_bench.worlds.lighting.photometry import photometry
from refseq_bench.worlds.meter import Meter
from refseq_bench.worlds.plans.load import load_plan, parse_plan
from tests.worlds.conftest import SMALL, box, in_the_open

ROOM = SMALL.format(
    top='window = [{ name = "w", wall = "right", at = 4 }]',
    end="".join(
        f'[[wall]]\nname = "{name}"\nstart = [{x}, -1.2]\nend = [{x}, 1.2]\ninside = "{inside}"\nmaterial = "plaster"\n'
        for name, x, inside in (("start", 0, "right"), ("end", 8, "left"))
    ),
)
LAMP = '[[lamp]]\nname = "l"\nfirst = [3, 0]\nstep = [1, 0]\ncount = 1\nsize = [0.2, 0.2]\nlumen = 1000'
UP = np.array([0.0, 0.0, 1.0])
UNIT = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)


def baked_on(text: str, light: str, cards: Cards) -> np.ndarray:
    """Light on cards in a world of a plan."""
    world = build_world(parse_plan(text), light_named(light), seed=0)
    model, found = world.spec.compile(), []
    shining = world_light(world.plan, world.photometry)

    def keeping(shell: Shell, others: Cards) -> Baked:
        found.append(bake(shining, shell, cards))
        return bake(shining, shell, others)

    light_still(model, surfaces_of(model, 0.4), keeping)
    return found[0].around


@pytest.mark.quick_cases("13:00,cloud=1-0.1")
@pytest.mark.parametrize(("light", "off"), [("13:00", 0.1), ("13:00,cloud=1", 0.1), ("18:00", 0.2)])
def test_an_empty_room_has_the_meters_light(light: str, off: float) -> None:
    """Two ways: patches and form factors that lose no light there, rays and sources that are seen in part here.

    A low sun falls on the window's reveal, which the meter knows nothing of.
    """
    places = np.array([[2, 0, 1.0], [4, 0, 1.0], [6, 0.5, 1.5]])
    axes = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, -1, 0], [0, 0, -1]], float)
    cards = Cards(np.repeat(places, len(axes), axis=0), np.tile(axes, (len(places), 1)))
    wanted = Meter(parse_plan(ROOM), light_named(light)).for_camera(cards)
    found = baked_on(ROOM, light, cards)
    deviation = found / wanted - 1.0
    assert abs(np.mean(deviation)) < off
    assert np.std(deviation) < 0.15


def test_between_bright_walls_reflections_are_followed_until_they_stand() -> None:
    """Walls that throw back 0.9 of the light: eight reflections hold 1 - 0.9⁹ = 0.61 of it.

    The meter knows nothing of the dark skirtings, which take in some of it.
    """
    text, light = box(6, 5, 0.9, LAMP), "23:00,lamps=on"
    places = np.repeat([[1, 1, 1.0], [3, -1, 1.0], [5, 0, 1.5]], 6, axis=0)
    cards = Cards(places, np.tile(np.concatenate([np.eye(3), -np.eye(3)]), (3, 1)))
    wanted = Meter(parse_plan(text), light_named(light)).for_camera(cards)
    assert baked_on(text, light, cards).mean() == pytest.approx(wanted.mean(), rel=0.15)


def test_open_ground_gets_the_skys_light() -> None:
    plan, light = load_plan("car-park"), light_named("13:00,cloud=1")
    world = build_world(plan, light, seed=0, pictured=False)
    triangles = np.array([[-50, -50, 0.0], [50, -50, 0], [50, 50, 0], [-50, 50, 0]])[[[0, 1, 2], [0, 2, 3]]]
    shell = Shell(
        triangles,
        np.zeros(2),
        Cards(triangles.reshape(-1, 3), np.tile([0, 0, 1.0], (6, 1))),
        np.arange(6).reshape(2, 3),
    )
    card = Cards(np.array([[0, 0, 1.0]]), np.array([[0, 0, 1.0]]))
    around = bake(world_light(plan, world.photometry), shell, card).around
    assert around[0] == pytest.approx(world.photometry.outdoors.sky, rel=1e-6)


def test_behind_a_wall_a_street_lamp_gives_no_light() -> None:
    plan = parse_plan(in_the_open('[[post]]\nname = "p"\nat = [0, 0]'))
    light = world_light(plan, photometry(plan, light_named("23:00")))
    wall = ((UNIT - [0.5, 0, 0]) * [8, 3, 1])[..., [0, 2, 1]] + [0, 1.5, 0]  # x from -4 to 4, 3 m high, at y = 1.5
    triangles = np.concatenate([wall, UNIT - [0, 0, 1]])
    corners = Cards(triangles.reshape(-1, 3), np.tile(UP, (12, 1)))
    black = Shell(triangles, np.zeros(4), corners, np.arange(12).reshape(4, 3))
    cards = Cards(np.array([[0.2, -2.5, 0.1], [0.2, 2.5, 0.1]]), np.tile(UP, (2, 1)))
    before, behind = bake(light, black, cards).around
    assert before == pytest.approx(Meter(plan, light_named("23:00")).for_camera(cards)[0], rel=0.01)
    assert behind < 0.1  # the night sky's


def test_rays_leave_by_the_cosine_and_turn_with_the_normal() -> None:
    rays = hemisphere(2000)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)
    assert rays[:, 2].mean() == pytest.approx(2 / 3, abs=0.01)  # ∫ cos² over ∫ cos
    np.testing.assert_allclose(rays[:, :2].mean(axis=0), 0.0, atol=0.01)
    normals = np.random.default_rng(1).normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turns = about(normals)
    np.testing.assert_allclose(turns[..., 2], normals)
    np.testing.assert_allclose(turns @ turns.transpose(0, 2, 1), np.tile(np.eye(3), (50, 1, 1)), atol=1e-12)


def test_rays_meet_the_nearest_triangle_and_see_past_others() -> None:
    occluders = Occluders(np.concatenate([UNIT, UNIT + np.array([0, 0, 1.0])]))
    origins = np.array([[0.7, 0.2, 2.0], [0.2, 0.7, 2.0], [0.7, 0.2, 0.5], [3.0, 3.0, 2.0]])
    down = np.tile([0.0, 0.0, -1.0], (4, 1))
    assert occluders.hit(origins, down).tolist() == [2, 3, 0, -1]
    assert occluders.clear(origins, origins + 1.5 * down).tolist() == [False, False, False, True]
    assert occluders.clear(origins, origins + 0.4 * down).tolist() == [True] * 4
    assert occluders.open_to(origins, np.array([0.0, 0.0, 1.0])).tolist() == [True, True, False, True]
    with pytest.raises(ValueError, match="no triangles"):
        Occluders(np.empty((0, 3, 3)))


def test_patches_of_sun_keep_flux_and_area() -> None:
    patches = sunny_patches(UNIT, np.array([10.0, 30.0]))
    assert patches.flux.sum() == pytest.approx(20.0)
    assert patches.areas.sum() == pytest.approx(1.0)
    assert sunny_patches(UNIT, np.zeros(2)).flux.size == 0


CABINET = '[[cabinet]]\nname = "c"\nwall = "left"\nat = 5\nwidth = 1.6\nheight = 1.8\ndepth = 0.4\nmaterial = "door"\n'


def test_walls_behind_a_cabinet_say_nothing() -> None:
    """The wall there gets on the sheet as much as it does beside; its own points lie in the dark of the cabinet."""
    world = build_world(parse_plan(ROOM + CABINET), light_named("13:00,cloud=1"), seed=0)
    model, found = world.spec.compile(), []

    def keeping(shell: Shell, others: Cards) -> Baked:
        found.append((shell.cards, bake(world_light(world.plan, world.photometry), shell, others)))
        return found[0][1]

    surfaces = surfaces_of(model, 0.4)
    light = light_still(model, surfaces, keeping)
    ((cards, baked),) = found
    x, y, z = cards.points.T
    on_wall = np.isclose(y, 1.2) & (cards.normals[:, 1] < -0.99) & (abs(x - 4) < 4.0)
    behind, beside = on_wall & (abs(x - 5) < 0.75) & (z < 1.75), on_wall & ((abs(x - 5) > 0.85) | (z > 1.85))
    assert behind.sum() > 9
    assert baked.buried[behind].all()
    assert not baked.buried[beside].any()
    (chart,) = (c for c in surfaces.sheet.charts if np.isclose(c.points[..., 1], 1.2).all() and c.normal[1] < -0.99)
    (rows, columns), sheet = chart.shape, light.sheet
    shown = sheet[chart.row : chart.row + rows, chart.column : chart.column + columns]
    assert shown.min() == pytest.approx(baked.lux[on_wall & ~baked.buried].min(), rel=1e-5)
    assert baked.lux[behind].min() < shown.min()
    assert np.isfinite(sheet).all()
    assert light.probes.at(np.array([*world.routes["forward"][0], 1.0])).min() > 1.0
