"""Two rooms with a door between them, drives through it, and what the truth says of each."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots.behaviours import BehaviourOutcome, RobotDescription
from refseq_bench.robots.behaviours.cross_door import CrossDoor, CrossingSide
from refseq_bench.robots.behaviours.guarded import PATIENCE
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_runner import BehaviourMoment, description_of, run
from refseq_bench.sim.drives.doors import doors_to_cross
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import PLAIN

THICK = 0.15
BLIND = BenchSettings(renderer=RendererKind.NONE)
CLOSE = 0.3
"""Distances above this are not told apart [m]."""

ROOMS = (
    """
name = "rooms"
wall = [
  {{ name = "front", start = [0, -{side}], end = [0, 2], inside = "left", material = "plaster" }},
  {{ name = "left", start = [0, 2], end = [-4, 2], inside = "left", material = "plaster" }},
  {{ name = "back", start = [-4, 2], end = [-4, -{side}], inside = "left", material = "plaster" }},
  {{ name = "right", start = [-4, -{side}], end = [0, -{side}], inside = "left", material = "plaster" }},
  {{ name = "far", start = [4.5, 2], end = [4.5, -{side}], inside = "right", material = "plaster" }},
]
{door}
{end}"""
    + PLAIN
    + """[material]
plaster = {{ albedo = 0.7, roughness = 0.9 }}
door = {{ albedo = 0.3, roughness = 0.5 }}
[routes]
forward = [[-1.7, 0], [0, 0]]
"""
)


def rooms(door: str | None = "open = 100", *, side: float = 2.0, end: str = "") -> World:
    """A room from x = −4 to 0 m, and behind a door in the middle of the wall x = 0 a bare one, 2.1 m wide, 3.5 m deep.

    ``side`` is how far to the right of the door's middle the room ends [m], ``door`` what its table says.
    """
    hung = "" if door is None else f'[[door]]\nname = "d"\nwall = "front"\nat = {side}\ndepth = 3.5\n{door}'
    plan = parse_plan(ROOMS.format(side=side, door=hung, end=end))
    return build_world(plan, light_named("16:00"), pictured=False)


def starts(rng: np.random.Generator, count: int) -> list[Pose]:
    """Starts 1.5 to 2 m before the door, up to 0.4 m beside its axis, heading up to 25° off it."""
    return [
        Pose(-rng.uniform(1.5, 2.0), rng.uniform(-0.4, 0.4), math.radians(rng.uniform(-25, 25))) for _ in range(count)
    ]


CORNERS = (Pose(-1.5, 0.4, math.radians(25)), Pose(-1.5, -0.4, math.radians(-25)), Pose(-2.0, 0.4, math.radians(-25)))
"""Starts at the corners of that range: near and looking away from the door to either side, and far across."""


def from_behind(start: Pose) -> Pose:
    """The start in the room behind the door that is as far from the wall's other face."""
    return Pose(THICK - start.x, -start.y, start.heading + math.pi)


@dataclass(frozen=True, slots=True)
class Crossing:
    """How a drive ended, where by the truth, what it touched, and how near it came to walls and leaves [m].

    ``waited`` is what it waited for on its way.
    """

    outcome: BehaviourOutcome
    why: str
    time: float
    end: Pose
    touched: frozenset[str]
    clearance: float
    waited: frozenset[str]

    @property
    def good(self) -> bool:
        """Whether the robot says that it is through and has touched nothing."""
        return self.outcome is BehaviourOutcome.FINISHED and not self.touched


class Doorkeeper:
    """Watches a robot: what it touches that it does not roll on, and its least distance to what stands there."""

    def __init__(self, bench: Bench) -> None:
        self._bench, model = bench, bench.model
        prefix = f"{bench.robot.name}/"
        solid = [geom for geom in map(model.geom, range(model.ngeom)) if geom.contype[0] or geom.conaffinity[0]]
        self._own = [geom.id for geom in solid if model.body(geom.bodyid[0]).name.startswith(prefix)]
        self._floor = model.geom("floor").id
        # What rolls hangs on a joint of its own: wheels and casters.
        base = model.body(prefix + bench.robot.base).id
        self._rolls = {geom for geom in self._own if model.geom_bodyid[geom] != base}
        self._others = np.array([geom.id for geom in solid if geom.id not in {*self._own, self._floor}])
        self._mine = np.zeros(model.ngeom, bool)
        self._mine[self._own] = True
        self.touched: set[str] = set()
        self.clearance = CLOSE

    def look(self) -> None:
        """Look at the robot as it stands now."""
        for pair in self._bench.data.contact.geom:
            own, other = sorted(pair.tolist(), key=lambda geom: not self._mine[geom])
            if not self._mine[own] or self._mine[other] or (other == self._floor and own in self._rolls):
                continue
            self.touched.add(self._bench.model.geom(other).name)
        model, data = self._bench.model, self._bench.data
        away = np.hypot(*(data.geom_xpos[self._others, :2] - (self._bench.pose.x, self._bench.pose.y)).T)
        near = self._others[away < model.geom_rbound[self._others] + 1.5]
        gaps = (
            mujoco.mj_geomDistance(model, data, own, int(other), CLOSE, None) for other in near for own in self._own
        )
        self.clearance = min(self.clearance, min(gaps, default=CLOSE))


@contextmanager
def standing(world: World, name: str) -> Iterator[Bench]:
    """A robot in a world, without cameras."""
    with Bench(world, robots.load(name), seed=3, settings=BLIND) as bench:
        yield bench


@cache
def _frame(name: str) -> RobotDescription:
    return description_of(robots.load(name))


def cross(
    bench: Bench,
    start: Pose,
    side: CrossingSide = CrossingSide.AHEAD,
    patience: float = PATIENCE,
    meanwhile: Callable[[], None] = lambda: None,
) -> Crossing:
    """Carry the robot to ``start`` and let it cross a door, or say in less than 90 s why not."""
    bench.place(start)
    keeper = Doorkeeper(bench)
    waited: set[str] = set()

    def each(moment: BehaviourMoment) -> None:
        keeper.look()
        if moment.step.outcome is BehaviourOutcome.RUNNING and moment.step.why:
            waited.add(moment.step.why)
        meanwhile()

    behaviour = CrossDoor(_frame(bench.robot.name), doors_to_cross, side, patience=patience)
    ended = run(bench, behaviour, timeout=90.0, each=each)
    touched, clearance = frozenset(keeper.touched), float(keeper.clearance)
    return Crossing(ended.outcome, ended.why, ended.time, bench.pose, touched, clearance, frozenset(waited))
