from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.errors import WorldsError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.site import GLASS, SEEN, SOLID, TOUCHED
from refseq_bench.worlds.plans.frame import LocalFrame, quaternion
from refseq_bench.worlds.plans.furnish import PLATE
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL, corner, in_the_open


def touched(spec: mujoco.MjSpec, pos: tuple[float, float, float], size: tuple[float, float, float]) -> set[str]:
    """Return the names of the geoms that a box of half sizes ``size`` at ``pos`` touches."""
    probe = spec.copy()
    body = probe.worldbody.add_body(name="probe", pos=pos)
    body.add_freejoint()
    body.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_BOX, size=size)
    model = probe.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pairs = [{model.geom(g).name for g in c.geom} for c in data.contact if c.dist < 0.0]
    return set().union(*pairs) - {"probe"}


@pytest.fixture(scope="module")
def corridor() -> World:
    return build_world(parse_plan(SMALL.format(top="", end="")), light_named("18:00"), pictured=False)


def test_a_body_smaller_than_the_corridor_touches_nothing(corridor: World) -> None:
    assert touched(corridor.spec, (4, 0, 1.4), (3, 1.19, 1.39)) == set()


def test_a_larger_body_touches_both_walls(corridor: World) -> None:
    assert touched(corridor.spec, (4, 0, 1.4), (3, 1.21, 1.39)) == {"wall:left:0", "wall:right:0"}


def test_a_taller_body_touches_floor_and_ceiling(corridor: World) -> None:
    assert touched(corridor.spec, (4, 0, 1.4), (3, 1.19, 1.41)) == {"floor", "ceiling:0:slab"}


def test_the_hallway_leaves_room_for_a_wandering_robot(hallway: World) -> None:
    # 1.1 × 0.8 m of robot that wanders by 0.25 m to each side sweeps 1.3 m; its route adds half a length at each end.
    (first, _), (last, _) = hallway.routes["forward"]
    half = ((last - first + 1.1) / 2, 0.4 + 0.25, 0.5)
    assert touched(hallway.spec, ((first + last) / 2, 0.0, 0.51), half) == set()


def test_around_a_corner_both_corridors_are_free_and_no_wider() -> None:
    spec = build_world(parse_plan(corner()), light_named("18:00"), pictured=False).spec
    assert touched(spec, (3, 0, 1.4), (2.99, 0.99, 1.39)) == set()
    assert touched(spec, (5, 2, 1.4), (0.99, 2.99, 1.39)) == set()
    assert touched(spec, (3.9, 0.9, 1.4), (0.11, 0.11, 1.39)) == {"wall:inner-1:0", "wall:inner-2:0"}
    # No gap where the sun could come in: both walls fill what is behind each corner.
    for meeting, outward in (((4, 1), (-1, 1)), ((6, -1), (1, -1)), ((0, 1), (-1, 1))):
        middle = np.add(meeting, 0.075 * np.array(outward))
        assert len(touched(spec, (*middle, 1.4), (0.07, 0.07, 1.0))) == 2, meeting


def test_something_does_stand_in_the_hallway(hallway: World) -> None:
    assert any(n.startswith("cabinet") for n in touched(hallway.spec, (50, 0, 0.51), (48, 1.15, 0.5)))


BLOCK = "".join(
    f'[[wall]]\nname = "{name}"\nstart = {a}\nend = {b}\ninside = "right"\nmaterial = "plaster"\n'
    for name, a, b in (
        ("south", [3, -0.4], [5, -0.4]),
        ("east", [5, -0.4], [5, 0.4]),
        ("north", [5, 0.4], [3, 0.4]),
        ("west", [3, 0.4], [3, -0.4]),
    )
)
"""Four walls in the middle of the short corridor that are seen from around them."""


def door_at(wall: str, at: float, width: float = 1.0) -> str:
    return f'[[door]]\nname = "d{at}"\nwall = "{wall}"\nat = {at}\nwidth = {width}\nmaterial = "plaster"\n'


@pytest.mark.parametrize(
    ("text", "pieces"),
    [
        (SMALL.format(top="", end=door_at("left", 2.0) + door_at("left", 3.0)), {"left": 4}),
        (SMALL.format(top="", end=door_at("left", 1.3) + door_at("left", 2.3)), {"left": 4}),
        (corner() + door_at("inner-1", 3.5) + door_at("inner-2", 0.5), {"inner-1": 2, "inner-2": 2}),
        (SMALL.format(top="", end=BLOCK + door_at("south", 1.0, 2.0)), {"south": 1}),
    ],
)
def test_where_openings_touch_or_end_at_a_corner_there_is_no_piece_of_wall(text: str, pieces: dict[str, int]) -> None:
    spec = build_world(parse_plan(text), light_named("18:00"), pictured=False).spec
    assert spec.compile().ngeom > 4
    for wall, count in pieces.items():
        found = {g.name for g in spec.geoms if g.name.startswith(f"wall:{wall}:")} - {f"wall:{wall}:skirting"}
        assert found == {f"wall:{wall}:{i}" for i in range(count)}


@pytest.mark.parametrize(("angle", "reach"), [(0, 1.28), (80, 3.85), (100, 3.85)])
def test_a_beam_at_a_door_ends_on_its_leaf_or_in_the_room_behind(
    small: Callable[..., str], angle: float, reach: float
) -> None:
    # Closed: the leaf lies 0.08 m behind the wall's face. Open: 0.15 m of wall and a room 2.5 m deep.
    door = f'door = [{{ name = "d1", wall = "left", at = 4, open = {angle} }}]'
    model = build_world(parse_plan(small(door)), light_named("18:00"), pictured=False).spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    solid = np.zeros(6, np.uint8)
    solid[SOLID] = 1
    geom = np.zeros(1, np.int32)
    start, left = np.array([4.0, 0.0, 0.3]), np.array([0.0, 1.0, 0.0])
    assert mujoco.mj_ray(model, data, start, left, solid, 1, -1, geom) == pytest.approx(reach, abs=1e-6)


def test_routes_cannot_be_changed(hallway: World) -> None:
    route = hallway.routes["reverse"]
    assert route.shape == (2, 2)
    with pytest.raises(ValueError, match="read-only"):
        route[0, 0] = 1.0


def test_everything_in_the_plan_is_built_under_its_name(hallway: World) -> None:
    plan = hallway.plan
    names = {g.name for g in hallway.spec.geoms}
    assert "" not in names
    expected = {f"window:{w.name}" for w in plan.window}
    expected |= {f"door:{d.name}:leaf" for d in plan.door} | {f"poster:{p.name}" for p in plan.poster}
    expected |= {f"board:{b.name}" for b in plan.board} | {f"cabinet:{c.name}" for c in plan.cabinet}
    expected |= {f"bin:{b.name}" for b in plan.bin} | {f"{f.kind}:{f.name}" for f in plan.fixture}
    assert expected <= names


def test_what_is_only_seen_touches_nothing(hallway_model: mujoco.MjModel) -> None:
    model = hallway_model
    seen = np.isin(model.geom_group, (SEEN, GLASS))
    assert set(model.geom_group) == {SOLID, SEEN, TOUCHED, GLASS}
    assert not model.geom_contype[seen].any()
    assert not model.geom_conaffinity[seen].any()
    assert model.geom_contype[~seen].all()


def test_solid_things_tell_the_laser_their_remission(hallway: World, hallway_model: mujoco.MjModel) -> None:
    model, materials = hallway_model, hallway.plan.material
    found = {name: model.geom(name).user[0] for name in ("wall:left:0", "door:d01:leaf", "cabinet:c01")}
    wanted = {"wall:left:0": "plaster", "door:d01:leaf": "door", "cabinet:c01": "metal"}
    assert found == {name: materials[material].echo for name, material in wanted.items()}


def test_a_black_wall_tells_some_remission_so_that_none_told_is_another_thing(small: Callable[..., str]) -> None:
    text = small().replace("plaster = { albedo = 0.7", "plaster = { albedo = 0.0")
    model = build_world(parse_plan(text), light_named("18:00"), pictured=False).spec.compile()
    assert 0.0 < model.geom("wall:left:0").user[0] <= 1e-6
    assert model.geom("floor").user[0] == 0.0


def test_a_number_plate_hangs_on_the_wall_beside_its_door(hallway: World) -> None:
    plan = hallway.plan
    labelled = [door for door in plan.door if door.label]
    assert labelled
    for door in labelled:
        frame, plate = LocalFrame.of(plan.wall_named(door.wall)), hallway.spec.geom(f"door:{door.name}:plate")
        along, out = np.array([frame.along, frame.inward]) @ (plate.pos[:2] - frame.origin)
        assert door.extent[1] < along - plate.size[0]
        assert along + plate.size[0] < door.extent[1] + PLATE
        assert 0.0 < out < 0.01


def test_memory_stays_modest(hallway_model: mujoco.MjModel) -> None:
    assert hallway_model.ntexdata < 200e6


def test_a_wide_floor_takes_no_larger_picture_than_a_long_one() -> None:
    for text in (corner(length=60.0), corner(depth=60.0)):
        texture = compiled(text, seed=0).texture("floor")
        assert max(texture.height[0], texture.width[0]) == 40 * 48  # 40 tiles, then they repeat


def compiled(text: str, seed: int, light: str = "18:00") -> mujoco.MjModel:
    return build_world(parse_plan(text), light_named(light), seed).spec.compile()


def image_of(model: mujoco.MjModel) -> bytes:
    """Return the whole model, textures and all, as bytes."""
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def pixels(model: mujoco.MjModel, texture: str) -> bytes:
    t = model.texture(texture)
    start = int(t.adr[0])
    return model.tex_data[start : start + int(t.height[0] * t.width[0] * t.nchannel[0])].tobytes()


def test_a_seed_below_0_is_refused(small: Callable[..., str]) -> None:
    with pytest.raises(WorldsError, match=r"^world 'small': seed = -1 is not valid; it should be 0 or more$"):
        compiled(small(), seed=-1)


def test_a_seed_fixes_everything_and_another_seed_draws_anew(small: Callable[..., str]) -> None:
    text = small(
        'poster = [{ name = "p", wall = "left", at = 2 }]\ndoor = [{ name = "d", wall = "left", at = 5, label = "7" }]'
    )
    first, other = compiled(text, seed=3), compiled(text, seed=4)
    assert image_of(compiled(text, seed=3)) == image_of(first)
    for name in ("poster:p", "door:d:plate", "floor", "material:plaster:plaster:0"):
        assert pixels(first, name) != pixels(other, name)


def test_light_does_not_redraw_the_surfaces(small: Callable[..., str]) -> None:
    text = small('poster = [{ name = "p", wall = "left", at = 2 }]')
    assert pixels(compiled(text, 3, "16:00"), "poster:p") == pixels(compiled(text, 3, "late-evening"), "poster:p")


def test_another_poster_does_not_redraw_the_first(small: Callable[..., str]) -> None:
    one = 'poster = [{ name = "p", wall = "left", at = 2 }'
    alone, beside = one + "]", one + ', { name = "q", wall = "left", at = 5 }]'
    assert pixels(compiled(small(alone), 1), "poster:p") == pixels(compiled(small(beside), 1), "poster:p")


def test_quaternion_turns_the_axes_there() -> None:
    x, z = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    turned = np.zeros(3)
    for axis, there in (((1, 0, 0), x), ((0, 0, 1), z)):
        mujoco.mju_rotVecQuat(turned, np.array(axis, float), quaternion(x, z))
        np.testing.assert_allclose(turned, there, atol=1e-12)


BUILT_IN = (
    "trim",
    "frame",
    "floor_0",
    "ceiling_0",
    "furniture_grey",
    "lamp_row",
    "wall_left_0",
    "bark",
    "leaf",
    "pole",
)
"""Words that the parts of a world are named by, as names of the plan's own materials."""

CUPBOARD = 'kind = "cupboard"\nwidth = 0.6\ndepth = 0.4\nheight = 1.9\nmaterial = "{}"'


def named(table: str, names: tuple[str, ...], more: str, apart: float = 1.5) -> str:
    """Entries of a table in a row along x, or along the wall ``left``, which differ in name and place."""
    places = [1.0 + apart * i for i in range(len(names))]
    at = [f'wall = "left"\nat = {x}' if table in ("window", "cabinet") else f"at = [{x}, 0.8]" for x in places]
    return "".join(f'[[{table}]]\nname = "{name}"\n{where}\n{more}\n' for name, where in zip(names, at, strict=True))


@pytest.mark.parametrize(
    "things",
    [
        named("window", ("a", "a_pane", "a_ledge"), "width = 1.0"),
        named("person", ("a", "a_left-leg"), ""),
        named("cabinet", ("a", "a_front"), 'material = "trim"'),
        named("furniture", ("a", "a_face"), CUPBOARD.format("front"))
        + named("furniture", ("b",), CUPBOARD.format("0"), 0.0),
        named("car", ("a", "a_trim"), "", 4.0)
        + named("tree", ("t", "t_crown"), "", 4.0)
        + named("post", ("p", "p_arm"), ""),
        '[[lamp]]\nname = "row"\nfirst = [1, 0]\nstep = [2, 0]\ncount = 2\nlumen = 900\n',
    ],
)
def test_no_name_of_a_plan_is_one_of_a_hidden_part(small: Callable[..., str], things: str) -> None:
    own = "".join(f"[material.{name}]\nalbedo = 0.4\nroughness = 0.5\n" for name in (*BUILT_IN, "front", "0"))
    text = small(end=own + things)
    if "[[tree]]" in things:
        text = in_the_open(own + things, y=-2)
    model = build_world(parse_plan(text), light_named("late-evening"), pictured=False).spec.compile()
    assert model.ngeom > 4


@pytest.mark.parametrize(
    "thing",
    [
        '[[fixture]]\nname = "f"\nkind = "radiator"\nwidth = 0.05\nheight = 0.6\nbottom = 0.1\ndepth = 0.1\n'
        'material = "door"\n',
        '[[board]]\nname = "b"\nwidth = 0.05\nheight = 0.05\nsheets = 40\n',
        '[[board]]\nname = "b"\nwidth = 0.01\nheight = 0.01\nsheets = 9\n',
    ],
)
def test_small_things_hang_too(small: Callable[..., str], thing: str) -> None:
    assert compiled(small(end=f'{thing}wall = "left"\nat = 3\n'), 0).ngeom > 8


def test_a_poster_and_a_material_of_one_name_have_a_picture_each(small: Callable[..., str]) -> None:
    text = small(end='[[poster]]\nname = "plaster_0"\nwall = "left"\nat = 3\n').replace('"plaster"', '"poster"')
    assert pixels(compiled(text.replace("plaster =", "poster ="), 0), "poster:plaster_0")
