"""Pictures a second that this machine draws, renderer by renderer."""

import statistics
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import open_bench
from refseq_bench.scenarios.world_survey.snapshots import places_on, pose_along
from refseq_bench.sim.errors import RendererError
from refseq_bench.sim.rendering.renderer import RendererKind

ROUNDS = 3
"""Pictures by each camera at each place; their median is told, as other programs delay some."""


@dataclass(frozen=True, slots=True)
class FrameRate:
    """What a renderer takes by the clock [s]: ``first`` until the first view is there, ``frame`` a picture thereafter.

    World and light are made before the first view. A picture has 640 × 480 pixels.
    """

    renderer: RendererKind
    first: float
    frame: float


def frame_rates(world: str, light: str) -> Iterator[FrameRate]:
    """Each renderer that draws and starts here. Raises the rooms' errors for names of worlds and lights."""
    for kind in RendererKind:
        if kind is not RendererKind.NONE:
            with suppress(RendererError):
                yield frame_rate(Drive(world=world, light=light, renderer=kind))


def frame_rate(drive: Drive) -> FrameRate:
    """The renderer of a drive, at three places of its route by all cameras of its robot. Raises ``RendererError``."""
    places, took, began = places_on(drive, None), [], time.perf_counter()
    with open_bench(drive) as bench:
        bench.sense()  # the first pictures of a device compile its programs
        first = time.perf_counter() - began
        cameras = [bench.model.camera(number).name for number in range(bench.model.ncam)]
        for place in places * ROUNDS:
            bench.place(pose_along(bench.route, place))
            for camera in cameras:
                asked = time.perf_counter()
                bench.renderer.radiance(bench.data, camera)
                took.append(time.perf_counter() - asked)
    return FrameRate(drive.renderer, first, statistics.median(took))
