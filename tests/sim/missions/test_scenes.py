"""A mission that seeks a scene, in a rendered world: the robot stops where the scene was cut."""

import math
from dataclasses import replace

import pytest

from refseq.errors import SceneError
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.profile import BEST
from refseq.missions import Executor, ExecutorSettings, Landmarks, Status, compiled, parse_mission, path_along
from refseq.scenes import Scene, SceneFinder, cut_scene
from refseq.view import View
from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.behaviour_drive import run_and_sense
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.missions.mission import DrivenMission, run_mission
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.refseq.scenes.drawn import picture

pytestmark = pytest.mark.slow
LEFT = "camera-2"
SEEING = BenchSettings(RendererKind.CLASSIC, cameras=(LEFT,))


@pytest.fixture(scope="module")
def offices() -> World:
    return build_world(load_plan("offices"), light_named("16:00"))


@pytest.fixture(scope="module")
def views(offices: World) -> list[View]:
    with Bench(offices, robots.load("robuter"), seed=3, settings=SEEING) as bench:
        return [one.view for one in run_and_sense(bench, ["MN:20"], Trigger())]


@pytest.fixture(scope="module")
def richest(views: list[View]) -> View:
    """The view that shows most, of the middle of the drive."""
    middle = views[len(views) // 3 : 2 * len(views) // 3]
    return max(middle, key=lambda view: _keys(cut_scene(view, LEFT)))


def _keys(scene: Scene) -> int:
    try:
        return SceneFinder(scene).keys
    except SceneError:
        return 0


def driven(world: World, views: list[View], scene: Scene) -> DrivenMission:
    """The mission to stop at a scene, led by the laser, at another seed."""
    map_ = learn([replace(view, images={}) for view in views], profile=BEST)
    plan = compiled(parse_mission("[LI1]"), path_along(map_), Landmarks({}, {"LI1": scene}))
    with Bench(world, robots.load("robuter"), seed=1003, settings=SEEING) as bench:
        executor = Executor(plan, settings=ExecutorSettings(timeout=300.0))
        return run_mission(bench, executor, Localiser(map_), trigger=Trigger(0.6))


def test_it_stops_where_the_scene_was_cut(offices: World, views: list[View], richest: View) -> None:
    done = driven(offices, views, cut_scene(richest, LEFT))
    assert done.executor.status is Status.COMPLETED, done.executor.log
    assert richest.truth is not None
    assert math.dist(done.track[-1, 1:3], (richest.truth.x, richest.truth.y)) < 0.6


def test_a_scene_from_elsewhere_is_not_found(offices: World, views: list[View], richest: View) -> None:
    stranger = cut_scene(replace(richest, images={LEFT: picture(5)}), LEFT)
    done = driven(offices, views, stranger)
    assert done.executor.why == "LI1 was not seen on the way"
