import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.logs import RecordingWriter, read_recording
from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.operator import PATIENCE, OperatorStyle
from refseq_bench.sim.drives.recorder import (
    STANDSTILL,
    RecordedView,
    describe,
    drive_and_sense,
    operator_for,
)
from refseq_bench.sim.drives.trigger import ROUNDING, Moved, Trigger
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

PERFECT = OperatorStyle(strength=0.0)
THERE_AND_BACK = "back = [[1, 0], [4, 0], [2, 0]]"
limits = st.none() | st.floats(1e-3, 1e3)
amounts = st.floats(0, 1e3)


@pytest.fixture(scope="module")
def corridor() -> World:
    return build_world(parse_plan(SMALL.format(top="", end=THERE_AND_BACK)), light_named("16:00"), pictured=False)


def bench_in(world: World, route: str = "forward", seed: int = 1) -> Bench:
    return Bench(
        world, robots.load("robuter"), route=route, seed=seed, settings=BenchSettings(renderer=RendererKind.NONE)
    )


def taken_in(
    world: World, trigger: Trigger, route: str = "forward", style: OperatorStyle = PERFECT
) -> list[RecordedView]:
    with bench_in(world, route) as bench:
        return list(drive_and_sense(bench, operator_for(bench, 1, style), trigger, timeout=120.0))


@given(limits, limits, limits, amounts, st.floats(-10, 10), amounts)
def test_a_trigger_fires_when_one_of_its_limits_is_reached(
    distance: float | None, turn: float | None, time: float | None, went: float, turned: float, passed: float
) -> None:
    if distance is turn is time is None:
        return
    reached = [
        distance is not None and went >= distance * (1 - ROUNDING),
        turn is not None and abs(turned) >= turn * (1 - ROUNDING),
        time is not None and passed >= time * (1 - ROUNDING),
    ]
    assert Trigger(distance, turn, time).fires(Moved(went, turned, passed)) == any(reached)


@pytest.mark.parametrize("periods", [10, 20, 100, 2500, 90_000])
def test_a_time_of_whole_control_periods_is_kept_though_their_sum_is_rounded(periods: int) -> None:
    trigger, moved, still = Trigger(distance=None, time=round(periods * CONTROL_PERIOD, 2)), Moved(), Pose(0, 0, 0)
    for _ in range(periods - 1):
        moved.time += CONTROL_PERIOD  # as ``add`` does; Python's own sum makes up for rounding
    assert not trigger.fires(moved)
    moved.add(still, still, CONTROL_PERIOD)
    assert trigger.fires(moved)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("name", ["distance", "turn", "time"])
def test_a_limit_that_nothing_can_reach_is_refused(name: str, bad: float) -> None:
    with pytest.raises(SimError, match=rf"^trigger: {name} = {bad} is not positive and finite$"):
        Trigger(**{name: bad})


def test_a_trigger_that_never_fires_is_refused() -> None:
    with pytest.raises(SimError, match="distance, turn and time are all off; valid is at least one of them"):
        Trigger(distance=None)


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.5, 0.5)), max_size=20))
def test_motion_adds_up_to_path_length_and_whole_turn(steps: list[tuple[float, float, float]]) -> None:
    moved, pose = Moved(), Pose(0.0, 0.0, 3.0)  # the heading passes ±π
    for x, y, turn in steps:
        # An odometer may wrap its heading: what it turned is the small way round.
        after = Pose(pose.x + x, pose.y + y, math.remainder(pose.heading + turn, 2 * math.pi))
        moved.add(pose, after, 0.04)
        pose = after
    assert moved.distance == pytest.approx(sum(math.hypot(x, y) for x, y, _ in steps), abs=1e-9)
    assert moved.turn == pytest.approx(sum(turn for *_, turn in steps), abs=1e-9)
    assert moved.time == pytest.approx(0.04 * len(steps))


def test_views_stand_as_far_apart_as_asked(corridor: World) -> None:
    spacing = 0.4
    taken = taken_in(corridor, Trigger(distance=spacing), style=OperatorStyle())
    assert len(taken) == pytest.approx(6.0 / spacing, abs=1)
    assert taken[0].view.distance == 0.0
    assert taken[0].progress == 0.0
    assert taken[0].view.time == 0.0
    one_period = OperatorStyle().max_speed * CONTROL_PERIOD
    for before, after in pairwise(taken):
        # A chord is a little shorter than the way, and the trigger is asked once a control period.
        assert spacing * 0.99 <= after.view.distance <= spacing + one_period
        here, there = before.view.truth, after.view.truth
        assert here is not None
        assert there is not None
        assert math.dist((here.x, here.y), (there.x, there.y)) == pytest.approx(after.view.distance, rel=0.02)
    assert all(0 < after.progress - before.progress < 2 * spacing for before, after in pairwise(taken))


def test_views_are_taken_where_the_robot_turns(corridor: World) -> None:
    limit = 0.3
    taken = taken_in(corridor, Trigger(distance=None, turn=limit), "back")
    turns = [abs(one.view.turn) for one in taken[1:]]
    assert len(turns) == pytest.approx(math.pi / limit, abs=1.5)
    one_period = 1.1 * OperatorStyle().max_angular * CONTROL_PERIOD
    assert all(limit <= turn <= limit + one_period for turn in turns)


@pytest.mark.quick_cases("0.6")
@pytest.mark.parametrize("every", [0.2, 0.6, 1.0, 1.24])
def test_views_come_at_even_times(corridor: World, every: float) -> None:
    times = [one.view.time for one in taken_in(corridor, Trigger(distance=None, time=every))]
    assert np.diff(times) == pytest.approx(every, abs=1e-6)
    assert len(times) > 10


def test_the_first_limit_that_is_reached_counts(corridor: World) -> None:
    taken = taken_in(corridor, Trigger(distance=0.5, time=1.0))
    assert all(later.view.time - one.view.time <= 1.0 + 1e-6 for one, later in pairwise(taken))
    assert all(one.view.distance <= 0.5 + 0.5 * CONTROL_PERIOD for one in taken)


def test_a_recording_gives_back_what_the_robot_sensed(corridor: World, tmp_path: Path) -> None:
    taken = taken_in(corridor, Trigger(distance=0.5, turn=0.4), "back", OperatorStyle())
    path = tmp_path / "drive.mcap"
    with RecordingWriter(path, {}) as writer:
        for one in taken:
            writer.write(one.view, one.odometry)
    read = read_recording(path).views
    assert len(read) == len(taken)
    for one, view in zip(taken, read, strict=True):
        assert view.distance == pytest.approx(one.view.distance, abs=1e-9)
        assert view.turn == pytest.approx(one.view.turn, abs=1e-9)
        assert view.time == pytest.approx(one.view.time, abs=1e-9)
        assert view.scan is not None
        assert one.view.scan is not None
        assert np.array_equal(view.scan.ranges, one.view.scan.ranges)
        assert view.truth is not None
        assert one.view.truth is not None
        assert (view.truth.x, view.truth.y) == (one.view.truth.x, one.view.truth.y)


@pytest.mark.quick_cases("10.0-10.0")
@pytest.mark.parametrize(("timeout", "gave_up"), [(10.0, 10.0), (PATIENCE, STANDSTILL)])
def test_a_robot_that_is_stuck_is_told(corridor: World, timeout: float, gave_up: float) -> None:
    """At the latest when it has stood for two minutes: the time that it drove, some 5 s, comes on top."""
    spec = corridor.spec.copy()
    spec.worldbody.add_geom(
        name="barrier", type=mujoco.mjtGeom.mjGEOM_BOX, pos=(3.0, 0.0, 0.5), size=(0.1, 1.2, 0.5), mass=0
    )
    blocked = replace(corridor, spec=spec)
    with bench_in(blocked) as bench:
        for _ in range(100):
            bench.wait()  # which is not the drive's time
        waited = bench.time
        taken = drive_and_sense(bench, operator_for(bench, 1, PERFECT), Trigger(), timeout=timeout)
        with pytest.raises(SimError, match=r"^the robot came 1\.\d m of 6\.0 m in \d+ s: it is stuck at ") as caught:
            list(taken)
        gap = 2.9 - bench.pose.x - bench.robot.shape.ahead
        told = f"x {bench.pose.x:.2f}, y {bench.pose.y:.2f}, {gap:.2f} m before 'barrier' (refseq world check "
        assert told in str(caught.value)
        assert bench.pose.x < 2.9
        assert gave_up <= bench.time - waited < gave_up + 15.0


def test_a_seed_is_one_drive_of_the_person_and_another_seed_is_another(corridor: World) -> None:
    paths = []
    for seed in (1, 1, 2):
        with bench_in(corridor) as bench:
            paths.append([one.view.truth for one in drive_and_sense(bench, operator_for(bench, seed), Trigger())])
    assert paths[0] == paths[1]
    assert paths[0] != paths[2]


def test_the_metadata_say_how_to_drive_it_again(corridor: World) -> None:
    trigger, style = Trigger(0.5, turn=0.2), OperatorStyle(speed=0.3)
    with bench_in(corridor, seed=7) as bench:
        record = describe(bench, route="forward", seed=7, trigger=trigger, style=style)
    assert all(isinstance(value, str) for value in record.values())
    expected = {
        "world": "small",
        "world_seed": "0",
        "light": "16:00",
        "robot": "robuter",
        "route": "forward",
        "seed": "7",
        "renderer": "none",
    }
    assert {key: record[key] for key in expected} == expected
    config = json.loads(record["config"])
    assert Trigger(**config["trigger"]) == trigger
    assert OperatorStyle(**config["operator"]) == style
    assert parse_plan(SMALL.format(top="", end=THERE_AND_BACK)) == type(bench.world.plan).model_validate(config["plan"])
    assert config["timestep_s"] == bench.model.opt.timestep
