"""Curves of a day: keys that are found again, and the light, over the hours."""

from collections.abc import Sequence
from itertools import cycle

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from refseq_bench.scenarios.world_survey.day import Recall

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Colours that colour-blind people can tell apart (Okabe and Ito); further lines begin with the first again."""


def day_curve(title: str, found: Sequence[Recall]) -> Figure:
    """Draw the shares over the hours, a panel for each camera, and the light at each place below them."""
    cameras = list(dict.fromkeys(r.camera for r in found))
    with mpl.rc_context({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(9, 2.4 * len(cameras) + 2.2), layout="constrained", facecolor="white")
        figure.suptitle(title, parse_math=False)
        *panels, light = figure.subplots(len(cameras) + 1, 1, sharex=True)
        for axes, camera in zip(panels, cameras, strict=True):
            _lines(axes, [r for r in found if r.camera == camera], "share", 100)
            axes.set_title(camera, loc="left", fontsize=10, parse_math=False)
            axes.set(ylim=(0, 100), ylabel="found again [%]")
        _lines(light, [r for r in found if r.camera == cameras[0]], "lux", 1)
        light.set(yscale="log", ylabel="light [lx]", xlabel="hour of the day [h]")
        light.xaxis.set_major_locator(MaxNLocator(12, steps=[1, 2, 3, 6, 10], integer=True))
        panels[0].legend(title="along the route", ncols=3, loc="upper right")
    return figure


def _lines(axes: Axes, found: Sequence[Recall], value: str, scale: float) -> None:
    for place, colour in zip(dict.fromkeys(r.along for r in found), cycle(COLOURS), strict=False):
        here = [r for r in found if r.along == place]
        values = [scale * getattr(r, value) for r in here]
        axes.plot([r.hour for r in here], values, color=colour, marker=".", label=f"{place:g} m")
    axes.grid(alpha=0.3)
