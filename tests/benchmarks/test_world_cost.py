"""What each world costs: loading, memory, a frame by renderer, and what a view takes beside its raw frames."""

import time
from pathlib import Path

import pytest

import robots
from sim.bench import Bench, BenchSettings
from sim.drivers import gl_backend, vulkan_device
from sim.render import RendererKind
from worlds.build import build
from worlds.light import light_named
from worlds.plan import load_plan, names

pytestmark = pytest.mark.benchmark
LIGHTS = ("16:00", "late-evening")
VIEWS = 5
KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    pytest.param(RendererKind.CLASSIC, marks=pytest.mark.skipif(gl_backend() is None, reason="no OpenGL")),
]


def resident() -> float:
    """Memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


@pytest.mark.parametrize("name", names())
def test_loading(name: str) -> None:
    start = time.perf_counter()
    plan = load_plan(name)
    world = build(plan, light_named("16:00"), seed=0)
    built = time.perf_counter()
    model = world.spec.compile()
    compiled = time.perf_counter()
    print(f"\n{name}: build {built - start:.1f} s, compile {compiled - built:.1f} s, {model.ngeom} geoms, ", end="")
    print(f"{model.nlight} lights, textures {model.ntexdata / 2**20:.0f} MiB, process {resident():.0f} MiB")
    # What is drawn and lit costs most; the physics model of a world that stands still must not.
    assert compiled - built < built - start


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", names())
def test_a_view_costs_little_more_than_its_frames(name: str, light: str, kind: RendererKind) -> None:
    world = build(load_plan(name), light_named(light), seed=0)
    with Bench(world, robots.load("robuter"), settings=BenchSettings(renderer=kind)) as bench:
        bench.sense()
        spent = dict.fromkeys(bench.robot.cameras, 0.0)
        whole = 0.0
        for _ in range(VIEWS):
            start = time.perf_counter()
            bench.sense()
            whole += time.perf_counter() - start
            for camera in spent:
                start = time.perf_counter()
                bench.renderer.radiance(bench.data, f"{bench.robot.name}/{camera}")
                spent[camera] += time.perf_counter() - start
        memory = resident()
    raw = sum(spent.values())
    frames = ", ".join(f"{camera} {1e3 * seconds / VIEWS:.0f}" for camera, seconds in spent.items())
    print(f"\n{name} at {light}, {kind.value}: ms a frame {frames}; a view {whole / raw:.2f} of that; {memory:.0f} MiB")
    assert whole / raw < (1.5 if kind is RendererKind.FILAMENT else 4.0)
