"""A contact sheet: the same places in other light, side by side, for people to judge."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.world_survey.snapshots import Snapshot

CELL = (3.2, 2.4)
"""Size of a picture on the sheet [inch]."""
EDGE = 0.55
"""Room for the names of rows and columns [inch]."""


def contact_sheet(title: str, shots: Sequence[Snapshot]) -> Figure:
    """Draw a row for each place and camera, a column for each light."""
    lights = list(dict.fromkeys(shot.light for shot in shots))
    rows = [(shot.along, camera) for shot in shots if shot.light == lights[0] for camera in shot.images]
    images = {(shot.light, shot.along, camera): image for shot in shots for camera, image in shot.images.items()}
    width, height = CELL[0] * len(lights) + EDGE, CELL[1] * len(rows) + 1.5 * EDGE
    with mpl.rc_context({**AS_WRITTEN, "font.size": 10}):
        figure = Figure(figsize=(width, height), dpi=100, facecolor="white")
        figure.suptitle(title, y=1 - 0.2 / height, fontsize=12)
        box = (EDGE / width, 0.0, 1.0, 1.0 - 1.5 * EDGE / height)
        grid = figure.add_gridspec(len(rows), len(lights), wspace=0.02, hspace=0.02, left=box[0], bottom=0.005,
                                   right=0.998, top=box[3])  # fmt: skip
        for i, (along, camera) in enumerate(rows):
            for j, light in enumerate(lights):
                axes = figure.add_subplot(grid[i, j], xticks=[], yticks=[])
                _show(axes, images[light, along, camera])
                if i == 0:
                    axes.set_title(light)
                if j == 0:
                    axes.set_ylabel(f"{along:g} m, {camera}")
    return figure


def _show(axes: mpl.axes.Axes, image: NDArray[np.uint8]) -> None:
    axes.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
