"""Parts of a bench before it runs: the compiled model, the route, the random streams of the sensors."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench.robots import Robot
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.filament import prepare_spec
from refseq_bench.worlds.build import World

OPTIONS = ("timestep", "integrator", "cone", "impratio")
"""Physics options that the robot's model asks for: the world takes them over."""


class SensorStreams(NamedTuple):
    """Generators of the sensors' noise, cameras by name."""

    laser: np.random.Generator
    cameras: Mapping[str, np.random.Generator]
    sonar: np.random.Generator
    inertial: np.random.Generator
    rolling: np.random.Generator


def streams_of(seed: int, robot: Robot) -> SensorStreams:
    """Spawn a stream for each sensor of a robot, also for cameras that take no images: none changes another's noise.

    Raises ``SimError`` for a seed below 0.
    """
    if seed < 0:
        raise SimError(f"bench: seed = {seed} is not valid; it should be 0 or more")
    laser, *cameras, sonar, inertial, rolling = map(
        np.random.default_rng, np.random.SeedSequence(seed).spawn(4 + len(robot.cameras))
    )
    return SensorStreams(laser, dict(zip(robot.cameras, cameras, strict=True)), sonar, inertial, rolling)


def prefix_of(robot: Robot) -> str:
    """The beginning of all of a robot's names in the model."""
    return f"{robot.name}/"


def compile_model(world: World, robot: Robot, cameras: Mapping[str, CameraModel]) -> mujoco.MjModel:
    """Compile the world with the robot in it, whose names begin with ``prefix_of(robot)``; both stay as they are."""
    spec = world.spec.copy()
    for option in OPTIONS:
        setattr(spec.option, option, getattr(robot.spec.option, option))
    # A copy: what was attached once cannot be attached again, and MuJoCo crashes on compiling it by itself.
    spec.attach(robot.spec.copy(), frame=spec.worldbody.add_frame(), prefix=prefix_of(robot))
    picture = spec.visual.global_
    for name, model in cameras.items():
        mounted, pinhole = spec.camera(prefix_of(robot) + name), model.optics().pinhole
        mounted.fovy, mounted.resolution = pinhole.fovy, (pinhole.width, pinhole.height)
        mounted.sensor_size = (0.0, 0.0)  # else it would set the field of view
        picture.offwidth = max(picture.offwidth, pinhole.width)
        picture.offheight = max(picture.offheight, pinhole.height)
    prepare_spec(spec)
    return spec.compile()


def route_named(world: World, name: str) -> NDArray[np.float64]:
    """Find a route of the world (n, 2) [m] by its name; raises ``SimError`` for an unknown one."""
    if name not in world.routes:
        raise SimError(f"unknown route {name!r} in world {world.name!r}: valid are {', '.join(world.routes)}")
    return world.routes[name]


def start_of(route: NDArray[np.float64]) -> Pose:
    """A route's first point, facing its second."""
    (x, y), (ahead_x, ahead_y) = route[:2]
    return Pose(float(x), float(y), math.atan2(ahead_y - y, ahead_x - x))
