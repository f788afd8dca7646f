"""Pictures with baked light, and Filament's, against pictures by paths of light: three worlds at three hours."""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from refseq_bench import robots
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.rendering.drivers import gl_backend, vulkan_device
from refseq_bench.sim.rendering.frustum import eye_of
from refseq_bench.sim.rendering.renderer import RendererKind
from refseq_bench.worlds import build_world, light_named, load_plan
from tests.sim.rendering.baked.path_tracer import PathTracer
from tests.sim.rendering.test_renderers import ALBEDO, MATT, SUN, card

pytestmark = pytest.mark.skipif(gl_backend() is None, reason="no OpenGL on this machine")
WIDTH, HEIGHT = 160, 120
BLOCK = 10
"""Luminance is compared over blocks of so many pixels, in which the paths' noise is small."""
Picture = NDArray[np.float64]


@dataclass(frozen=True)
class Likeness:
    """``median`` of luminance over the paths', ``deviation`` from them [octaves, rms], and ``structure`` (SSIM)."""

    median: float
    deviation: float
    structure: float


@cache
def seen_in(world: str, light: str, kind: RendererKind) -> Picture:
    """The forward camera's luminance at the start of the route, four times as fine and then made small."""
    with _bench(world, light, kind) as bench:
        large = bench.renderer.radiance(bench.data, _camera(bench), 4 * WIDTH, 4 * HEIGHT)
    return np.asarray(cv2.resize(large, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA), float)


@cache
def traced(world: str, light: str, samples: int) -> tuple[Picture, NDArray[np.bool_]]:
    """The same by paths, and which pixels show surfaces and no source."""
    with _bench(world, light, RendererKind.NONE) as bench:
        tracer, seen = PathTracer(bench.world, bench.model), eye_of(bench.model, bench.data, _camera(bench))
        return tracer.picture(seen, WIDTH, HEIGHT, samples), ~tracer.glows(seen, WIDTH, HEIGHT)


def _bench(world: str, light: str, kind: RendererKind) -> Bench:
    built = build_world(load_plan(world), light_named(light))
    return Bench(built, robots.load("robuter"), settings=BenchSettings(renderer=kind))


def _camera(bench: Bench) -> str:
    return next(name for name in (bench.model.camera(k).name for k in range(bench.model.ncam)) if "camera-1" in name)


def likeness(picture: Picture, paths: Picture, shown: NDArray[np.bool_]) -> Likeness:
    ratios = np.log2(_blocks(picture, shown) / _blocks(paths, shown))
    ratios = ratios[np.isfinite(ratios)]
    return Likeness(2 ** float(np.median(ratios)), float(np.sqrt(np.mean(ratios**2))), structure(picture, paths))


def _blocks(picture: Picture, shown: NDArray[np.bool_]) -> Picture:
    """Means over blocks, of the pixels that are shown; none where these are few."""
    parts = (HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK)
    count = shown.reshape(parts).sum(axis=(1, 3))
    total = np.where(shown, picture, 0.0).reshape(parts).sum(axis=(1, 3))
    return np.where(count > BLOCK**2 / 3, total, np.nan) / np.maximum(count, 1)


def structure(one: Picture, other: Picture) -> float:
    """Mean structural similarity (Wang et al. 2004, Gaussian window of 1.5 pixels) of pictures as on a screen."""
    white = float(np.quantile(other, 0.95))
    x, y = (np.clip(cv2.medianBlur((p / white).astype(np.float32), 3), 0.0, 1.0) ** (1 / 2.2) for p in (one, other))

    def mean(values: Picture) -> Picture:
        return np.asarray(cv2.GaussianBlur(values, (11, 11), 1.5))

    mx, my = mean(x), mean(y)
    vx, vy, cov = mean(x * x) - mx**2, mean(y * y) - my**2, mean(x * y) - mx * my
    c1, c2 = 0.01**2, 0.03**2
    return float(np.mean((2 * mx * my + c1) * (2 * cov + c2) / ((mx**2 + my**2 + c1) * (vx + vy + c2))))


def test_the_paths_return_albedo_times_illuminance_over_pi() -> None:
    """The oracle itself, under a sun that stands above: no source but this one."""
    angle = np.radians(30.0)
    model, data = card(SUN.format(dir=f"{np.sin(angle)} 0 {-np.cos(angle)}", shadow="true"), "", 0.0, MATT)
    open_air = build_world(load_plan("car-park"), light_named("16:00"))
    found = PathTracer(open_air, model, sky=0.0, ground=0.0).picture(eye_of(model, data, "down"), 20, 15, 2)
    np.testing.assert_allclose(found, 1000 * np.cos(angle) * ALBEDO / np.pi, rtol=1e-3)


@pytest.mark.slow
def test_baked_light_is_that_of_paths() -> None:
    paths, shown = traced("offices", "16:00", 24)
    found = likeness(seen_in("offices", "16:00", RendererKind.BAKED), paths, shown)
    assert found.median == pytest.approx(1.0, abs=0.1)
    assert found.deviation < 0.3


@pytest.mark.slow
@pytest.mark.skipif(vulkan_device() is None, reason="no Vulkan on this machine")
@pytest.mark.parametrize("light", ["16:00", "18:00", "overcast"])
@pytest.mark.parametrize("world", ["hallway", "laboratory", "car-park"])
def test_baked_light_is_nearer_to_that_of_paths_than_filaments(world: str, light: str) -> None:
    paths, shown = traced(world, light, 200)
    kinds = (RendererKind.FILAMENT, RendererKind.BAKED)
    before, now = (likeness(seen_in(world, light, kind), paths, shown) for kind in kinds)
    for kind, one in zip(kinds, (before, now), strict=True):
        print(f"| {world}, {light} | {kind} | {one.median:.2f} | {one.deviation:.2f} | {one.structure:.3f} |")
    assert now.median == pytest.approx(1.0, abs=0.15)
    assert now.deviation < min(0.35, before.deviation)
    assert now.structure > before.structure - 0.01
