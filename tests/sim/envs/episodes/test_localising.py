"""The localiser of an environment: its views are of the time that they tell."""

from typing import cast

import numpy as np
import pytest

from refseq.map.map import Map
from refseq.view import View
from refseq_bench import robots
from refseq_bench.robots import Twist
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
