"""What the recorder adds to the calls that it cannot do without: physics, rays, pictures."""

import gc
import time
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import robots
from refseq.logs import RecordingWriter
from refseq.view import View
from robots import Twist
from scenarios.record import Drive, open_bench
from sim.beams import SEEN_GROUPS, directions
from sim.bench import Bench, BenchSettings
from sim.drivers import vulkan_device
from sim.recorder import Trigger, drive_and_sense, operator_for
from sim.render import RendererKind
from worlds.build import build
from worlds.light import light_named
from worlds.plan import load_plan

pytestmark = pytest.mark.benchmark
VIEWS = 6
KINDS = [
    pytest.param(RendererKind.FILAMENT, marks=pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan device")),
    RendererKind.NONE,
]


@dataclass
class Raw:
    """What was asked of MuJoCo in a drive: the wheels' commands, and after which of them a view was taken."""

    start: NDArray[np.float64]
    commands: list[NDArray[np.float64]] = field(default_factory=list)
    views: list[int] = field(default_factory=list)


class Watched(Bench):
    """A bench that notes what it asks for."""

    raw: Raw

    def drive(self, twist: Twist) -> None:
        super().drive(twist)
        self.raw.commands.append(self.data.ctrl.copy())

    def sense(self) -> View:
        self.raw.views.append(len(self.raw.commands))
        return super().sense()


def recorded(bench: Watched, path: Path) -> float:
    """Seconds that the recorder takes for ``VIEWS`` views."""
    bench.raw = Raw(bench.data.qpos.copy())
    start = time.perf_counter()
    with RecordingWriter(path, {}) as writer:
        for taken in islice(drive_and_sense(bench, operator_for(bench, 1), Trigger()), VIEWS):
            writer.write(taken.view, taken.odometry)
    return time.perf_counter() - start


def repeated(bench: Watched) -> dict[str, float]:
    """Seconds that the same calls take by themselves, by kind."""
    model, data, prefix = bench.model, mujoco.MjData(bench.model), f"{bench.robot.name}/"
    data.qpos[:] = bench.raw.start
    mujoco.mj_forward(model, data)
    rays = directions().ravel()
    hits, ranges = np.empty(len(rays) // 3, np.int32), np.empty(len(rays) // 3)
    base, site = model.body(prefix + bench.robot.base).id, model.site(prefix + bench.robot.laser).id
    steps = round(bench.time / model.opt.timestep / len(bench.raw.commands))
    spent = dict.fromkeys(("mj_step", "mj_multiRay", "render"), 0.0)
    for number in range(len(bench.raw.commands) + 1):
        if number:
            data.ctrl[:] = bench.raw.commands[number - 1]
            start = time.perf_counter()
            mujoco.mj_step(model, data, nstep=steps)
            spent["mj_step"] += time.perf_counter() - start
        if number in bench.raw.views:
            start = time.perf_counter()
            mujoco.mj_multiRay(
                model, data, data.site_xpos[site], rays, SEEN_GROUPS, True, base, hits, ranges, None, len(hits), 100.0
            )
            spent["mj_multiRay"] += time.perf_counter() - start
            if bench.renderer.kind is not RendererKind.NONE:
                start = time.perf_counter()
                for camera in bench.robot.cameras:
                    bench.renderer.radiance(data, prefix + camera)
                spent["render"] += time.perf_counter() - start
    return spent


@pytest.mark.parametrize("kind", KINDS)
def test_recording_costs_little_more_than_its_raw_calls(kind: RendererKind, tmp_path: Path) -> None:
    world = build(load_plan("hallway"), light_named("16:00"), 0)
    with Watched(world, robots.load("robuter"), settings=BenchSettings(renderer=kind)) as bench:
        if kind is not RendererKind.NONE:
            # The first frames of a device compile its programs: that is paid once, not for every view.
            for camera in bench.robot.cameras:
                bench.renderer.radiance(bench.data, f"robuter/{camera}")
        whole = recorded(bench, tmp_path / "drive.mcap")
        raw = repeated(bench)
    total = sum(raw.values())
    parts = ", ".join(f"{name} {1e3 * seconds:.0f}" for name, seconds in raw.items())
    print(f"\n{kind.value}: {VIEWS} views, {len(bench.raw.commands)} commands: {1e3 * whole:.0f} ms recorded;")
    print(f"  raw calls {1e3 * total:.0f} ms ({parts}); ratio {whole / total:.2f}")
    # Without pictures there is little to do, and Python's share is large.
    assert whole / total < (1.5 if kind is RendererKind.FILAMENT else 4.0)


def resident() -> float:
    """Memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads Linux' own count of memory")
@pytest.mark.parametrize("kind", KINDS)
def test_closed_benches_give_their_memory_back(kind: RendererKind) -> None:
    sizes = [resident()]
    for _ in range(4):
        with open_bench(Drive(renderer=kind)) as bench:
            bench.sense()
            inside = resident()
        del bench
        gc.collect()  # a world's spec and its elements hold each other
        sizes.append(resident())
    print(f"\n{kind.value}: {sizes[0]:.0f} MiB before; last bench open {inside:.0f} MiB;")
    print(f"  after closing each of 4: {', '.join(f'{size:.0f}' for size in sizes[1:])} MiB")
    # Allocators keep some of it for the next one; benches that were never freed would add up to twice one's size.
    assert sizes[4] - sizes[2] < inside - sizes[0]
