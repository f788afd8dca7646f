"""The laboratory of the library: what its plan promises."""

import itertools

import mujoco
import numpy as np
import pytest
from numpy.typing import ArrayLike

from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.recorder import drive_and_sense, operator_for
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.frustum import frustum
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.site import SEEN
from refseq_bench.worlds.plans.load import load_plan

LENGTH, WIDTH, MARGIN = 1.1, 0.8, 0.2
"""A robot and the room that it should have on each side [m]."""
RADIUS = 0.85
"""How far a robot that turns on the spot reaches: its axle is 0.74 m ahead of its rear, which is 0.71 m wide [m]."""


@pytest.fixture(scope="module")
def laboratory() -> World:
    return build_world(load_plan("laboratory"), light_named("13:00"), pictured=False)


@pytest.fixture(scope="module")
def model(laboratory: World) -> mujoco.MjModel:
    return laboratory.spec.compile()


def owner(laboratory: World, geom: str) -> str:
    """Name of the plan's item that a solid geom belongs to; the walls are one, the doors' leaves belong to them."""
    pieces = [f"{item.kind}:{item.name}" for item in laboratory.plan.furniture]
    mine = [piece for piece in pieces if geom.startswith(f"{piece}:")]
    return mine[0] if mine else "building" if geom.startswith(("wall:", "ceiling:", "door:", "floor")) else geom


def test_everything_in_the_plan_is_built_under_its_name(laboratory: World) -> None:
    plan, names = laboratory.plan, [g.name for g in laboratory.spec.geoms]
    assert "" not in names
    assert len(names) == len(set(names))
    on_walls = {f"window:{w.name}" for w in plan.window} | {f"door:{d.name}:leaf" for d in plan.door}
    on_walls |= {f"poster:{p.name}" for p in plan.poster} | {f"board:{b.name}" for b in plan.board}
    on_walls |= {f"{f.kind}:{f.name}" for f in plan.fixture}
    assert on_walls <= set(names)
    assert {item.kind for item in plan.furniture} == {"bench", "table", "chair", "cupboard", "shelf", "pillar", "box"}
    for item in plan.furniture:
        assert any(name.startswith(f"{item.kind}:{item.name}:") for name in names), item.name


def test_no_two_solid_things_share_a_place(laboratory: World, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solid = [g for g in range(model.ngeom) if model.geom_contype[g] and model.geom(g).name != "floor"]
    owners = [owner(laboratory, model.geom(g).name) for g in solid]
    centres, reach = data.geom_xpos[solid], model.geom_rbound[solid]
    meetings = []
    for i, j in itertools.combinations(range(len(solid)), 2):
        near = np.linalg.norm(centres[i] - centres[j]) < reach[i] + reach[j]
        if near and owners[i] != owners[j] and depth(model, data, solid[i], solid[j]) > 1e-4:
            meetings.append((model.geom(solid[i]).name, model.geom(solid[j]).name))
    assert meetings == []


def depth(model: mujoco.MjModel, data: mujoco.MjData, a: int, b: int) -> float:
    """How far two geoms reach into each other [m]; 0 where they do not."""
    return max(0.0, -mujoco.mj_geomDistance(model, data, a, b, 1.0, None))


def test_nothing_is_below_the_floor_or_above_the_ceiling(laboratory: World, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    pieces = tuple(f"{item.kind}:{item.name}:" for item in laboratory.plan.furniture)
    for g in range(model.ngeom):
        if model.geom(g).name.startswith(pieces) and model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH:
            first = model.mesh_vertadr[model.geom_dataid[g]]
            vertices = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[g]]]
            z = data.geom_xpos[g, 2] + vertices @ data.geom_xmat[g].reshape(3, 3)[2]
            assert z.min() > -1e-5, model.geom(g).name
            assert z.max() < laboratory.plan.ceiling.height + 1e-5, model.geom(g).name


def touched_by(laboratory: World, boxes: dict[str, tuple[ArrayLike, ArrayLike]]) -> set[tuple[str, str]]:
    """What boxes 1.5 m high over ``middle`` (2,) with sides of twice ``half`` (2,) touch: pairs of box and geom."""
    probe = laboratory.spec.copy()
    for name, (middle, half) in boxes.items():
        body = probe.worldbody.add_body(name=name, pos=[*np.asarray(middle), 0.76])
        body.add_freejoint()
        size = [*np.asarray(half), 0.75]
        body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=size, conaffinity=0)
    model = probe.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = [sorted((model.geom(g).name for g in c.geom), key=lambda n: n not in boxes) for c in data.contact]
    return {(box, thing) for (box, thing), c in zip(names, data.contact, strict=True) if c.dist < 0.0}


def test_a_probe_notices_a_bench_and_a_wall(laboratory: World) -> None:
    found = touched_by(laboratory, {"bench": ((3.8, 6.9), (0.2, 0.2)), "wall": ((9.0, 0.5), (0.3, 0.6))})
    assert any(box == "bench" and thing.startswith("bench:n1") for box, thing in found)
    assert any(box == "wall" and thing.startswith("wall:windows") for box, thing in found)


@pytest.mark.parametrize("route", ["forward", "reverse", "round"])
def test_routes_are_free_for_a_robot_with_room_to_wander(laboratory: World, route: str) -> None:
    boxes = {}
    for i, (start, end) in enumerate(itertools.pairwise(laboratory.routes[route])):
        half = np.abs(end - start) / 2 + np.where(end == start, WIDTH / 2 + MARGIN, LENGTH / 2)
        boxes[f"leg {i}"] = ((start + end) / 2, half)
    for i, point in enumerate(laboratory.routes[route]):
        boxes[f"turn {i}"] = (point, (RADIUS / np.sqrt(2),) * 2)  # a square in the circle in which the robot turns
    assert touched_by(laboratory, boxes) == set()


def test_aisles_are_at_least_1_6_m_wide(laboratory: World) -> None:
    aisles = {
        "posters": ((8.9, 8.0), (7.0, 0.8)),
        "middle": ((8.9, 4.49), (6.4, 0.8)),
        "windows": ((8.9, 1.17), (6.4, 0.8)),
        "cross": ((8.9, 4.5), (0.8, 3.0)),
        "west": ((1.4, 4.5), (0.8, 3.4)),
        "east": ((16.7, 4.5), (0.8, 3.4)),
    }
    assert touched_by(laboratory, aisles) == set()


@pytest.mark.slow
def test_a_view_every_22_cm_makes_67_views_of_the_wall_of_posters(laboratory: World) -> None:
    (first, y), (last, y_end) = laboratory.routes["forward"]
    wall = laboratory.plan.wall_named("posters")
    assert y == y_end
    assert 1.5 < wall.start[1] - y < 1.8  # to the left of a robot that goes along x
    assert 14 < last - first < 16
    settings = BenchSettings(renderer=RendererKind.NONE)
    with Bench(laboratory, robots.load("robuter"), seed=1, settings=settings) as bench:
        assert len(list(drive_and_sense(bench, operator_for(bench, 1), Trigger(distance=0.22)))) == 67


def test_a_camera_by_a_window_sees_what_is_outside(laboratory: World) -> None:
    spec = laboratory.spec.copy()
    spec.worldbody.add_camera(name="out", pos=[4.7, 1.1, 1.5], xyaxes=[-1, 0, 0, 0, 0, 1])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    beyond = -data.geom("outside:windows").xpos[1]
    assert beyond > 15
    assert frustum(model, data, "out").frustum_far > 1.1 + beyond


def test_the_laboratory_stays_light(model: mujoco.MjModel) -> None:
    assert np.isin(model.geom_group, (0, SEEN)).sum() < 320  # what costs rendering time
    assert model.ngeom < 550
    assert model.ntexdata < 80e6
