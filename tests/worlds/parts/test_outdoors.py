"""Cars, trees, kerbs, markings, posts and walls in the open: what they are to touch, to a laser and in a mesh."""

from functools import cache

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts.cars import CARS, hull, trim
from refseq_bench.worlds.parts.facets import Facets
from refseq_bench.worlds.parts.greyscale import linear
from refseq_bench.worlds.parts.scenery import shade_under
from refseq_bench.worlds.parts.site import SEEN, SOLID, TOUCHED
from refseq_bench.worlds.plans.footprints import CAR_SIZES
from refseq_bench.worlds.plans.load import parse_plan
from refseq_bench.worlds.plans.schema import Tree
from tests.worlds.conftest import in_the_open

LOT = """
[[wall]]
name = "house"
start = [-20, 15]
end = [20, 15]
inside = "right"
height = 7.0
surface = "brick"
material = "asphalt"
[[window]]
name = "lower"
wall = "house"
at = 10
[[window]]
name = "upper"
wall = "house"
at = 10
sill = 4.0
[[car]]
name = "c1"
at = [0, 0]
heading = 30
kind = "saloon"
albedo = 0.5
[[tree]]
name = "t1"
at = [8, 0]
height = 6
crown = 1.8
trunk = 0.2
[[post]]
name = "p1"
at = [-8, 0]
[[kerb]]
name = "k1"
points = [[-5, -5], [5, -5], [5, -8]]
material = "paint"
[[marking]]
name = "m1"
points = [[-5, 5], [-5, 9], [-5, 5], [0, 5]]
width = 0.1
material = "paint"
"""
LASER_GROUPS = np.array([1, 0, 0, 1, 0, 0], np.uint8)


@cache
def lot() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = build_world(parse_plan(in_the_open(LOT, y=-10)), light_named("13:00"), pictured=False).spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def beam(origin: tuple[float, float, float], angle: float) -> tuple[str, float]:
    """Name and distance of what a level beam at ``angle`` [deg] ends on."""
    model, data = lot()
    geom = np.zeros(1, np.int32)
    along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    distance = mujoco.mj_ray(model, data, np.array(origin, float), along, LASER_GROUPS, 1, -1, geom, None)
    return (model.geom(geom[0]).name if geom[0] >= 0 else ""), float(distance)


def volume(facets: Facets) -> float:
    """Volume by the divergence theorem [m³]: positive for a closed skin that faces outwards."""
    a, b, c = np.swapaxes(facets.points[facets.triangles], 0, 1)
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def directed_edges(facets: Facets) -> NDArray[np.int64]:
    _, corner = np.unique(facets.points.round(9), axis=0, return_inverse=True)
    triangles = corner.ravel()[facets.triangles]
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


# --- cars ---


@pytest.mark.parametrize("name", list(CARS))
def test_a_cars_hull_is_closed_and_faces_outwards(name: str) -> None:
    skin = hull(CARS[name])
    edges = directed_edges(skin)
    there, back = ({tuple(e) for e in edges.tolist()}, {tuple(e[::-1]) for e in edges.tolist()})
    assert there == back
    assert len(there) == len(edges)
    sizes = np.ptp(skin.points, axis=0)
    assert 0.5 * np.prod(sizes) < volume(skin) < 0.9 * np.prod(sizes)


@pytest.mark.parametrize("name", list(CARS))
def test_a_car_keeps_to_its_footprint_and_is_alike_on_both_sides(name: str) -> None:
    kind = CARS[name]
    for facets, proud in ((hull(kind), 0.0), (trim(kind), 0.03)):
        raised = facets.points[facets.points[:, 2] > 0.02]
        assert (np.array(CAR_SIZES[name]) <= np.ptp(raised[:, :2], axis=0) + 0.1).all()
        assert (np.abs(raised[:, :2]).max(axis=0) <= np.array(CAR_SIZES[name]) / 2 + proud + 1e-9).all()
        mirrored = {tuple(p) for p in (raised * [1, -1, 1]).round(6).tolist()}
        assert mirrored == {tuple(p) for p in raised.round(6).tolist()}


@pytest.mark.parametrize("name", list(CARS))
def test_glass_and_lamps_look_out_of_the_hull(name: str) -> None:
    facets = trim(CARS[name])
    a, b, c = np.swapaxes(facets.points[facets.triangles], 0, 1)
    middle, normal = (a + b + c) / 3, np.cross(b - a, c - a)
    high = middle[:, 2] > 0.75  # above the wheels
    assert (np.einsum("ij,ij->i", middle - [0.0, 0.0, 0.8], normal)[high] > 0.0).all()


@pytest.mark.parametrize(("angle", "half"), [(30.0, "length"), (120.0, "width")])
def test_a_laser_sees_a_car_where_its_hull_is(angle: float, half: str) -> None:
    at = -8.0 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    name, distance = beam((*at, 0.35), angle)
    extent = CARS["saloon"].length / 2 if half == "length" else CARS["saloon"].half_width
    assert name == "car:c1"
    assert 8.0 - extent - 1e-6 <= distance <= 8.0 - extent + 0.08


def test_a_laser_gets_less_from_dark_paint() -> None:
    model, _ = lot()
    assert model.geom("car:c1").user[0] == pytest.approx(0.5)


def test_below_a_car_there_is_nothing_for_a_laser() -> None:
    assert beam((0.0, -3.0, 0.1), 90.0)[0] != "car:c1"


def test_the_ground_under_a_car_gets_the_light_that_it_leaves() -> None:
    # Sky that reaches a point below a plate, by brute force over the hemisphere.
    size, height, beyond = (4.0, 1.6), 0.2, 0.12
    shade = linear(shade_under(size, height, beyond, albedo=0.5)) / 0.5
    rng = np.random.default_rng(0)
    up = rng.random(400_000)  # sin² of the elevation's complement: cosine-weighted
    tangent, azimuth = np.sqrt(up / (1.0 - up)), rng.uniform(0, 2 * np.pi, 400_000)
    off = height * tangent[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    for column, row in ((0, 0), (32, 1), (63, 32), (61, 32), (32, 4)):
        x = (2 * column / 63 - 1) * (size[0] / 2 + beyond)
        y = (2 * row / 63 - 1) * (size[1] / 2 + beyond)
        met = (np.abs(np.add(off, [x, y])) <= np.array(size) / 2).all(axis=1)
        assert shade[row, column] == pytest.approx(1.0 - met.mean(), abs=0.015)


# --- what stands and lies around them ---


def test_trunk_and_pole_end_a_beam_and_the_crown_does_not() -> None:
    assert beam((8.0, -4.0, 0.35), 90.0) == ("tree:t1", pytest.approx(4.0 - 0.2, abs=1e-6))
    assert beam((-8.0, -4.0, 0.35), 90.0) == ("post:p1", pytest.approx(4.0 - 0.07, abs=1e-6))
    assert beam((8.0, -4.0, 4.5), 90.0)[0].startswith("wall:house")


def test_leaves_stay_around_their_crown() -> None:
    model, data = lot()
    geom = model.geom("tree:t1:crown")
    mesh = model.mesh(geom.dataid[0])
    points = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
    world = points @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
    tree = Tree(name="t1", at=(8.0, 0.0))
    distance = np.linalg.norm(world - [8.0, 0.0, tree.height - tree.crown], axis=1)
    assert distance.max() < 1.25 * tree.crown
    assert np.quantile(distance, 0.5) > 0.5 * tree.crown


def test_a_kerb_is_solid_and_too_low_for_a_laser() -> None:
    model, _ = lot()
    stones = [model.geom(f"kerb:k1:{i}") for i in range(2)]
    assert all(s.contype[0] == 1 and s.group[0] == SOLID for s in stones)
    assert [s.pos[2] + s.size[2] for s in stones] == pytest.approx([0.12, 0.12])
    assert stones[0].size[0] == pytest.approx(5.0 + 0.075)


def test_paint_is_seen_and_not_touched_and_painted_once() -> None:
    model, data = lot()
    geom = model.geom("marking:m1")
    assert (geom.group[0], geom.contype[0], geom.conaffinity[0]) == (SEEN, 0, 0)
    mesh = model.mesh(geom.dataid[0])
    corners = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
    faces = corners[model.mesh_face[mesh.faceadr[0] : mesh.faceadr[0] + mesh.facenum[0]]]
    area = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(0.1 * (4.0 + 5.0), rel=1e-5)
    assert data.geom_xpos[geom.id][2] < 0.01


def test_windows_above_each_other_are_both_open() -> None:
    for z, open_ in ((0.5, False), (1.6, True), (3.2, False), (4.7, True), (6.0, False)):
        model, data = lot()
        geom = np.zeros(1, np.int32)
        along = np.array([0.0, 1.0, 0.0])
        mujoco.mj_ray(model, data, np.array([-9.7, 10.0, z]), along, LASER_GROUPS, 1, -1, geom, None)
        assert (geom[0] < 0) == open_, z


def test_what_is_only_touched_is_never_seen() -> None:
    model, _ = lot()
    names = {model.geom(i).name for i in range(model.ngeom) if model.geom_group[i] == TOUCHED}
    assert names == {"floor"}


def test_a_window_above_one_of_another_width_is_told() -> None:
    wider = LOT.replace("at = 10\nsill = 4.0", "at = 10\nwidth = 3.0\nsill = 4.0")
    with pytest.raises(PlanError) as caught:
        parse_plan(in_the_open(wider, y=-10))
    said = "plan.toml: window[1].at: 10: 'upper' overlaps 'lower', which takes 9 to 11 m of wall 'house'"
    assert str(caught.value) == said
