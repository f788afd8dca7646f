"""Coming to rest: out of any motion, turns on the spot among them, within its time."""

import pytest

from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.rest import STOPPING, come_to_rest
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind


@pytest.mark.quick_cases("ahead-segway_rmp", "on the spot-robuter")
@pytest.mark.parametrize("name", ["robuter", "segway_rmp"])
@pytest.mark.parametrize("twist", [Twist(), Twist(0.4, 0.0), Twist(0.0, 0.5)], ids=["none", "ahead", "on the spot"])
def test_a_robot_comes_to_rest_and_each_period_is_told(name: str, twist: Twist) -> None:
    with Bench(empty_floor(), robots.load(name), settings=BenchSettings(renderer=RendererKind.NONE)) as bench:
        for _ in range(50):
            bench.drive(twist)
        assert bench.state.stands is (twist == Twist())
        began, times = bench.time, list[float]()
        come_to_rest(bench, lambda: times.append(bench.time))
        assert bench.state.stands
        assert STOPPING[0] - 1e-9 <= bench.time - began < STOPPING[1]
        assert times == pytest.approx([began + (n + 1) * CONTROL_PERIOD for n in range(len(times))])
        assert times[-1] == bench.time
