"""The picture of a robot: three views to scale with measures, and one as a bystander sees it."""

import math

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from refseq_bench import robots
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.robot_checks.body import Body
from refseq_bench.scenarios.robot_checks.drawings import MEASURE, SOURCE, draw_views
from refseq_bench.sim.acceptance.floor import empty_floor
from refseq_bench.sim.bench.bench import Bench
from refseq_bench.sim.bench.settings import BenchSettings
from refseq_bench.sim.drives.chase_camera import ChaseCamera, with_chase_camera
from refseq_bench.sim.rendering.renderer import DEFAULT_RENDERER, RendererKind

LIGHT = "10:30"
BEARING, DISTANCE, EYES = math.radians(-40), 2.2, 1.45
"""Where the bystander stands: to the right of what is ahead, [rad, m, m]."""
WIDTH, HEIGHT = 10.0, 5.0
"""Size of the sheet [inch]."""
STILL = 0.4
"""Share of its width that the bystander's picture takes."""
KEY = ("measured in the model [m]", "sizes that sources give")
SETTLED = 1.0
"""Time that the robot stands before it is looked at [s]."""


def picture(body: Body, renderer: RendererKind = DEFAULT_RENDERER) -> Figure:
    """Draw the robot ``body`` is the model of."""
    name = body.robot.name
    seen = _seen(name, renderer)
    with mpl.rc_context({**AS_WRITTEN, "font.size": 9, "svg.fonttype": "none"}):
        figure = Figure(figsize=(WIDTH, HEIGHT), dpi=140, facecolor="white")
        draw_views(figure.add_axes((0.005, 0.02, 0.575, 0.96)), body)
        side = STILL * WIDTH / HEIGHT
        still = figure.add_axes((0.99 - STILL, 0.93 - side, STILL, side), xticks=[], yticks=[])
        still.imshow(_square(seen), cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
        still.set_title(name, fontsize=11)
        lines = [Line2D([], [], color=MEASURE, lw=1), Line2D([], [], color=SOURCE, lw=1.1, ls=(0, (4, 2)))]
        below = (0.99 - STILL / 2, 0.92 - side)
        figure.legend(lines, KEY, loc="upper center", bbox_to_anchor=below, frameon=False)
    return figure


def _square(seen: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The middle of a picture (height, width), as wide as it is high: a robot is no wider."""
    height, width = seen.shape
    left = (width - height) // 2
    return seen[:, left : left + height]


def _seen(name: str, renderer: RendererKind) -> NDArray[np.uint8]:
    """The robot on an empty floor."""
    world, settings = with_chase_camera(empty_floor(LIGHT)), BenchSettings(renderer=renderer, cameras=())
    with Bench(world, robots.load(name), settings=settings) as bench:
        while bench.time < SETTLED:
            bench.wait()
        return ChaseCamera(bench, BEARING, DISTANCE, EYES).look()
