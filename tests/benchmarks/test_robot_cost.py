"""How much faster than real time each robot runs without cameras, and where the time goes.

In the hallway, where beams and sound meet 400 geoms. Times are of the processor, which a busy machine disturbs less
than the clock; what is held are shares and ratios of one run.
"""

from collections.abc import Iterator

import pytest

from refseq_bench import robots
from refseq_bench.robots import Twist
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.control_period import CONTROL_PERIOD
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import World, build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.benchmarks.stopwatch import Stopwatch

pytestmark = pytest.mark.benchmark
LAP, LAPS = 4.0, 6
"""Simulated seconds of a lap, and how many there are."""
PARTS = ("physics", "control layer", "signals", "laser", "other")


@pytest.fixture(scope="module")
def hallway() -> World:
    return build_world(load_plan("hallway"), light_named("16:00"), seed=0)


@pytest.fixture
def bench(hallway: World, request: pytest.FixtureRequest) -> Iterator[Bench]:
    settings = BenchSettings(renderer=RendererKind.NONE)
    with Bench(hallway, robots.load(request.param), settings=settings) as opened:
        for _ in range(50):
            opened.drive(Twist())
        yield opened


def spent_on(bench: Bench, scanning: bool, patch: pytest.MonkeyPatch) -> dict[str, float]:
    """Drive down the middle of the hallway; processor time of each part [ms] for a simulated second.

    Of the cheapest lap: caches that others fill make the same work up to twice as dear.
    """
    watch, laps = Stopwatch(), []
    with patch.context() as watched:
        watch.watch(watched, bench._physics, "step", "physics")
        watch.watch(watched, bench._hardware, "signals", "signals")
        watch.watch(watched, bench.control, "tick", "control layer")
        watch.watch(watched, bench, "new_scan", "laser")
        for _ in range(LAPS):
            with watch.counting("lap"):
                pass
            watch.reset()
            with watch.counting("other"):
                _drive(bench, scanning)
            laps.append({part: float(watch.spent[part][1]) * 1e3 / LAP for part in PARTS})
    return min(laps, key=lambda lap: sum(lap.values()))


def _drive(bench: Bench, scanning: bool) -> None:
    for _ in range(round(LAP / CONTROL_PERIOD)):
        bench.drive(Twist(0.3, 0.0))
        if scanning:
            bench.scan()


@pytest.mark.parametrize("bench", robots.names(), indirect=True)
@pytest.mark.parametrize("scanning", [False, True], ids=["driving", "scanning"])
def test_where_the_time_goes(bench: Bench, scanning: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    spent = spent_on(bench, scanning, monkeypatch)
    whole = sum(spent.values())
    print(
        f"\n{bench.robot.name:18s} {'5 scans/s' if scanning else 'no scans':9s} {1e3 / whole:4.0f}x real time; ", end=""
    )
    print(f"[ms of processor a simulated second] {whole:.1f}: ", end="")
    print(", ".join(f"{part} {cost:.1f}" for part, cost in spent.items()), end="")
    # The machine that runs robots must not cost more than what they are there for: moving and seeing.
    assert spent["other"] < 0.3 * whole
    assert spent["control layer"] + spent["signals"] < 4 * spent["physics"] + spent["laser"]
