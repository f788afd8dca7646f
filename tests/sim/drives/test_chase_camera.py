"""Where the one who takes pictures stands: inside the room, and where the robot is seen."""

import math

import numpy as np
import pytest

from refseq.planar import Pose
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.chase_camera import APART, CAMERA, EXPOSED, ChaseCamera, developed, with_chase_camera
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.sim.bench.lamp import Lamp
from tests.worlds.conftest import SMALL

BOX = """
[[furniture]]
name = "box"
kind = "box"
at = [2.7, 0.4]
width = 0.8
depth = 0.8
height = {height}
material = "door"
"""


def corridor(end: str = "", top: str = "") -> World:
    return with_chase_camera(build_world(parse_plan(SMALL.format(top=top, end=end)), light_named("16:00"), 0))


def eyes(world: World, pose: Pose, bearing: float, name: str = "robuter") -> np.ndarray:
    settings = BenchSettings(renderer=RendererKind.CLASSIC, cameras=())
    with Bench(world, robots.load(name), settings=settings) as bench:
        bench.place(pose)
        ChaseCamera(bench, bearing).look()
        return bench.data.camera(CAMERA).xpos.copy()


@pytest.mark.quick_cases("segway_rmp")
@pytest.mark.parametrize("name", ["robuter", "segway_rmp"])
def test_on_an_empty_floor_it_stands_where_it_was_asked_to(name: str) -> None:
    at = eyes(with_chase_camera(empty_floor("overcast")), Pose(1.0, 2.0, 0.5), -math.pi / 2, name)
    bearing = math.atan2(at[1] - 2.0, at[0] - 1.0)
    assert bearing == pytest.approx(0.5 - math.pi / 2)


@pytest.mark.quick_cases("0.3")
@pytest.mark.parametrize("bearing", [-math.pi / 2, math.pi / 2, 0.3])
def test_in_a_corridor_it_stays_between_the_walls(bearing: float) -> None:
    at = eyes(corridor(), Pose(4.0, 0.0, 0.0), bearing)
    assert abs(at[1]) < 1.2 - APART / 2
    assert math.dist(at[:2], (4.0, 0.0)) > 2.0


@pytest.mark.quick_cases("0.8")
@pytest.mark.parametrize("height", [2.0, 0.8])
def test_it_looks_past_what_hides_the_robot_or_its_wheels(height: float) -> None:
    hiding = BOX.format(height=height)
    free = eyes(corridor(), Pose(4.0, 0.0, 0.0), math.radians(160))
    hidden = eyes(corridor(hiding), Pose(4.0, 0.0, 0.0), math.radians(160))
    assert math.dist(free, hidden) > 0.5


def test_it_sees_in_the_light_that_is_where_it_stands() -> None:
    window = 'window = [{ name = "w", wall = "right", at = 6.5 }]'
    settings, lamp = BenchSettings(renderer=RendererKind.NONE, cameras=()), Lamp(100.0)
    with Bench(corridor(top=window), robots.load("robuter"), settings=settings) as bench:
        bench.renderer = lamp
        for x in (2.0, 5.0):
            bench.place(Pose(x, 0.0, 0.0))
            ChaseCamera(bench, math.pi).look()
            assert lamp.around[-1] == bench.world.ambient.at(bench.data.camera(CAMERA).xpos)
    assert lamp.around[0] != lamp.around[1]


def test_the_middle_of_a_picture_is_never_dark() -> None:
    rng = np.random.default_rng(3)
    for scale in (1e-3, 1.0, 1e4):
        shown = developed((scale * rng.lognormal(0, 1, (40, 60))).astype(np.float32))
        light = EXPOSED**2.2
        assert np.median(shown) == pytest.approx(255 * (light / (1 + light) * (1 + light / 2.25)) ** (1 / 2.2), abs=2)
        assert shown.std() > 20
    assert developed(np.zeros((4, 4), np.float32)).max() == 0


def test_the_onlooker_changes_nothing_of_a_drive() -> None:
    ends = []
    for looking in (False, True):
        settings = BenchSettings(renderer=RendererKind.CLASSIC, cameras=())
        with Bench(with_chase_camera(empty_floor("overcast")), robots.load("robuter"), settings=settings) as bench:
            for i in range(50):
                bench.drive(Twist(0.4, 0.1))
                if looking and i % 20 == 0:
                    picture = ChaseCamera(bench).look()
                    assert picture.std() > 5
            ends.append(bench.data.qpos.copy())
    np.testing.assert_array_equal(*ends)
