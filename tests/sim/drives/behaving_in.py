"""Worlds in which behaviours are run, and what is looked at: where the robot went by truth, and what it touched."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots.behaviours import Behaviour, BehaviourOutcome
from refseq_bench.robots.behaviours.written import make_behaviour, parse_behaviour
from refseq_bench.robots.individual import RobotSpread
from refseq_bench.robots.odometry import CalibrationErrors
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_runner import BehaviourEnd, BehaviourMoment, description_of, run
from refseq_bench.sim.drives.doors import doors_to_cross
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import PLAIN

PERFECT = BenchSettings(RendererKind.NONE, spread=RobotSpread(CalibrationErrors(0.0, 0.0, 0.0)))
"""A robot that knows its wheels: what is off then is the behaviour's."""

PLAN = (
    'name = "long"'
    + PLAIN
    + """[material]
plaster = {{ albedo = 0.7, roughness = 0.9 }}
metal = {{ albedo = 0.4, roughness = 0.5 }}
door = {{ albedo = 0.3, roughness = 0.5 }}
[[wall]]
name = "left"
start = [0, 1.2]
end = [{left}, 1.2]
inside = "right"
material = "plaster"
[[wall]]
name = "right"
start = [0, -1.2]
end = [{length}, -1.2]
inside = "left"
material = "plaster"
[[wall]]
name = "start"
start = [0, -1.2]
end = [0, 1.2]
inside = "right"
material = "plaster"
[[wall]]
name = "end"
start = [{length}, -1.2]
end = [{length}, 1.2]
inside = "left"
material = "plaster"
{things}
[routes]
forward = [[2, 0], [3, 0]]
"""
)

BOX = (
    '[[furniture]]\nname = "box"\nkind = "box"\nat = [{x}, {y}]\nwidth = 0.5\ndepth = 0.5\nheight = 1\nmaterial="metal"'
)


def corridor(length: float = 12, things: str = "", left: float | None = None) -> World:
    """A corridor along x, walls at y = ±1.2 m and at both ends; the ``left`` wall may end earlier."""
    plan = PLAN.format(length=length, left=length if left is None else left, things=things)
    return build_world(parse_plan(plan), light_named("16:00"), pictured=False)


@dataclass(frozen=True)
class Behaved:
    """How a behaviour ended, where the robot stood 1 s later, what it touched but the floor, what it waited for."""

    ended: BehaviourEnd
    rest: Pose
    touched: frozenset[str]
    waited: frozenset[str]


def behaved(
    world: World,
    robot: str,
    what: str | Behaviour,
    start: tuple[float, float, float] = (2.0, 0.0, 0.0),
    *,
    timeout: float = 120.0,
) -> Behaved:
    """Run a behaviour, given as it is written, from a start at (x, y, heading)."""
    with Bench(world, robots.load(robot), settings=PERFECT) as bench:
        bench.place(Pose(*start))
        touched: set[str] = set()
        behaviour = (
            make_behaviour(parse_behaviour(what), description_of(bench.robot), doors_to_cross)
            if isinstance(what, str)
            else what
        )
        waited: set[str] = set()

        def each(moment: BehaviourMoment) -> None:
            touched.update(touches(bench))
            if moment.step.why and moment.step.outcome is BehaviourOutcome.RUNNING:
                waited.add(moment.step.why)

        ended = run(bench, behaviour, timeout=timeout, each=each)
        for _ in range(25):
            bench.wait()
        return Behaved(ended, bench.pose, frozenset(touched), frozenset(waited))


def touches(bench: Bench) -> set[str]:
    """Names of the geoms of the world, but of its floor, that the robot touches now."""
    contacts = bench.data.contact.geom
    names = np.array([bench.model.geom(i).name for i in range(bench.model.ngeom)])[contacts]
    mine = np.char.startswith(names.astype(str), f"{bench.robot.name}/")
    met = names[mine[:, 0] != mine[:, 1]]
    return {name for name in met.ravel() if not name.startswith((f"{bench.robot.name}/", "floor"))}


def off(path: NDArray[np.float64], side: int, distance: float, along: tuple[float, float]) -> NDArray[np.float64]:
    """How far (n,) [m] a path is off its distance from the wall at y = ``side`` · 1.2 m, between two x."""
    first, last = along
    on_it = path[(path[:, 0] > first) & (path[:, 0] < last)]
    return 1.2 - side * on_it[:, 1] - distance
