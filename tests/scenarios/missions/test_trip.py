"""Trips that cannot be made are told before anything is opened, and what is left out comes from the map."""

import json
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from refseq.errors import MapError
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.missions import Landmarks, TrueWay, compiled, parse_mission
from refseq.missions.executor import Executor
from refseq.missions.log import Touch
from refseq.missions.path import MissionPath, path_along
from refseq.missions.plan import Plan, as_learnt
from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.missions import runs
from refseq_bench.scenarios.missions import trip as trips
from refseq_bench.scenarios.missions.leader import Leader
from refseq_bench.scenarios.missions.runs import NOWHERE, Each
from refseq_bench.scenarios.missions.trip import MissionTrip, bench_on_way, known_goal, poses_of, run_trip
from refseq_bench.sim.missions.mission import DrivenMission
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind
from refseq_bench.worlds.plans.load import load_plan
from tests.refseq.scenes.drawn import scene
from tests.support import corridor_drive

TOLD = {"world": "hallway", "light": "16:00", "robot": "robuter", "renderer": "classic"}
VIEWS = [
    replace(view, behaviour="" if number else "MN:0")
    for number, view in enumerate(corridor_drive(np.random.default_rng(0), 5, size=96))
]


def learnt(told: dict[str, str], *, laser: bool = False) -> Map:
    return learn(VIEWS, sensors=["laser"] if laser else ["forward"], metadata=told)


def test_what_is_left_out_is_the_map_s() -> None:
    trip = MissionTrip.from_map(learnt(TOLD), robot="segway_rmp", robot_spread="as-built", at=2.0, seed=7, every=0.5)
    assert trip.drive.unit == 7
    drive = trip.drive
    assert (drive.world, drive.light, drive.robot, drive.renderer) == ("hallway", "16:00", "segway_rmp", "classic")
    assert (drive.seed, drive.trigger.distance, trip.at, trip.filmstrip) == (7, 0.5, 2.0, None)


@pytest.mark.parametrize(
    ("laser", "given", "kind"),
    [
        (False, {}, RendererKind.CLASSIC),
        (False, {"odometry": True}, RendererKind.NONE),  # it looks at nothing
        (False, {"odometry": True, "filmstrip": 2.0}, RendererKind.CLASSIC),  # but somebody looks at it
        (True, {}, RendererKind.NONE),
        (True, {"filmstrip": 2.0}, RendererKind.CLASSIC),
        (True, {"renderer": "filament"}, RendererKind.FILAMENT),
        (True, {"takes_pictures": True}, RendererKind.CLASSIC),
        (False, {"odometry": True, "takes_pictures": True}, RendererKind.CLASSIC),
    ],
)
def test_pictures_are_drawn_only_where_somebody_looks(laser: bool, given: dict[str, Any], kind: RendererKind) -> None:
    assert MissionTrip.from_map(learnt(TOLD, laser=laser), **given).drive.renderer is kind


def test_photographs_of_a_robot_that_was_led_without_cameras_are_drawn_as_usual() -> None:
    blind = learnt(TOLD | {"renderer": "none"}, laser=True)
    assert MissionTrip.from_map(blind, takes_pictures=True).drive.renderer is DEFAULT_RENDERER
    with pytest.raises(ScenarioError, match=r"^a photograph, or a scene, needs a renderer; valid are --renderer "):
        MissionTrip.from_map(blind, renderer="none", takes_pictures=True)


@pytest.mark.parametrize("name", ["world", "light", "robot"])
def test_what_the_map_does_not_tell_must_be_said(name: str) -> None:
    map_ = learnt({key: value for key, value in TOLD.items() if key != name}, laser=True)
    with pytest.raises(ScenarioError) as caught:
        MissionTrip.from_map(map_)
    assert str(caught.value) == f"the map does not tell its {name}; valid is to say it: --{name}"
    given: dict[str, Any] = {name: "annex"}
    assert getattr(MissionTrip.from_map(map_, **given).drive, name) == "annex"


def test_a_map_of_a_world_of_one_s_own_asks_for_its_plan() -> None:
    with pytest.raises(ScenarioError) as caught:
        MissionTrip.from_map(learnt(TOLD | {"world": "abbey"}, laser=True))
    whose = "the map was learnt in world 'abbey', which is not the bench's own"
    assert str(caught.value) == f"{whose}; valid is to name its plan: --world FILE.toml"
    assert MissionTrip.from_map(learnt(TOLD | {"world": "abbey"}, laser=True), world="abbey.toml").drive.world


def test_a_plan_of_one_s_own_with_a_name_of_the_library_is_asked_for_too() -> None:
    plan = load_plan("offices").model_copy(update={"name": "hallway"}).model_dump(mode="json")
    namesake = learnt(TOLD | {"config": json.dumps({"plan": plan})}, laser=True)
    with pytest.raises(ScenarioError) as caught:
        MissionTrip.from_map(namesake)
    whose = "the map was learnt in world 'hallway', which is not the bench's own"
    valid = "valid is to name its plan: --world FILE.toml (--world hallway is the bench's, another one)"
    assert str(caught.value) == f"{whose}; {valid}"
    assert MissionTrip.from_map(namesake, world="hallway").drive.world == "hallway"


def test_renderers_that_are_none_and_strips_without_one_are_told() -> None:
    map_ = learnt(TOLD, laser=True)
    with pytest.raises(ScenarioError, match="renderer 'crayon' is unknown; valid are "):
        MissionTrip.from_map(map_, renderer="crayon")
    with pytest.raises(ScenarioError, match="a filmstrip needs a renderer"):
        MissionTrip.from_map(map_, renderer="none", filmstrip=1.0)


@pytest.mark.parametrize(
    ("at", "told"),
    [(-0.1, "start -0.1 m is not on the way"), (3.4, "valid is 0 to 3.4 m, less than that"), (float("nan"), "not on")],
)
def test_a_start_beside_the_way_is_told(at: float, told: str) -> None:
    map_ = learnt(TOLD, laser=True)
    plan = as_learnt(path_along(map_))
    with pytest.raises(ScenarioError, match=told):
        bench_on_way(MissionTrip.from_map(map_, at=at), poses_of(map_, plan), plan)


def test_it_is_set_down_between_the_places_of_its_start_and_looks_along_the_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    opened: list[Any] = []

    class Opened:
        def place(self, pose: Pose) -> None:
            opened.append(pose)

    def opens(drive: Any, *, watched: bool) -> Opened:
        opened.extend([drive.waypoints, watched])
        return Opened()

    monkeypatch.setattr(trips, "open_bench", opens)
    map_ = learnt(TOLD, laser=True)
    plan = as_learnt(path_along(map_))
    poses = poses_of(map_, plan)
    before, after = poses[2], replace(poses[3], y=poses[3].y + 0.4, heading=0.2)  # at 1.7 m and 2.55 m
    poses[3] = after
    bench_on_way(MissionTrip.from_map(map_, at=1.7 + 0.85 / 4), poses, plan)
    (begin, ahead), watched, placed = opened
    ends = np.array([(pose.x, pose.y, pose.heading) for pose in (before, after)])
    assert (placed.x, placed.y, placed.heading) == pytest.approx(np.array([0.75, 0.25]) @ ends)
    assert (begin, ahead, watched) == ((placed.x, placed.y), (after.x, after.y), False)
    opened.clear()
    bench_on_way(MissionTrip.from_map(map_, at=float(plan.path.along[2])), poses, plan)
    assert opened[-1] == before
    turning = [*poses[:2], *[poses[2]] * 3]  # from there on it turns about itself
    with pytest.raises(ScenarioError, match="the way is at its end"):
        bench_on_way(MissionTrip.from_map(map_, at=1.75), turning, plan)


def test_what_befalls_the_robot_while_it_comes_to_rest_is_told_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def runs(bench: Any, _leader: Any, plan: Plan, _goal: Any, *, each: Each, **_more: Any) -> None:
        executor = Executor(plan, localised=False)
        each(executor, bench)
        executor.abort("not over after 3 s")
        executor.touched(Touch(3.4, "bin"))
        each(executor, bench)

    still = SimpleNamespace(pose=Pose(0.0, 0.0, 0.0))
    monkeypatch.setattr(trips, "run_plan", runs)
    monkeypatch.setattr(trips, "bench_on_way", lambda *_: nullcontext(still))
    map_ = learnt(TOLD, laser=True)
    heard: list[str] = []
    trip = MissionTrip.from_map(map_, odometry=True)
    run_trip(trip, map_, as_learnt(path_along(map_)), tell=lambda entry: heard.append(entry.what))
    assert heard[0].startswith("the mission begins")
    assert heard[-2:] == ["aborted: not over after 3 s", "touches bin"]
    assert len(heard) == len(set(heard))


def test_the_goal_behind_a_scene_is_known_once_that_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The way was learnt with a turn at its end, so that the plan first ends where nobody knows."""
    way = MissionPath(np.arange(31), np.arange(31.0), ("MN:30", *[""] * 29, "MT:90"), ())
    places = np.stack([np.arange(31.0), np.zeros(31)], axis=1)
    near = scene()

    def to_the_scene(_bench: Any, executor: Executor, _localiser: Any, **_more: Any) -> DrivenMission:
        executor.move(4.0, 2.0)
        if text != "[LI9]":
            executor.sight(6.0)
        executor.abort()
        return DrivenMission(executor, np.zeros((1, 5)), (), (), {})

    monkeypatch.setattr(runs, "run_mission", to_the_scene)
    robot = SimpleNamespace(limits=robots.load("robuter").limits)
    bench: Any = SimpleNamespace(pose=Pose(0.0, 0.0, 0.0), time=0.0, robot=robot)
    known = {}
    for text in ("[LI1]", "[LI1_LA1]", "[LI1MT90]", "[LI9]"):
        plan = compiled(parse_mission(text), way, Landmarks({"LA1": 20.0}, {"LI1": near, "LI9": near}))
        leader = Leader(TrueWay(way, places), None)
        known[text] = runs.run_plan(bench, leader, plan, known_goal, sensors=None, drive=Drive()).run.goal
    assert known == {"[LI1]": (8.0, 0.0), "[LI1_LA1]": (20.0, 0.0), "[LI1MT90]": NOWHERE, "[LI9]": NOWHERE}


def test_a_map_of_a_real_drive_knows_no_poses() -> None:
    map_ = learn([replace(view, truth=None) for view in VIEWS], sensors=["laser"], metadata=TOLD)
    with pytest.raises(MapError, match="does not know the true poses of its places"):
        poses_of(map_, as_learnt(path_along(map_)))
