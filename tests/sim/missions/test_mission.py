"""Missions on a bench, seen from the truth: where the robot gets to, what it refuses, what it does on the way."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import Belief, belief_from
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.missions import (
    Call,
    Errand,
    Executor,
    ExecutorSettings,
    Landmarks,
    Order,
    Photograph,
    Plan,
    Status,
    Wait,
    as_learnt,
    compiled,
    parse_mission,
    path_along,
)
from refseq.planar import Pose
from refseq.view import View
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.robots.errors import RobotsError
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_drive import run_and_sense
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.drives.view_spacing import LOOKING
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.missions.mission import DrivenMission, run_mission
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.refseq.scenes.drawn import scene

BLIND = BenchSettings(RendererKind.NONE, cameras=())
WEST = Landmarks({"LA3": "end"})
ABOUT = "MN:25"
PICTURE = np.zeros((480, 640), np.uint8)
LASER_AHEAD = 0.25
"""Of the Robuter's axle [m]."""


@pytest.fixture(scope="module")
def offices() -> World:
    return build_world(load_plan("offices"), light_named("16:00"), pictured=False)


@pytest.fixture(scope="module")
def learnt(offices: World) -> Map:
    """The corridor of offices as the laser saw it once."""
    with Bench(offices, robots.load("robuter"), seed=3, settings=BLIND) as bench:
        taken = list(run_and_sense(bench, [ABOUT], Trigger()))
    return learn([one.view for one in taken], profile=BEST)


def lasting(seconds: float) -> ExecutorSettings:
    return ExecutorSettings(timeout=seconds)


def run(
    world: World,
    plan: Plan,
    learnt: Map | None,
    *,
    seed: int = 1003,
    calls: dict[str, Callable[[View], None]] | None = None,
    each: Callable[[Executor, Bench], None] | None = None,
    timeout: float = 300.0,
    settings: BenchSettings = BLIND,
) -> DrivenMission:
    with Bench(world, robots.load("robuter"), seed=seed, settings=settings) as bench:
        localiser = None if learnt is None else Localiser(learnt)
        executor = Executor(plan, localised=learnt is not None, settings=lasting(timeout))
        return run_mission(bench, executor, localiser, trigger=Trigger(), calls=calls, each=each)


def told(done: DrivenMission) -> str:
    return "\n".join(map(str, done.executor.log))


def at(pose: Pose | None) -> tuple[float, float]:
    assert pose is not None
    return pose.x, pose.y


# --- what was learnt ---


def test_the_doors_of_the_offices_are_found(learnt: Map) -> None:
    """Against the plan: the open one and the closed ones; the one that is ajar may be overlooked."""
    start = at(learnt.poses[0])[0] + LASER_AHEAD
    found: dict[str, bool] = {}
    for true in load_plan("offices").door:
        sides = [door for door in learnt.paths[0].annotations.doors if door.side == true.wall]
        near = [door for door in sides if abs(door.along + start - true.at) < 0.3]
        if near:
            found[true.name] = near[0].passable
    assert len(learnt.paths[0].annotations.doors) <= len(found) + 2
    found.pop("o3", None)
    assert found == {"o1": False, "o2": True, "store": False, "o4": False}


# --- getting there ---


@pytest.fixture(scope="module")
def there(offices: World, learnt: Map) -> tuple[DrivenMission, list[View], list[View]]:
    """A mission to the end, with a wait and a call at the first door and a photograph at the end."""
    called: list[View] = []
    errands = [Errand(tasks=(Wait(3.0), Call("count"))), Errand(tasks=(Photograph("end"), Call("count")))]
    plan = compiled(parse_mission("[LD_LA3]"), path_along(learnt), WEST, errands)
    done = run(offices, plan, learnt, calls={"count": called.append})
    return done, called, [seen.view for seen in done.seen]


def test_it_gets_to_the_end_of_the_corridor(learnt: Map, there: tuple[DrivenMission, list[View], list[View]]) -> None:
    done, *_ = there
    assert done.executor.status is Status.COMPLETED, told(done)
    assert math.dist(done.track[-1, 1:3], at(learnt.poses[-1])) < 0.2
    assert done.touched == ()
    assert [number for number, _ in done.executor.switches] == [0, 1]


def test_the_track_is_the_truth_and_what_was_believed(
    learnt: Map, there: tuple[DrivenMission, list[View], list[View]]
) -> None:
    done, _, views = there
    time, x, y, _, along = done.track.T
    assert np.diff(time) == pytest.approx(0.04)
    assert np.hypot(np.diff(x), np.diff(y)).max() < 0.5 * 0.04 + 1e-3
    start = at(learnt.poses[0])[0]
    assert np.abs(along - (x - start)).max() < 0.6, "the robot knows where it is"
    assert all(view.truth is not None for view in views)
    assert [entry.time for entry in done.executor.log] == sorted(entry.time for entry in done.executor.log)


def test_tasks_happen_where_they_belong(learnt: Map, there: tuple[DrivenMission, list[View], list[View]]) -> None:
    done, called, _ = there
    door = at(learnt.poses[0])[0] + learnt.paths[0].annotations.doors[0].along
    assert [at(view.truth)[0] for view in called] == pytest.approx([door, at(learnt.poses[-1])[0]], abs=0.3)
    assert list(done.photographs) == ["end"]
    stood = np.abs(np.diff(done.track[:, 1])) < 1e-4
    assert stood[np.abs(done.track[1:, 1] - door) < 0.5].sum() * 0.04 >= 2.5  # it has come to rest by then


def test_no_motion_between_views_is_lost(there: tuple[DrivenMission, list[View], list[View]]) -> None:
    """A view that a task takes is one of the localiser's as well: their distances make the whole way."""
    done, called, views = there
    assert sum(view.distance for view in views) == pytest.approx(done.track[-1, 1] - done.track[0, 1], abs=0.15)
    times = [view.time for view in views]
    assert all(view.time in times for view in called)


@pytest.mark.slow
def test_the_same_mission_is_the_same_bit_for_bit(offices: World, learnt: Map) -> None:
    plan = compiled(parse_mission("[LI6]"), path_along(learnt))
    one, same, other = (run(offices, plan, learnt, seed=seed) for seed in (5, 5, 6))
    assert one.track.tobytes() == same.track.tobytes()
    assert one.executor.log == same.executor.log
    for seen, again in zip(one.seen, same.seen, strict=True):
        assert seen.belief.places.tobytes() == again.belief.places.tobytes()
    assert one.track.tobytes() != other.track.tobytes()


def test_by_the_odometer_alone_no_view_is_taken(offices: World, learnt: Map) -> None:
    done = run(offices, compiled(parse_mission("[LI6]"), path_along(learnt)), None)
    assert done.executor.status is Status.COMPLETED
    assert done.seen == ()
    assert math.dist(done.track[-1, 1:3], at(learnt.poses[6])) < 0.3


def test_a_mission_counts_from_its_own_begin_whatever_the_robot_did_before(offices: World, learnt: Map) -> None:
    """By the odometer alone, of a robot that went 1.2 m and was carried back: neither its way nor its time counts."""
    touches: list[float] = []

    def each(executor: Executor, bench: Bench) -> None:
        if executor.time > 2.0 and not touches:
            touches.append(executor.time)
            bench.place(Pose(bench.pose.x, 1.2 - bench.robot.shape.half_width + 0.03, bench.pose.heading))

    with Bench(offices, robots.load("robuter"), seed=1003, settings=BLIND) as bench:
        start = bench.pose
        for _ in range(90):
            bench.drive(Twist(0.4, 0.0))
        assert bench.state.distance > 1.0
        bench.place(start)
        plan = compiled(parse_mission("[LI6]"), path_along(learnt))
        done = run_mission(bench, Executor(plan, localised=False, settings=lasting(60.0)), None)
        assert done.executor.status is Status.COMPLETED, told(done)
        assert math.dist(done.track[-1, 1:3], at(learnt.poses[6])) < 0.3
        assert (done.track[0, 0], done.track[0, 4]) == pytest.approx((0.04, 0.0), abs=0.02)
        bench.place(start)
        pushed = run_mission(bench, Executor(plan, localised=False, settings=lasting(4.0)), None, each=each)
    assert touches[0] <= pushed.touches[0].time < 4.0


# --- what is refused ---


def test_a_closed_door_is_refused(offices: World, learnt: Map) -> None:
    done = run(offices, compiled(parse_mission("[LDMC]"), path_along(learnt)), learnt)
    assert done.executor.status is Status.FAILED
    assert done.executor.why.startswith("MC:left failed: door ")
    assert done.executor.why.endswith("closed")
    assert done.touched == ()
    assert np.abs(done.track[:, 2]).max() < 1.2, "it stays in the corridor"


@pytest.mark.slow
def test_past_the_first_door_and_through_the_second(offices: World, learnt: Map) -> None:
    """The first is closed, and the second the only one that is open."""
    done = run(offices, compiled(parse_mission("[LD_LDMC]"), path_along(learnt)), learnt)
    assert [number for number, _ in done.executor.switches] == [0, 1, 2], told(done)
    assert done.touched == ()
    assert done.executor.status is Status.COMPLETED, told(done)
    assert done.track[-1, 2] > 1.35 + 0.5, "it is in the office"
    assert done.track[-1, 1] == pytest.approx(12.2, abs=0.3)


def test_calls_and_behaviours_that_are_not_there_are_refused_before_it_moves(offices: World, learnt: Map) -> None:
    way = path_along(learnt)
    plan = Plan(way, as_learnt(way).orders, way.length, (Call("nobody"),))
    with pytest.raises(SimError, match=r"^call 'nobody': no such function; valid are count$"):
        run(offices, plan, learnt, calls={"count": lambda view: None})
    late = Plan(way, (*as_learnt(way).orders, Order(20.0, "MW:left,0.1", "x")), way.length)
    moved: list[float] = []
    with pytest.raises(RobotsError, match=r"MW:left,0\.1"):
        run(offices, late, None, each=lambda executor, bench: moved.append(bench.pose.x))
    assert not moved
    sought = Landmarks({"LA3": "end"}, {"LI1": scene()})
    for errand, told in ((Errand("MW:left,0.1"), RobotsError), (Errand(None, (Call("nobody"),)), SimError)):
        behind = compiled(parse_mission("[LI1_LA3]"), way, sought, [Errand(), errand])
        with pytest.raises(told, match=r"MW:left,0\.1|call 'nobody'"):
            run(offices, behind, None, each=lambda executor, bench: moved.append(bench.pose.x))
        assert not moved, "what comes behind a scene is looked at as well"


# --- on the way ---


def test_it_pauses_goes_on_and_is_aborted(offices: World, learnt: Map) -> None:
    plan = as_learnt(path_along(learnt))

    def each(executor: Executor, bench: Bench) -> None:
        if 5.0 <= bench.time < 10.0:
            executor.pause()
        elif 10.0 <= bench.time < 12.0:
            executor.resume()
        elif bench.time >= 12.0:
            executor.abort("enough")

    done = run(offices, plan, None, each=each)
    assert done.executor.status is Status.ABORTED
    time, x = done.track[:, 0], done.track[:, 1]
    assert np.ptp(x[(time > 7.0) & (time < 10.0)]) < 0.01
    assert x[-1] > x[np.searchsorted(time, 9.0)] + 0.3
    assert abs(x[-1] - x[-2]) < 0.002, "it stands in the end"
    assert 13.0 <= time[-1] <= 15.0


def test_who_watches_hears_of_what_is_touched_while_the_robot_comes_to_rest(offices: World, learnt: Map) -> None:
    heard: list[int] = []

    def each(executor: Executor, bench: Bench) -> None:
        if bench.time > 2.0 and not executor.status.over:
            executor.abort("enough")
            bench.place(Pose(bench.pose.x, 1.2 - bench.robot.shape.half_width + 0.03, bench.pose.heading))
        heard.append(len(executor.log))

    done = run(offices, as_learnt(path_along(learnt)), None, each=each)
    assert done.executor.log[-1].what.startswith("touches"), told(done)
    assert heard[-1] == len(done.executor.log)


def test_a_pause_wears_out_neither_the_mission_s_time_nor_a_behaviour_s_patience(offices: World, learnt: Map) -> None:
    """It waits before a wall, which a behaviour does for 10 s, is paused for 12 s meanwhile, and waits on."""

    def each(executor: Executor, bench: Bench) -> None:
        if 1.0 <= bench.time < 5.0:
            bench.place(Pose(bench.pose.x, 0.0, math.pi / 2))
        elif 10.0 <= bench.time < 22.0:
            executor.pause()
        else:
            executor.resume()

    done = run(offices, as_learnt(path_along(learnt)), None, each=each, timeout=22.0)
    assert "failed: waited 10 s" in done.executor.why, told(done)
    assert 26.0 < done.executor.time < 32.0


class Lost:
    """A localiser with so many ``places`` that says lost whatever it sees, and keeps the cameras of each view."""

    def __init__(self, places: int) -> None:
        self._places, self.cameras = places, list[list[str]]()

    def update(self, view: View) -> Belief:
        self.cameras.append(list(view.images))
        return belief_from(np.ones(self._places), lost=0.99)


def test_a_robot_that_does_not_know_where_it_is_stands_and_looks_once_a_second(offices: World, learnt: Map) -> None:
    with Bench(offices, robots.load("robuter"), seed=1003, settings=BLIND) as bench:
        executor = Executor(as_learnt(path_along(learnt)), settings=lasting(6.0))
        done = run_mission(bench, executor, Lost(len(learnt)))
    times = [seen.view.time for seen in done.seen]
    assert len(times) >= 6
    assert np.diff(times) == pytest.approx(LOOKING, abs=0.05)
    assert np.ptp(done.track[:, 1]) < 0.01


def test_views_are_kept_without_their_images_which_would_fill_the_memory(offices: World, learnt: Map) -> None:
    with Bench(offices, robots.load("robuter"), seed=1003, settings=BLIND) as bench:
        sense, localiser = bench.sense, Lost(len(learnt))
        bench.sense = lambda: replace(sense(), images={"camera-1": PICTURE})  # type: ignore[method-assign]
        done = run_mission(bench, Executor(as_learnt(path_along(learnt)), settings=lasting(2.0)), localiser)
    assert localiser.cameras == [["camera-1"]] * len(done.seen)
    assert len(done.seen) >= 2
    assert not any(seen.view.images for seen in done.seen)


def test_a_mission_that_takes_too_long_is_aborted(offices: World, learnt: Map) -> None:
    done = run(offices, as_learnt(path_along(learnt)), None, timeout=3.0)
    assert done.executor.status is Status.ABORTED
    assert done.executor.why == "not over after 3 s"


def test_what_it_is_pushed_against_is_told(offices: World, learnt: Map) -> None:
    pushed: list[bool] = []

    def each(executor: Executor, bench: Bench) -> None:
        if bench.time > 2.0 and not pushed:
            pushed.append(True)
            bench.place(Pose(bench.pose.x + 0.5, 1.2 - bench.robot.shape.half_width + 0.03, 0.0))

    done = run(offices, as_learnt(path_along(learnt)), None, each=each, timeout=4.0)
    assert done.touched
    assert any("left" in name for name in done.touched)
    lines = [(line.time, line.what) for line in done.executor.log if line.what.startswith("touches")]
    assert lines == [(touch.time, f"touches {touch.thing}") for touch in done.touches]
    assert all(2.0 < touch.time < 4.0 for touch in done.touches)
    assert [line.time for line in done.executor.log] == sorted(line.time for line in done.executor.log)
