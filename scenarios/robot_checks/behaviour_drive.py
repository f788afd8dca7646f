"""Behaviours that a robot runs one after another in a world, and what became of each."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Stop
from refseq_bench.robots.behaviours import BehaviourOutcome, RobotDescription
from refseq_bench.robots.behaviours.written import ParsedBehaviour, make_behaviour, parse_behaviour
from refseq_bench.robots.stops import StopLog
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import TextTable
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.contacts import thing_in_words
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_runner import BehaviourMoment, description_of, run
from refseq_bench.sim.drives.doors import doors_seen
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.areas import inside, rectangles, valid_areas
from refseq_bench.worlds.plans.load import load_plan
from refseq_bench.worlds.plans.schema import FloorPlan

SUNK = -0.005
"""Bodies that are deeper in each other than this [m] do not only touch."""


@dataclass(frozen=True, slots=True)
class BehaviourDrive:
    """Behaviours to run, and where from: ``at`` a pose, or None, the start of a ``route``."""

    robot: str
    behaviours: tuple[str, ...]
    world: str
    route: str = "forward"
    at: Pose | None = None
    seed: int = 1
    timeout: float = 300.0


@dataclass(frozen=True, slots=True)
class BehaviourResult:
    """Result of one behaviour: ``path`` (n, 3) is the true one, x, y [m], heading [rad]."""

    text: str
    outcome: BehaviourOutcome
    why: str
    time: float
    path: NDArray[np.float64]
    stops: tuple[Stop, ...]

    @property
    def way(self) -> float:
        """Length of the path [m]."""
        return float(np.hypot(*np.diff(self.path[:, :2], axis=0).T).sum())


def parse_pose(text: str) -> Pose:
    """Read ``X,Y,HEADING`` [m, m, deg]."""
    try:
        x, y, heading = (float(part) for part in text.split(","))
    except ValueError:
        x = y = heading = math.nan
    if not all(map(math.isfinite, (x, y, heading))):
        raise ScenarioError(f"pose '{text}' is not valid; it should be X,Y,DEGREES, x and y in metres, such as 3,0,90")
    return Pose(x, y, math.radians(heading))


def drive_behaviours(asked: BehaviourDrive) -> Iterator[BehaviourResult]:
    """Run the behaviours until one fails; all words are read before the robot moves."""
    choices = [parse_behaviour(text) for text in asked.behaviours]
    robot, plan = robots.load(asked.robot), load_plan(asked.world)
    frame = description_of(robot)
    for choice in choices:
        make_behaviour(choice, frame, doors_seen)
    if not (math.isfinite(asked.timeout) and asked.timeout > 0):
        raise ScenarioError(f"timeout {asked.timeout:g} is not valid; it should be a time above 0 s")
    route = asked.route if asked.at is None else next(iter(plan.routes))
    settings = BenchSettings(renderer=RendererKind.NONE, cameras=())
    world = build_world(plan, light_named("16:00"), pictured=False)
    with Bench(world, robot, route=route, seed=asked.seed, settings=settings) as bench:
        if asked.at is not None:
            _put(bench, plan, asked.at)
        for choice in choices:
            done = _run(bench, choice, frame, asked.timeout)
            yield done
            if done.outcome is not BehaviourOutcome.FINISHED:
                return


def _put(bench: Bench, plan: FloorPlan, pose: Pose) -> None:
    """Carry the robot to ``pose``; raises ``ScenarioError`` where there is no room."""
    at = f"pose {pose.x:g},{pose.y:g},{math.degrees(pose.heading):g}"
    if not inside(plan, (pose.x, pose.y)):
        raise ScenarioError(f"{at} lies outside '{plan.name}'; {valid_areas(rectangles(plan))}")
    bench.place(pose)
    for contact in bench.data.contact:
        if contact.dist < SUNK:
            names = [bench.model.geom(int(geom)).name for geom in contact.geom]
            thing = next((name for name in names if not name.startswith(bench.named(""))), names[0])
            raise ScenarioError(
                f"{at} is no place for {bench.robot.name}: it stands in {thing_in_words(thing)}; valid is free floor"
            )


def _run(bench: Bench, choice: ParsedBehaviour, frame: RobotDescription, timeout: float) -> BehaviourResult:
    stops = StopLog()

    def hear(_: BehaviourMoment) -> None:
        stops.hear(bench.state.stops)

    ended = run(bench, make_behaviour(choice, frame, doors_seen), timeout=timeout, each=hear)
    return BehaviourResult(choice.text, ended.outcome, ended.why, ended.time, ended.path, stops.heard)


def behaviour_table(found: Sequence[BehaviourResult]) -> TextTable:
    """The behaviours, a row each, for a terminal of 80 characters."""
    headings = ("behaviour", "outcome", "why", ">time [s]", ">way [m]", "stops")
    table = TextTable(*headings, wraps=("why", "stops"))
    for done in found:
        stops = "; ".join(f"{stop.cause.value} at {stop.since:.1f} s: {stop.detail}" for stop in done.stops)
        figures = (f"{done.time:.1f}", f"{done.way:.2f}")
        table.add_row(done.text, done.outcome.value, done.why, *figures, stops or "none")
    return table
