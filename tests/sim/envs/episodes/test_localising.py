"""The localiser of an environment: its views are of the time that they tell."""

import math
from functools import reduce
from typing import cast

import numpy as np
import pytest

from refseq.map.map import Map
from refseq.planar import after_motion
from refseq.view import View
from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.envs.episodes import localising
from refseq_bench.sim.envs.tasks.task import Looking
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser_model import LaserModel
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import parse_plan
from tests.worlds.conftest import SMALL

EXACT = BenchSettings(RendererKind.NONE, laser=LaserModel(sigma=0.0, weak_sigma=0.0, bias_limit=0.0))


class Listener:
    """Stands for a localiser, and keeps the views that it is given."""

    def __init__(self, map_: Map) -> None:
        self.views: list[View] = []

    def update(self, view: View) -> None:
        self.views.append(view)


def test_a_view_has_the_scan_of_its_own_time_though_an_older_one_is_there_to_steer_by(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(localising, "Localiser", Listener)
    world = build_world(parse_plan(SMALL.format(top="", end="")), light_named("16:00"), pictured=False)
    with Bench(world, robots.load("robuter"), settings=EXACT) as bench:
        following = localising.Following(cast("Map", None), bench, Looking())
        for _ in range(6):
            bench.drive(Twist(0.5, 0.5))
        steered_by = bench.scan()
        for _ in range(4):
            bench.drive(Twist(0.5, 0.5))
        assert bench.scan() is steered_by
        following.look()
        view = cast("Listener", following._localiser).views[-1]
        assert view.time == bench.time
        assert view.scan is not None
        assert np.array_equal(view.scan.ranges, bench.new_scan().ranges)
        assert not np.array_equal(view.scan.ranges, steered_by.ranges)
        assert bench.scan() is steered_by, "the robot steers by what its line sends"


def test_motions_of_the_views_lead_to_where_the_odometer_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(localising, "Localiser", Listener)
    with Bench(empty_floor(), robots.load("robuter"), settings=EXACT) as bench:
        start = bench.odometry
        following = localising.Following(cast("Map", None), bench, Looking(distance=0.3, turn=None))
        for _ in range(100):
            bench.drive(Twist(0.5, 0.4))
            following.after_period()
        views = cast("Listener", following._localiser).views
        assert len(views) > 4
        assert all(view.distance == pytest.approx(0.3, abs=0.03) for view in views[1:])
        shown = reduce(lambda pose, view: after_motion(pose, view.distance, view.turn), views, start)
        left = math.dist((shown.x, shown.y), (bench.odometry.x, bench.odometry.y))
        assert left == pytest.approx(following.gone, abs=0.03)
        following.look()
        shown = after_motion(shown, views[-1].distance, views[-1].turn)
        assert (shown.x, shown.y) == pytest.approx((bench.odometry.x, bench.odometry.y), abs=0.03)
        assert following.gone == 0.0
