"""The picture of a robot: three views to scale with measures, and one as a bystander sees it."""

import math

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

import robots
from scenarios.robots_body import Body
from scenarios.robots_views import MEASURE, SOURCE, draw_views
from sim.bench import Bench, BenchSettings
from sim.floor import empty_floor
from sim.onlooker import Onlooker, with_onlooker
from sim.render import RendererKind

LIGHT = "10:30"
BEARING, DISTANCE, EYES = math.radians(-40), 2.2, 1.45
"""Where the bystander stands: to the right of what is ahead, [rad, m, m]."""
KEY = ("measured in the model [m]", "sizes that sources give")
SETTLED = 1.0
"""Time that the robot stands before it is looked at [s]."""


def picture(body: Body, renderer: RendererKind = RendererKind.FILAMENT) -> Figure:
    """Draw the robot ``body`` is the model of."""
    name = body.robot.name
    seen = _seen(name, renderer)
    with mpl.rc_context({"font.size": 9, "svg.fonttype": "none"}):
        figure = Figure(figsize=(14.0, 7.0), dpi=100, facecolor="white")
        draw_views(figure.add_axes((0.01, 0.02, 0.6, 0.94)), body)
        still = figure.add_axes((0.62, 0.2, 0.37, 0.555), xticks=[], yticks=[])
        still.imshow(seen, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
        still.set_title(name, fontsize=13)
        lines = [Line2D([], [], color=MEASURE, lw=1), Line2D([], [], color=SOURCE, lw=1.1, ls=(0, (4, 2)))]
        figure.legend(lines, KEY, loc="upper center", bbox_to_anchor=(0.805, 0.17), frameon=False, ncols=2)
    return figure


def _seen(name: str, renderer: RendererKind) -> NDArray[np.uint8]:
    """The robot on an empty floor."""
    world, settings = with_onlooker(empty_floor(LIGHT)), BenchSettings(renderer=renderer, cameras=())
    with Bench(world, robots.load(name), settings=settings) as bench:
        while bench.time < SETTLED:
            bench.wait()
        return Onlooker(bench, BEARING, DISTANCE, EYES).look()
