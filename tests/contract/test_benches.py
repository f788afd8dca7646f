"""What holds for every world, in every light, with every robot."""

import math
from collections.abc import Iterator
from functools import cache, lru_cache

import mujoco
import numpy as np
import pytest

from refseq.view import LASER
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.recorder import operator_for
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.beams import SEEN_GROUPS
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.change.change import change_named, changed
from refseq_bench.worlds.light import light_named, light_names
from refseq_bench.worlds.plans.load import load_plan, world_names

BLIND = BenchSettings(renderer=RendererKind.NONE)
BRISK = OperatorStyle(speed=0.5, max_speed=0.6)
"""Somebody who leads a robot along faster than for a recording, as fast as the slower one goes."""
PICTORIAL = ("tex_", "mat_", "light_", "name", "paths")
"""Beginnings of a model's arrays that hold pictures and light, and of those that hold names and where they are."""
BODILY = ("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_contype", "geom_conaffinity", "body_mass")
"""Arrays of a model that decide on motion and ranges; the light must not touch them."""

LIGHTS = ("16:00", "late-evening")
"""One by day and one by lamps; every preset and any hour between differ from these in numbers only."""

worlds = pytest.mark.parametrize("world", world_names())
PICTURED = ("annex", "car-park", "hallway")
"""Worlds whose pictures are drawn each time: small, in the open, and with most of what a floor has."""
pictured_worlds = [
    pytest.param(world, marks=[] if world in PICTURED else [pytest.mark.slow]) for world in world_names()
]
MACHINES = ("robuter", "segway_rmp")
"""One robot of each kind; what differs in how it is driven alone meets the worlds no other way."""
worlds_and_robots = pytest.mark.parametrize(
    ("world", "robot"), [(world, robot) for world in world_names() for robot in MACHINES]
)


@cache
def built(name: str, light: str, pictured: bool = False) -> World:
    return build_world(load_plan(name), light_named(light), seed=0, pictured=pictured)


@lru_cache(maxsize=1)
def built_again(name: str, pictured: bool) -> World:
    """The same world, put up once more."""
    return build_world(load_plan(name), light_named(LIGHTS[0]), seed=0, pictured=pictured)


@lru_cache(maxsize=1)
def busy(name: str) -> World:
    """The world on a day when much has changed."""
    return build_world(changed(load_plan(name), change_named("busy"), seed=3), light_named(LIGHTS[0]), pictured=False)


@cache
def model_of(world: str, light: str, robot: str) -> mujoco.MjModel:
    """The model of a bench, which nobody changes."""
    with Bench(built(world, light), robots.load(robot), settings=BLIND) as bench:
        return bench.model


def test_there_is_something_to_try() -> None:
    assert set(world_names()) >= {"annex", "car-park", "hallway", "laboratory", "second-floor"}
    assert set(MACHINES) <= set(robots.names())
    assert set(light_names()) >= set(LIGHTS)


@worlds_and_robots
def test_every_combination_has_what_the_robot_names(world: str, robot: str) -> None:
    model, loaded, prefix = model_of(world, LIGHTS[0], robot), robots.load(robot), f"{robot}/"
    assert model.body(prefix + loaded.base).id > 0
    assert model.site(prefix + loaded.laser).id >= 0
    assert len({model.camera(prefix + camera).id for camera in loaded.cameras}) == len(loaded.cameras)
    assert LASER not in loaded.cameras
    for joint, actuator in zip(loaded.wheel_joints, loaded.wheel_actuators, strict=True):
        assert model.actuator(prefix + actuator).trnid[0] == model.joint(prefix + joint).id


@worlds
def test_every_world_holds_nothing_that_a_robot_could_be_mistaken_for(world: str) -> None:
    spec = built(world, LIGHTS[0]).spec
    found = [element.name for element in (*spec.bodies, *spec.cameras, *spec.sites)]
    assert not [name for name in found if name.startswith(tuple(f"{robot}/" for robot in robots.names()))]


@pytest.mark.quick_cases("hallway-robuter", "annex-segway_rmp")
@worlds_and_robots
def test_light_changes_what_is_seen_and_nothing_that_is_touched(world: str, robot: str) -> None:
    one, other = (model_of(world, light, robot) for light in LIGHTS)
    for key in BODILY:
        solid, same = (np.isin(model.geom_group, np.flatnonzero(SEEN_GROUPS)) for model in (one, other))
        rows = (solid, same) if key.startswith("geom") else (slice(None), slice(None))
        assert np.array_equal(getattr(one, key)[rows[0]], getattr(other, key)[rows[1]]), key
    assert one.light_intensity.tolist() != other.light_intensity.tolist()


@pytest.mark.quick_cases("annex")
@pytest.mark.parametrize("world", pictured_worlds)
def test_pictures_change_what_is_seen_and_nothing_else(world: str) -> None:
    one, other = (built(world, LIGHTS[0], pictured).spec.compile() for pictured in (True, False))
    for key in (key for key in dir(one) if not key.startswith(("_", *PICTORIAL))):
        if isinstance(value := getattr(one, key), np.ndarray):
            assert np.array_equal(value, getattr(other, key)), key
    assert one.ntex > other.ntex
    assert {one.geom(geom).name for geom in range(one.ngeom)} == {other.geom(geom).name for geom in range(other.ngeom)}


@pytest.mark.quick_cases("annex")
@pytest.mark.parametrize("world", pictured_worlds)
def test_the_same_seed_draws_the_same_pictures(world: str) -> None:
    once, again = built(world, LIGHTS[0], pictured=True), built_again(world, pictured=True)
    models = [one.spec.compile() for one in (once, again)]
    for key in ("tex_data", "mat_rgba", "light_pos", "light_dir", "light_intensity"):
        assert np.array_equal(getattr(models[0], key), getattr(models[1], key)), key


@pytest.mark.quick_cases("hallway-robuter", "annex-segway_rmp")
@worlds_and_robots
def test_the_same_seed_builds_the_same_bench(world: str, robot: str) -> None:
    models, scans = [], []
    for one in (built(world, LIGHTS[0]), built_again(world, pictured=False)):
        with Bench(one, robots.load(robot), seed=5, settings=BLIND) as bench:
            models.append(bench.model)
            scan = bench.sense().scan
            assert scan is not None
            scans.append(scan.ranges.tobytes())
    assert scans[0] == scans[1]
    for key in (*BODILY, "mat_rgba", "light_pos", "light_dir", "light_intensity"):
        assert np.array_equal(getattr(models[0], key), getattr(models[1], key)), key


QUICK = {("laboratory", "forward", robot) for robot in MACHINES}
"""Drives of the quick run; the others, of minutes each, wait for the slow one: that a body fits along each route is
tested in tests/worlds/test_check.py, and the first 30 s of each world are driven below, on a busy day."""


def routes() -> Iterator[object]:
    """Every route of every world, with both machines."""
    for world in world_names():
        for route in load_plan(world).routes:
            for robot in MACHINES:
                marks = [] if (world, route, robot) in QUICK else [pytest.mark.slow]
                yield pytest.param(world, route, robot, marks=marks)


def test_the_quick_drives_are_some_of_all() -> None:
    assert {tuple(param.values) for param in routes()} > QUICK


@pytest.mark.quick_cases("laboratory-forward-robuter")
@pytest.mark.parametrize(("world", "route", "robot"), list(routes()))
def test_every_route_can_be_driven_to_its_end_without_touching_a_thing(world: str, route: str, robot: str) -> None:
    place = built(world, LIGHTS[0])
    with Bench(place, robots.load(robot), route=route, seed=1, settings=BLIND) as bench:
        operator = operator_for(bench, 1, BRISK)
        limit, touched = 4 * operator.length / 0.4, set()
        while not operator.finished and bench.time < limit:
            bench.drive(operator.command(bench.time, bench.pose))
            touched |= touching(bench)
        assert operator.finished
        end = place.routes[route][-1]
        assert math.dist((bench.pose.x, bench.pose.y), end) < 0.3
    assert touched == {"floor"}, "a robot touches the floor with its wheels, and nothing else"


@pytest.mark.quick_cases("hallway-robuter")
@pytest.mark.parametrize(
    ("world", "robot"),
    [
        pytest.param(world, robot, marks=[] if robot == "robuter" or world == "hallway" else [pytest.mark.slow])
        for world in world_names()
        for robot in MACHINES
    ],
)
def test_on_a_busy_day_the_robot_still_has_room(world: str, robot: str) -> None:
    with Bench(busy(world), robots.load(robot), seed=1, settings=BLIND) as bench:
        operator, touched = operator_for(bench, 1, BRISK), set()
        while not operator.finished and bench.time < 30.0:
            bench.drive(operator.command(bench.time, bench.pose))
            touched |= touching(bench)
        assert operator.progress > 10.0
    assert touched == {"floor"}


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


def test_the_watch_for_collisions_sees_one() -> None:
    with Bench(built("hallway", LIGHTS[0]), robots.load("robuter"), settings=BLIND) as bench:
        joint = bench.data.joint("robuter/base")
        joint.qpos[1] = 1.0  # into the wall at y = 1.2 m
        mujoco.mj_forward(bench.model, bench.data)
        assert any(name.startswith("base against") for name in touching(bench))
