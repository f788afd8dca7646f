import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.errors import PlanError
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.parts import people
from refseq_bench.worlds.parts.figure import PARTS, clothes, skin
from refseq_bench.worlds.parts.people import Crowd
from refseq_bench.worlds.parts.site import SOLID
from refseq_bench.worlds.parts.walk import Walk
from refseq_bench.worlds.plans.footprints import PERSON_RADIUS
from refseq_bench.worlds.plans.load import parse_plan
from refseq_bench.worlds.plans.schema import FloorPlan
from tests.worlds.conftest import SMALL

Text = Callable[..., str]
TWO = """person = [
  { name = "still", at = [2, 0.8], heading = -30, albedo = 0.1 },
  { name = "busy", at = [3, -0.8], walk = [[6.5, -0.8]], height = 1.8 },
]"""


@pytest.fixture(scope="module")
def plan() -> FloorPlan:
    return parse_plan(SMALL.format(top=TWO, end=""))


@pytest.fixture(scope="module")
def model(plan: FloorPlan) -> mujoco.MjModel:
    return build_world(plan, light_named("18:00"), seed=0).spec.compile()


def ray(
    model: mujoco.MjModel, data: mujoco.MjData, start: tuple[float, float, float], along: tuple[float, float]
) -> tuple[float, str]:
    """Distance and name of the solid thing that a level ray meets first."""
    solid, geom = np.zeros(6, np.uint8), np.zeros(1, np.int32)
    solid[SOLID] = 1
    distance = mujoco.mj_ray(model, data, np.array(start), np.array([*along, 0.0]), solid, 1, -1, geom)
    return distance, model.geom(geom[0]).name


def at(model: mujoco.MjModel, plan: FloorPlan, time: float) -> mujoco.MjData:
    data = mujoco.MjData(model)
    Crowd(model, plan).at(data, time)
    mujoco.mj_forward(model, data)
    return data


def test_those_who_walk_are_mocap_bodies_and_those_who_stand_are_of_the_world(model: mujoco.MjModel) -> None:
    assert model.nmocap == len(PARTS)
    for part in ("", ":left-arm", ":right-arm", ":left-leg", ":right-leg"):
        assert model.body(f"person:busy{part}").mocapid[0] >= 0
        assert model.geom(f"person:still{part}").bodyid[0] == 0


@pytest.mark.parametrize(("pictured", "painted"), [(True, [0.1, 0.25]), (False, [0.1])])
def test_who_walks_is_painted_only_for_cameras(
    plan: FloorPlan, monkeypatch: pytest.MonkeyPatch, pictured: bool, painted: list[float]
) -> None:
    """The arms of somebody who stands are drawn after their picture, so that one is always painted."""
    found: list[float] = []
    monkeypatch.setattr(people, "clothes", lambda albedo, rng: found.append(albedo) or clothes(albedo, rng))
    build_world(plan, light_named("18:00"), seed=0, pictured=pictured)
    assert found == painted


@pytest.mark.parametrize("height", [0.2, 0.3, 0.5])
def test_a_laser_sees_two_legs(model: mujoco.MjModel, plan: FloorPlan, height: float) -> None:
    data = at(model, plan, 0.0)
    heading = math.radians(-30)
    for side, leg in ((1, "left"), (-1, "right")):
        foot = np.array([2.0, 0.8]) + side * 0.095 * np.array([-math.sin(heading), math.cos(heading)])
        start = (*(foot + np.array([math.cos(heading), math.sin(heading)])), height)
        distance, name = ray(model, data, start, (-math.cos(heading), -math.sin(heading)))
        assert name == f"person:still:{leg}-leg"
        assert 0.9 < distance < 1.0
    between = (2.0 + math.cos(heading), 0.8 + math.sin(heading), height)
    assert not ray(model, data, between, (-math.cos(heading), -math.sin(heading)))[1].startswith("person")


def test_whoever_walks_is_where_the_clock_says(model: mujoco.MjModel, plan: FloorPlan) -> None:
    walk = Walk.of(plan.person[1])
    for time in (0.0, 0.3, 1.9, 3.5, 40.0):
        data, stance = at(model, plan, time), walk.pose(time)
        assert data.body("person:busy").xpos[:2] == pytest.approx(stance[:2])
        assert data.body("person:busy").xmat[[0, 3]] == pytest.approx(
            (math.cos(stance.heading), math.sin(stance.heading))
        )
        legs = (data.body(f"person:busy:{side}-leg").xpos[:2] for side in ("left", "right"))
        assert np.mean(list(legs), axis=0) == pytest.approx(stance[:2])


def test_the_model_begins_with_everybody_at_time_0(model: mujoco.MjModel, plan: FloorPlan) -> None:
    fresh = mujoco.MjData(model)
    mujoco.mj_forward(model, fresh)
    np.testing.assert_allclose(fresh.xpos, at(model, plan, 0.0).xpos, atol=1e-12)
    np.testing.assert_allclose(fresh.xmat, at(model, plan, 0.0).xmat, atol=1e-12)


def test_feet_come_forward_in_turn_and_meet_the_floor(model: mujoco.MjModel, plan: FloorPlan) -> None:
    walk = Walk.of(plan.person[1])
    steps = walk.stances[1].steps
    middles = (np.arange(steps) + 0.5) / steps * walk.times[1]
    ahead = []
    for time in middles:
        data = at(model, plan, float(time))
        left, right = (low_points(model, data, f"person:busy:{side}-leg") for side in ("left", "right"))
        ahead.append(left[:, 0].mean() - right[:, 0].mean())
        lowest = min(left[:, 2].min(), right[:, 2].min())
        assert -0.08 < lowest < 0.03
    assert np.sign(ahead).tolist() == [ahead[0] / abs(ahead[0]) * (-1) ** k for k in range(steps)]
    assert np.abs(ahead).min() > 0.4


def low_points(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> np.ndarray:
    """The lowest fiftieth of a mesh's corners in the world, (n, 3)."""
    points = in_world(model, data, geom)
    return points[points[:, 2] <= np.quantile(points[:, 2], 0.02)]


def in_world(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> np.ndarray:
    mesh = model.mesh(model.geom(geom).dataid[0])
    corners = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]]
    return corners @ data.geom(geom).xmat.reshape(3, 3).T + data.geom(geom).xpos


def test_people_are_as_tall_as_they_are_said_to_be_and_stay_within_their_radius(
    model: mujoco.MjModel, plan: FloorPlan
) -> None:
    data = at(model, plan, 0.0)
    for person in plan.person:
        names = [g.name for g in map(model.geom, range(model.ngeom)) if g.name.startswith(f"person:{person.name}")]
        points = np.concatenate([in_world(model, data, name) for name in names])
        assert points[:, 2].max() == pytest.approx(person.height, abs=1e-3)
        assert points[:, 2].min() == pytest.approx(0.0, abs=1e-3)
        assert np.linalg.norm(points[:, :2] - person.at, axis=1).max() < PERSON_RADIUS


def test_the_tallest_keep_within_their_radius_to_the_sides_of_their_way(model: mujoco.MjModel, plan: FloorPlan) -> None:
    widest = max(np.abs(skin(part, 1.9).points[:, 1] + part.pivot[0] * 1.9 / 1.74).max() for part in PARTS)
    assert widest < PERSON_RADIUS
    for time in np.linspace(0.0, Walk.of(plan.person[1]).period, 60):
        data = at(model, plan, float(time))
        for part in ("", ":left-leg", ":right-leg", ":left-arm", ":right-arm"):
            points = in_world(model, data, f"person:busy{part}")
            assert 3.0 - PERSON_RADIUS < points[:, 0].min() < points[:, 0].max() < 6.5 + PERSON_RADIUS


def test_the_tallest_who_stand_keep_their_hands_and_feet_within_their_radius(small: Text) -> None:
    places = [(1.0 + 0.6 * k, 0.8 * (-1) ** k) for k in range(10)]
    rows = "".join(f'{{ name = "p{k}", at = [{x}, {y}], height = 1.9 }},\n' for k, (x, y) in enumerate(places))
    plan = parse_plan(small(f"person = [\n{rows}]"))
    model = build_world(plan, light_named("18:00"), seed=0).spec.compile()
    data = at(model, plan, 0.0)
    for person in plan.person:
        names = (f"person:{person.name}{part}" for part in ("", ":left-arm", ":right-arm", ":left-leg", ":right-leg"))
        points = np.concatenate([in_world(model, data, name) for name in names])
        assert np.linalg.norm(points[:, :2] - person.at, axis=1).max() < PERSON_RADIUS


def test_skins_are_closed_and_look_outwards() -> None:
    for part in PARTS:
        shape = skin(part, 1.74)
        corners = shape.points[shape.triangles]  # (m, 3, 3)
        volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
        assert volume > 0.0
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        mean_normal = shape.normals[shape.triangles].mean(axis=1)
        large = np.linalg.norm(facing, axis=1) > 1e-4
        assert (np.einsum("ij,ij->i", facing, mean_normal)[large] > 0.0).mean() > 0.98
        np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=1), 1.0)
    people = sum(skin_volume(part.name) for part in PARTS)
    assert 0.05 < people < 0.1  # somebody of 1.74 m weighs 50 to 100 kg at the density of water


def skin_volume(name: str) -> float:
    part = next(p for p in PARTS if p.name == name)
    shape = skin(part, 1.74)
    a, b, c = np.moveaxis(shape.points[shape.triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize(("name", "time", "place"), [("still", 0.0, (2.0, 0.8)), ("busy", 1.0, (4.2, -0.8))])
def test_a_body_put_on_somebody_touches_them(
    plan: FloorPlan, name: str, time: float, place: tuple[float, float]
) -> None:
    spec = build_world(plan, light_named("18:00"), seed=0).spec
    body = spec.worldbody.add_body(name="probe", pos=[*place, 0.5])
    body.add_freejoint()
    body.add_geom(name="probe", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.1, 0.2])
    model = spec.compile()
    data = at(model, plan, time)
    touched = {model.geom(g).name for c in data.contact for g in c.geom if c.dist < 0.0}
    assert any(other.startswith(f"person:{name}") for other in touched)


def test_people_differ_and_a_seed_fixes_them(plan: FloorPlan, model: mujoco.MjModel) -> None:
    again = build_world(plan, light_named("18:00"), seed=0).spec.compile()
    other = build_world(plan, light_named("18:00"), seed=1).spec.compile()
    assert picture(again, "person:still") == picture(model, "person:still")
    assert picture(other, "person:still") != picture(model, "person:still")
    assert picture(model, "person:busy") != picture(model, "person:still")


def picture(model: mujoco.MjModel, texture: str) -> bytes:
    t = model.texture(texture)
    return model.tex_data[int(t.adr[0]) : int(t.adr[0]) + int(t.height[0] * t.width[0] * t.nchannel[0])].tobytes()


def test_a_crowd_of_nobody_needs_nobody(small: Text) -> None:
    plan = parse_plan(small())
    model = build_world(plan, light_named("18:00"), seed=0).spec.compile()
    data = mujoco.MjData(model)
    Crowd(model, plan).at(data, 1.0)
    assert model.nmocap == len(data.mocap_pos) == 0


@pytest.mark.parametrize(
    ("person", "said"),
    [
        ("at = [4, 1.1]", "person[0]: 'p' comes as near as 0.10 m to wall 'left'; it should keep 0.27 m"),
        (
            "at = [4, -0.7], walk = [[2, -0.7]]",
            "person[0]: 'p' comes as near as 0.15 m to cabinet 'c'; it should keep 0.27 m",
        ),
        ("at = [3, -0.8]", "person[0]: 'p' comes as near as 0.05 m to cabinet 'c'; it should keep 0.27 m"),
        ("at = [4, 0], walk = [[4, 0]]", "person[0].walk: ((4.0, 0.0),) is not valid; no point should follow itself"),
        ("at = [4, 0], height = 2.1", "person[0].height: 2.1 is not valid; it should be less than or equal to 1.9"),
    ],
)
def test_people_in_a_plan_stand_where_they_can(small: Text, person: str, said: str) -> None:
    cabinet = 'cabinet = [{ name = "c", wall = "right", at = 3, material = "door" }]\n'
    with pytest.raises(PlanError) as caught:
        parse_plan(small(cabinet + f'person = [{{ name = "p", {person} }}]'))
    assert str(caught.value) == f"plan.toml: {said}"
