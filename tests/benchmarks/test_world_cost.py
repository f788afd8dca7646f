"""What each world costs: loading, memory, a frame by renderer, and what a view takes beside its raw frames.

Times are of the clock and of the processor, which a busy machine disturbs less.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import NamedTuple

import pytest

from refseq_bench import robots
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.world_survey.snapshots import places_on, pose_along
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan, world_names
from tests.benchmarks.peak import peak_bytes
from tests.benchmarks.stopwatch import Stopwatch

pytestmark = pytest.mark.benchmark
LIGHTS = ("16:00", "late-evening")
KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    pytest.param(RendererKind.BAKED, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
    pytest.param(RendererKind.CLASSIC, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
]


class Loading(NamedTuple):
    """Times of the clock and of the processor [s] to build, to open a bench and to take the first view.

    ``memory`` is the most that the process held before each of these and at the end [MiB].
    """

    build: list[float]
    bench: list[float]
    view: list[float]
    memory: list[float]


def most_resident() -> float:
    return peak_bytes() / 2**20


def loading(name: str, kind: RendererKind) -> Loading:
    """Load a world; in a process of its own, as memory that others left counts too."""
    watch, memory = Stopwatch(), [most_resident()]
    with watch.counting("build"):
        world = build_world(load_plan(name), light_named("16:00"), seed=0)
        world.ambient.grids  # noqa: B018 - the light from all sides is worked out once it is asked, and is a world's cost
    memory.append(most_resident())
    with watch.counting("bench"):
        bench = Bench(world, robots.load("robuter"), settings=BenchSettings(renderer=kind))
    memory.append(most_resident())
    with bench, watch.counting("view"):
        bench.sense()
    return Loading(*(watch.spent[part].tolist() for part in ("build", "bench", "view")), [*memory, most_resident()])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", world_names())
def test_loading(name: str, kind: RendererKind) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        cost = pool.submit(loading, name, kind).result()
    times = ", ".join(f"{part} {' '.join(f'{t:.1f}' for t in getattr(cost, part))}" for part in cost._fields[:3])
    print(f"\n{name:12s} {kind.value:8s} [s of clock, processor] {times}; [MiB] ", end="")
    print(" ".join(f"{most:.0f}" for most in cost.memory), end="")
    # A plan is built from nothing, lit and measured; the bench only compiles it, or bakes its light.
    assert cost.bench[1] < (8 if kind is RendererKind.BAKED else 2) * cost.build[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", world_names())
def test_a_view_costs_little_more_than_its_frames(
    name: str, light: str, kind: RendererKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At three places of the route, twice each."""
    world, places = build_world(load_plan(name), light_named(light), seed=0), places_on(Drive(world=name), None)
    with Bench(world, robots.load("robuter"), settings=BenchSettings(renderer=kind)) as bench:
        bench.sense()  # the first frames of a device compile its programs
        watch = Stopwatch()
        watch.watch(monkeypatch, bench.renderer, "radiance", "frames")
        for place in (*places, *places):
            bench.place(pose_along(bench.route, place))
            with watch.counting("view"):
                bench.sense()
    spent = {part: 1e3 * watch.spent[part] / (2 * len(places)) for part in ("frames", "view")}
    frame = spent["frames"] / len(bench.robot.cameras)
    whole = (spent["frames"] + spent["view"]) / spent["frames"]
    print(
        f"\n{name:12s} {light:12s} {kind.value:8s} [ms of clock, processor] a frame {frame[0]:.0f} {frame[1]:.0f}, ",
        end="",
    )
    rest = "rest of a view {:.0f} {:.0f}".format(*spent["view"])
    print(f"{rest}; view over frames {whole[0]:.2f} {whole[1]:.2f}", end="")
    assert whole[1] < (1.2 if kind is RendererKind.FILAMENT else 3.0)
