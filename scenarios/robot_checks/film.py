"""Film of a drive as a bystander sees it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import RobotState
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.chase_camera import ChaseCamera, with_chase_camera
from refseq_bench.sim.drives.operator import OperatorStyle
from refseq_bench.sim.drives.recorder import operator_for
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan


@dataclass(frozen=True, slots=True)
class FilmedDrive:
    """A drive to watch: ``seconds`` of it, in so many ``frames``, at a mean ``speed`` [m/s]."""

    robot: str
    world: str
    route: str = "forward"
    light: str = "16:00"
    seconds: float = 60.0
    frames: int = 12
    speed: float = 0.4
    seed: int = 1
    renderer: RendererKind = DEFAULT_RENDERER

    def __post_init__(self) -> None:
        if not (math.isfinite(self.seconds) and self.seconds > 0):
            raise ScenarioError(f"seconds {self.seconds:g} is not valid; it should be a time above 0")
        if not self.frames >= 2:
            raise ScenarioError(f"frames {self.frames} is not valid; it should be 2 or more")
        if not (math.isfinite(self.speed) and self.speed > 0):
            raise ScenarioError(f"speed {self.speed:g} is not valid; it should be above 0 m/s")


@dataclass(frozen=True, slots=True)
class DriveFrame:
    """A bystander's picture at one ``time`` [s], and the robot's state.

    ``pitches`` are the least and the greatest that it told of since the frame before [rad].
    """

    time: float
    image: NDArray[np.uint8]
    pose: Pose
    state: RobotState
    pitches: tuple[float, float]


def film(strip: FilmedDrive) -> Iterator[DriveFrame]:
    """Lead the robot along the route, and look at it at equal times, the last when it has come to the route's end."""
    robot = robots.load(strip.robot)
    world = with_chase_camera(build_world(load_plan(strip.world), light_named(strip.light), 0))
    settings = BenchSettings(renderer=strip.renderer, cameras=())
    with Bench(world, robot, route=strip.route, seed=strip.seed, settings=settings) as bench:
        style = OperatorStyle(speed=strip.speed, max_speed=max(1.25 * strip.speed, 0.5))
        operator, chase_camera = operator_for(bench, strip.seed, style), ChaseCamera(bench)
        for time in np.linspace(0.0, strip.seconds, strip.frames):
            pitches = [bench.state.pitch]
            while bench.time < time - 1e-9:
                bench.drive(operator.command(bench.time, bench.pose))
                pitches.append(bench.state.pitch)
            yield DriveFrame(bench.time, chase_camera.look(), bench.pose, bench.state, (min(pitches), max(pitches)))
            if operator.finished:
                return
