"""Rays at the few geoms that they may meet, against MuJoCo's own cast at all of them: the same bits."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.beams import GLASS_GROUPS, SEEN_GROUPS
from refseq_bench.sim.sensors.ray_scene import RayScene, SceneHits
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan

ALL_GROUPS = np.ones(6, np.uint8)
Floats = NDArray[np.float64]


def plain(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    origins: NDArray,
    rays: NDArray,
    groups: NDArray,
    blind: int,
    reach: float,
) -> SceneHits:
    """Cast each bundle at all geoms of the model."""
    shape = rays.shape[:2]
    distance, geom, normal = np.empty(shape), np.empty(shape, np.int32), np.zeros(rays.shape)
    for bundle, origin in enumerate(origins):
        flat, facing = rays[bundle].ravel(), normal[bundle].reshape(-1)
        out = geom[bundle], distance[bundle], facing
        mujoco.mj_multiRay(model, data, origin, flat, groups, True, blind, *out, shape[1], reach)
    met = (geom >= 0) & (distance <= reach)
    distance[~met], geom[~met], normal[~met] = np.inf, -1, 0.0
    return SceneHits(distance, geom, normal)


def bundles(rng: np.random.Generator, width: float) -> NDArray[np.float64]:
    """Unit vectors (4, 60, 3) about four directions, level more or less, apart by a width [rad] or wholly at random."""
    rays = rng.normal(size=(4, 1, 3)) * (1.0, 1.0, 0.2) + width * rng.normal(size=(4, 60, 3))
    return np.asarray(rays / np.linalg.norm(rays, axis=2, keepdims=True))


def assert_same(model: mujoco.MjModel, data: mujoco.MjData, scene: RayScene, seed: int, width: float) -> int:
    """Compare the two casts in one draw of all there is to draw; returns how many rays met something."""
    rng = np.random.default_rng(seed)
    groups = (SEEN_GROUPS, GLASS_GROUPS, SEEN_GROUPS | GLASS_GROUPS, ALL_GROUPS)[seed % 4]
    blind, reach = int(rng.integers(-1, model.nbody)), (0.5, 3.0, 15.0, 90.0)[seed // 4 % 4]
    about = data.geom_xpos[rng.integers(model.ngeom)]
    origins, rays = about + rng.normal(size=(4, 3)) * (2.0, 2.0, 0.5), bundles(rng, width)
    scene.look(data, groups, blind)
    found, expected = scene.cast(origins, rays, reach), plain(model, data, origins, rays, groups, blind, reach)
    np.testing.assert_array_equal(found.geom, expected.geom)
    np.testing.assert_array_equal(found.distance, expected.distance)
    np.testing.assert_array_equal(found.normal, expected.normal)
    return int((expected.geom >= 0).sum())


@pytest.mark.parametrize("name", ["laboratory", "offices"])
@pytest.mark.parametrize("robot", ["robuter", "segway_rmp"])
def test_the_same_hits_as_of_all_geoms_in_worlds(name: str, robot: str) -> None:
    world = build_world(load_plan(name), light_named("16:00"), 0, pictured=False)
    with Bench(world, robots.load(robot), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        scene = RayScene(bench.model, few=0)
        met = [assert_same(bench.model, bench.data, scene, seed, (0.02, 0.3, 3.0)[seed % 3]) for seed in range(48)]
    assert sum(met) > 1000


KINDS = ("PLANE", "SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX", "MESH")


def jumble(rng: np.random.Generator) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Geoms of all kinds on turned bodies, some of which move or are painted, in all groups; a few cannot be seen."""
    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", uservert=rng.normal(size=(12, 3)).ravel())
    spec.add_material(name="clear", rgba=(1, 1, 1, 0))
    spec.add_material(name="wood", rgba=(1, 1, 1, 1))
    for number in range(12):
        body = spec.worldbody.add_body(pos=rng.normal(size=3) * 4, quat=rng.normal(size=4), mocap=number % 3 == 0)
        for _ in range(4):
            kind = getattr(mujoco.mjtGeom, f"mjGEOM_{rng.choice(KINDS[1:])}")
            geom = body.add_geom(
                type=kind, size=rng.uniform(0.05, 1, 3), pos=rng.normal(size=3), quat=rng.normal(size=4)
            )
            geom.group = int(rng.integers(6))
            geom.meshname = "mesh" if kind == mujoco.mjtGeom.mjGEOM_MESH else ""
            geom.material = str(rng.choice(["", "", "wood", "clear"]))
            geom.rgba = (1, 1, 1, rng.choice([0.0, 0.5, 1.0]))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(5, 5, 1), pos=(0, 0, -3), group=0)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from([0.01, 0.2, 1.0, 10.0]))
def test_the_same_hits_as_of_all_geoms_of_all_kinds(seed: int, width: float) -> None:
    rng = np.random.default_rng(seed)
    model, data = jumble(rng)
    scene = RayScene(model, few=0)
    assert_same(model, data, scene, seed, width)
    data.mocap_pos[:] += rng.normal(size=data.mocap_pos.shape)
    mujoco.mj_forward(model, data)
    assert_same(model, data, scene, seed + 1, width)
    assert_same(model, data, RayScene(model), seed + 1, width)


def test_few_geoms_are_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bundle of a narrow angle among a hundred pillars is cast at a tenth of them."""
    spec = mujoco.MjSpec()
    for number in range(100):
        angle = number * 2 * np.pi / 100
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.05, 0.05, 1), pos=(5 * np.cos(angle), 5 * np.sin(angle), 0)
        )
    model = spec.compile()
    data, handed = mujoco.MjData(model), []
    mujoco.mj_forward(model, data)
    cast = mujoco.mj_multiRay

    def counting(cast_in: mujoco.MjModel, *rest: object) -> None:
        handed.append(int(cast_in.body_geomnum.sum()))
        cast(cast_in, *rest)

    monkeypatch.setattr(mujoco, "mj_multiRay", counting)
    scene = RayScene(model, few=0)
    scene.look(data, ALL_GROUPS, -1)
    bearings = np.radians(np.linspace(10, 30, 41))
    rays = np.stack([np.cos(bearings), np.sin(bearings), np.zeros(41)], axis=1)[None]
    hits = scene.cast(np.zeros((1, 3)), rays, 10.0)
    assert handed[0] <= 10
    assert 5 <= len(set(hits.geom[hits.geom >= 0].tolist())) <= handed[0]
