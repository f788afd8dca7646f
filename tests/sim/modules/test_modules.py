"""Missions of modules over a link in one thread, held against missions in one process, and with parts that die."""

import math

import numpy as np
import pytest

from refseq.belief import Belief
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.missions import Errand, Executor, Landmarks, Plan, Wait, compiled, parse_mission, path_along
from refseq.missions.executor import ExecutorSettings
from refseq.missions.tasks import Photograph, Task
from refseq.modules.executor import MissionModule
from refseq.modules.heads import MessageError, Parts
from refseq.modules.localiser import LocaliserModule
from refseq.modules.messages import BELIEF, STEPS, Step, belief_in, head_of
from refseq.modules.process import Role
from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_drive import run_and_sense
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.missions.mission import DrivenMission, run_mission
from refseq_bench.sim.modules.control import ControlModule
from refseq_bench.sim.modules.robot import RobotModule, RobotSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.refseq.scenes.drawn import scene
from tests.sim.modules.local_link import LocalLink

BLIND = BenchSettings(RendererKind.NONE, cameras=())
OFTEN = Trigger(distance=0.6)


@pytest.fixture(scope="module")
def offices() -> World:
    return build_world(load_plan("offices"), light_named("16:00"), pictured=False)


def bench(world: World, seed: int) -> Bench:
    return Bench(world, robots.load("robuter"), seed=seed, settings=BLIND)


@pytest.fixture(scope="module")
def learnt(offices: World) -> Map:
    """The first metres of the corridor, as the laser saw them once."""
    with bench(offices, 3) as drive:
        return learn([one.view for one in run_and_sense(drive, ["MN:6"], Trigger())], profile=BEST)


@pytest.fixture(scope="module")
def plan(learnt: Map) -> Plan:
    """A few steps ahead, a short wait, and on."""
    return planned(learnt, Wait(0.5))


def planned(learnt: Map, task: Task) -> Plan:
    places = Landmarks({"LA1": 1.7, "LA3": 3.4})
    return compiled(parse_mission("[LA1_LA3]"), path_along(learnt), places, [Errand(tasks=(task,)), Errand()])


@pytest.fixture(scope="module")
def alone(offices: World, learnt: Map, plan: Plan) -> DrivenMission:
    with bench(offices, 1003) as drive:
        return run_mission(drive, Executor(plan), Localiser(learnt), trigger=OFTEN)


@pytest.fixture(scope="module")
def apart(offices: World, learnt: Map, plan: Plan) -> "Driven":
    with bench(offices, 1003) as drive:
        return Driven(drive, learnt, plan, {})


class Driven:
    """A mission of modules, some of which die: another one comes ``LATER``. ``deaths`` are roles by their last step."""

    LATER = 3

    def __init__(self, drive: Bench, learnt: Map, plan: Plan, deaths: dict[int, Role], timeout: float = 300.0) -> None:
        self.link, self.deaths = LocalLink(), deaths
        self.make = {
            Role.CONTROL: ControlModule,
            Role.LOCALISER: lambda: LocaliserModule(learnt),
            Role.MISSION: lambda: MissionModule(plan, len(learnt), timeout=timeout),
        }
        self.modules, self.kill = {}, {}
        robot = RobotModule(drive, self.link, "a drive", RobotSettings(OFTEN), lambda _line: None)
        for role in self.make:
            self.start(role)
        self.link.subscribe(STEPS, self.watch)
        self.over = robot.run()
        kept = self.link.kept[STEPS]
        self.steps = [head_of(Step, parts) for parts in kept]
        self.beliefs = [belief_in(data).belief for parts in kept for name, data in parts if name == BELIEF]
        self.log = self.modules[Role.MISSION].executor.log

    def start(self, role: Role) -> None:
        self.modules[role] = self.make[role]()
        self.kill[role] = self.link.run(self.modules[role])

    def watch(self, parts: Parts) -> None:
        step = head_of(Step, parts)
        if step.over:
            for kill in self.kill.values():
                kill()
        elif step.number in self.deaths:
            self.kill[self.deaths[step.number]]()
        elif step.number - self.LATER in self.deaths:
            self.start(self.deaths[step.number - self.LATER])


def same(one: Belief, other: Belief) -> bool:
    return (
        np.array_equal(one.places, other.places)
        and np.array_equal(one.lost_after, other.lost_after)
        and (one.lost, one.best, one.path, one.entropy) == (other.lost, other.best, other.path, other.entropy)
    )


def test_beliefs_way_and_log_are_those_of_one_process(alone: DrivenMission, apart: Driven) -> None:
    assert len(apart.beliefs) == len(alone.seen) > 5
    assert all(same(found, seen.belief) for found, seen in zip(apart.beliefs, alone.seen, strict=True))
    poses = {time: (x, y, heading) for time, x, y, heading, _ in alone.track}
    assert all(poses[step.time] == step.truth for step in apart.steps if step.time)
    assert apart.log == alone.executor.log
    assert apart.over == "completed"
    assert not any(step.held for step in apart.steps)


def test_what_is_touched_stands_in_the_log_as_in_one_process(offices: World, learnt: Map, plan: Plan) -> None:
    """It is set down against a wall."""

    def against_a_wall(drive: Bench) -> Bench:
        drive.place(Pose(drive.pose.x, 1.2 - drive.robot.shape.half_width + 0.03, 0.0))
        return drive

    with bench(offices, 1003) as drive:
        soon = Executor(plan, settings=ExecutorSettings(timeout=6.0))
        one = run_mission(against_a_wall(drive), soon, Localiser(learnt), trigger=OFTEN)
    with bench(offices, 1003) as drive:
        apart = Driven(against_a_wall(drive), learnt, plan, {}, timeout=6.0)
    assert one.touches
    assert tuple(touch for step in apart.steps for touch in step.touches) == one.touches
    assert apart.log == one.executor.log


def test_what_dies_is_taken_over(offices: World, learnt: Map, plan: Plan, apart: Driven) -> None:
    """The robot stands until then, and gives each order once, in the order in which it would have."""
    third = len(apart.steps) // 4
    deaths = {third: Role.CONTROL, 2 * third: Role.LOCALISER, 3 * third: Role.MISSION}
    with bench(offices, 1003) as drive:
        hurt = Driven(drive, learnt, plan, deaths)
    held = [(step.number - 1, step.held) for step in hurt.steps if step.held]
    assert held == [(number + late, role) for number, role in deaths.items() for late in range(Driven.LATER)]
    assert hurt.over == "completed"
    breaks = ("paused", "resumed")
    told = [entry.what.partition(":")[0] for entry in hurt.log if entry.what not in breaks]
    assert told == [entry.what.partition(":")[0] for entry in apart.log]
    assert math.dist(hurt.steps[-1].truth[:2], apart.steps[-1].truth[:2]) < 0.1


def test_an_executor_that_hears_the_drive_again_is_where_the_one_before_was(
    learnt: Map, plan: Plan, apart: Driven
) -> None:
    again = MissionModule(plan, len(learnt), timeout=300.0)
    for step, parts in zip(apart.steps, apart.link.kept[STEPS], strict=True):
        again.hear(STEPS, parts)
        assert again.hear(STEPS, parts) is None  # what was kept comes twice where nobody was late
        before = [entry for entry in apart.log if entry.time < step.time]
        assert again.executor.log[: len(before)] == before
    assert again.executor.log == apart.log


def test_a_task_that_no_module_does_is_refused(learnt: Map) -> None:
    with pytest.raises(MessageError, match="task photograph 'door': no module does it; valid is wait"):
        MissionModule(planned(learnt, Photograph("door")), len(learnt), timeout=1.0)


def test_a_scene_that_no_module_looks_for_is_refused(learnt: Map) -> None:
    way = path_along(learnt)
    sought = compiled(parse_mission("[LI1]"), way, Landmarks({}, {"LI1": scene()}))
    with pytest.raises(MessageError, match=r"^landmark LI1: no module looks for a scene; valid are ones with a place$"):
        MissionModule(sought, len(learnt), timeout=1.0)
