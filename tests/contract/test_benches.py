"""What holds for every world, in every light, with every robot."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

import robots
from refseq.view import LASER
from sim.beams import SEEN_GROUPS
from sim.bench import Bench, BenchSettings
from sim.recorder import operator_for
from sim.render import RendererKind
from worlds.build import World, build
from worlds.light import light_named, light_names
from worlds.plan import load_plan
from worlds.plan import names as world_names

BLIND = BenchSettings(renderer=RendererKind.NONE)
BODILY = ("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_contype", "geom_conaffinity", "body_mass")
"""Arrays of a model that decide on motion and ranges; the light must not touch them."""

worlds_and_robots = pytest.mark.parametrize(
    ("world", "robot"), [(world, robot) for world in world_names() for robot in robots.names()]
)


@pytest.fixture(scope="module")
def built() -> dict[tuple[str, str], World]:
    return {
        (name, light): build(load_plan(name), light_named(light), seed=0)
        for name in world_names()
        for light in light_names()
    }


@pytest.fixture(scope="module")
def models(built: dict[tuple[str, str], World]) -> dict[tuple[str, str, str], mujoco.MjModel]:
    """The compiled model of every world, light and robot."""
    found = {}
    for (name, light), world in built.items():
        for robot in robots.names():
            with Bench(world, robots.load(robot), settings=BLIND) as bench:
                found[name, light, robot] = bench.model
    return found


def test_there_is_something_to_try() -> None:
    assert "hallway" in world_names()
    assert "robuter" in robots.names()
    assert set(light_names()) >= {"16:00", "18:00", "late-evening"}


def test_every_combination_has_what_the_robot_names(models: dict[tuple[str, str, str], mujoco.MjModel]) -> None:
    for (_, _, name), model in models.items():
        robot, prefix = robots.load(name), f"{name}/"
        assert model.body(prefix + robot.base).id > 0
        assert model.site(prefix + robot.laser).id >= 0
        assert len({model.camera(prefix + camera).id for camera in robot.cameras}) == len(robot.cameras)
        assert LASER not in robot.cameras
        for joint, actuator in zip(robot.wheel_joints, robot.wheel_actuators, strict=True):
            assert model.actuator(prefix + actuator).trnid[0] == model.joint(prefix + joint).id


def test_every_world_holds_nothing_that_a_robot_could_be_mistaken_for(built: dict[tuple[str, str], World]) -> None:
    for world in built.values():
        found = [element.name for element in (*world.spec.bodies, *world.spec.cameras, *world.spec.sites)]
        assert not [name for name in found if name.startswith(tuple(f"{robot}/" for robot in robots.names()))]


def test_light_changes_what_is_seen_and_nothing_that_is_touched(
    models: dict[tuple[str, str, str], mujoco.MjModel],
) -> None:
    for world in world_names():
        for robot in robots.names():
            by_light = [models[world, light, robot] for light in light_names()]
            for model in by_light[1:]:
                for key in BODILY:
                    solid = np.isin(by_light[0].geom_group, np.flatnonzero(SEEN_GROUPS))
                    other = np.isin(model.geom_group, np.flatnonzero(SEEN_GROUPS))
                    rows = (solid, other) if key.startswith("geom") else (slice(None), slice(None))
                    assert np.array_equal(getattr(by_light[0], key)[rows[0]], getattr(model, key)[rows[1]]), key
            shining = [(model.light_intensity.tolist(), model.light_diffuse.tolist()) for model in by_light]
            assert all(one != other for k, one in enumerate(shining) for other in shining[:k])


@worlds_and_robots
def test_the_same_seed_builds_the_same_bench(world: str, robot: str, built: dict[tuple[str, str], World]) -> None:
    light = light_names()[0]
    models, scans = [], []
    for one in (built[world, light], build(load_plan(world), light_named(light), seed=0)):
        with Bench(one, robots.load(robot), seed=5, settings=BLIND) as bench:
            models.append(bench.model)
            scan = bench.sense().scan
            assert scan is not None
            scans.append(scan.ranges.tobytes())
    assert scans[0] == scans[1]
    for key in (*BODILY, "tex_data", "mat_rgba", "light_pos", "light_dir", "light_intensity"):
        assert np.array_equal(getattr(models[0], key), getattr(models[1], key)), key


def routes() -> Iterator[tuple[str, str, str]]:
    for world in world_names():
        for route in load_plan(world).routes:
            for robot in robots.names():
                yield world, route, robot


@pytest.mark.parametrize(("world", "route", "robot"), list(routes()))
def test_every_route_can_be_driven_to_its_end_without_touching_a_thing(
    world: str, route: str, robot: str, built: dict[tuple[str, str], World]
) -> None:
    place = built[world, light_names()[0]]
    with Bench(place, robots.load(robot), route=route, seed=1, settings=BLIND) as bench:
        operator = operator_for(bench, 1)
        limit, touched = 4 * operator.length / 0.4, set()
        while not operator.finished and bench.time < limit:
            bench.drive(operator.command(bench.time, bench.pose))
            touched |= touching(bench)
        assert operator.finished
        end = place.routes[route][-1]
        assert math.dist((bench.pose.x, bench.pose.y), end) < 0.3
    assert touched == {"floor"}, "a robot touches the floor with its wheels, and nothing else"


def touching(bench: Bench) -> set[str]:
    """Names of what touches the robot; the robot's base is named as well where that is what is touched."""
    model, prefix = bench.model, f"{bench.robot.name}/"
    base = model.body(prefix + bench.robot.base).id
    found = set()
    for pair in bench.data.contact.geom:
        bodies = [int(model.geom_bodyid[geom]) for geom in pair]
        ours = [model.body(body).name.startswith(prefix) for body in bodies]
        for body, own, other in zip(bodies, ours, pair[::-1], strict=True):
            if own and body == base:
                found.add(f"base against {model.geom(other).name}")
            elif own:
                found.add(str(model.geom(other).name))
    return found


def test_the_watch_for_collisions_sees_one(built: dict[tuple[str, str], World]) -> None:
    with Bench(built["hallway", light_names()[0]], robots.load("robuter"), settings=BLIND) as bench:
        joint = bench.data.joint("robuter/base")
        joint.qpos[1] = 1.0  # into the wall at y = 1.2 m
        mujoco.mj_forward(bench.model, bench.data)
        assert any(name.startswith("base against") for name in touching(bench))
