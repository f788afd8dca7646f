"""What the recorder adds to the calls that it cannot do without: physics, rays, pictures.

Both are told apart while it records, so that rays and pictures are those that the sensors ask for.
"""

import gc
import weakref
from itertools import islice
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import refseq_bench.sim.bench.bench
from refseq.logs import RecordingWriter
from refseq_bench import robots
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.cameras.camera import Camera
from refseq_bench.sim.cameras.sensor import Sensor
from refseq_bench.sim.drives.operator import Operator
from refseq_bench.sim.drives.recorder import drive_and_sense, operator_for
from refseq_bench.sim.drives.trigger import Trigger
from refseq_bench.sim.rendering.drivers import vulkan_device
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.sim.sensors.laser import Laser
from refseq_bench.worlds.build import build_world
from refseq_bench.worlds.light import light_named
from refseq_bench.worlds.plans.load import load_plan
from tests.benchmarks.stopwatch import Stopwatch

pytestmark = pytest.mark.benchmark
VIEWS = 8
LIGHTS = {"16:00": 1.1, "late-evening": 1.25}
"""Lights, and what recording under them may cost over its raw calls: by lamps alone a frame takes half the time that it
takes in the sun, and the shutter is open longer, so that pictures are blurred along longer paths."""
KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    RendererKind.NONE,
]


RAW = ("mj_step", "mj_multiRay", "mj_ray", "render")
PARTS: tuple[tuple[object, str, str], ...] = (
    (mujoco, "mj_step", "mj_step"),
    (mujoco, "mj_multiRay", "mj_multiRay"),
    (mujoco, "mj_ray", "mj_ray"),
    (Camera, "adapt", "meter"),
    (Sensor, "read", "noise"),
    (Camera, "expose", "rest of the camera"),
    (refseq_bench.sim.bench.bench, "paths", "paths of the blur"),
    (refseq_bench.sim.bench.bench, "smeared", "blur"),
    (Laser, "scan", "laser"),
    (Operator, "command", "operator"),
    (Bench, "drive", "drive"),
    (RecordingWriter, "write", "MCAP"),
    (cv2, "imencode", "PNG"),
)
"""What is watched, and the name that its time counts for; ``render`` is the renderer's own."""


def recorded(bench: Bench, path: Path, patch: pytest.MonkeyPatch) -> dict[str, NDArray[np.float64]]:
    """Milliseconds a view that the recorder takes, of the clock and of the processor, by part."""
    watch = Stopwatch()
    for owner, call, name in PARTS:
        watch.watch(patch, owner, call, name)
    watch.watch(patch, bench.renderer, "radiance", "render")
    with watch.counting("other"), RecordingWriter(path, {}) as writer:
        for taken in islice(drive_and_sense(bench, operator_for(bench, 1), Trigger()), VIEWS):
            writer.write(taken.view, taken.odometry)
    return {name: 1e3 * seconds / VIEWS for name, seconds in watch.spent.items()}


def ratio_of(spent: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """All over the raw calls, by the clock and by the processor; prints the parts."""
    ratio = sum(spent.values(), np.zeros(2)) / sum((spent[name] for name in RAW if name in spent), np.zeros(2))
    print(f"{VIEWS} views of the hallway        [ms a view, of the clock and of the processor]")
    for name in sorted(spent, key=lambda name: (name not in RAW, -spent[name][1])):
        print(f"{name:20s} {spent[name][0]:8.2f} {spent[name][1]:8.2f}{'  raw' * (name in RAW)}")
    print("all, over raw calls  {:8.3f} {:8.3f}".format(*ratio))
    return ratio


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("kind", KINDS)
def test_recording_costs_little_more_than_its_raw_calls(
    kind: RendererKind, light: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = build_world(load_plan("hallway"), light_named(light), 0)
    with Bench(world, robots.load("robuter"), settings=BenchSettings(renderer=kind)) as bench:
        bench.sense()  # the first frames of a device compile its programs: that is paid once, not for every view
        print(f"\n{kind.value}, {light}: ", end="")
        ratio = ratio_of(recorded(bench, tmp_path / "drive.mcap", monkeypatch))
    # By the processor, as a busy machine disturbs that less. Without pictures there is little to do, and Python's share
    # is large.
    assert ratio[1] < (LIGHTS[light] if kind is RendererKind.FILAMENT else 2.5)


def resident() -> float:
    """Memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux' own count of memory")
@pytest.mark.parametrize("kind", KINDS)
def test_closed_benches_give_their_memory_back(kind: RendererKind) -> None:
    sizes, inside, benches = [resident()], [], []
    for _ in range(6):
        with open_bench(Drive(renderer=kind)) as bench:
            bench.sense()
            inside.append(resident())
        benches.append(weakref.ref(bench))
        del bench
        gc.collect()  # a world's spec and its elements hold each other
        sizes.append(resident())
    print(f"\n{kind.value}: {sizes[0]:.0f} MiB before; first bench open {inside[0]:.0f} MiB;")
    print(f"  after closing each of 6: {', '.join(f'{size:.0f}' for size in sizes[1:])} MiB")
    assert not any(bench() for bench in benches)
    # Allocators keep some of it for the next one; benches that were never freed would add up to four times one's size.
    # That is the first one's: what is open later holds what those before it left. Both are 0 where a bench fits into
    # what was kept of others, whose pictures were drawn before.
    assert sizes[6] - sizes[2] <= max(inside[0] - sizes[0], 0.0)
