"""Contact sheets: images in rows, each with its caption."""

from collections.abc import Sequence
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN

COLUMNS = 4
CELL = 3.2
"""Width of an image on the sheet [inch]."""
FOOT = 0.5
"""Height left under it for its caption [inch]."""


class CaptionedImage(NamedTuple):
    """An image (height, width) uint8 and its caption; all of a sheet have one size."""

    image: NDArray[np.uint8]
    text: str


def contact_sheet(title: str, frames: Sequence[CaptionedImage]) -> Figure:
    """Draw images in rows of ``COLUMNS``."""
    high, wide = frames[0].image.shape
    rows, height = -(-len(frames) // COLUMNS), CELL * high / wide
    width, tall = COLUMNS * CELL, rows * (height + FOOT) + FOOT
    with mpl.rc_context({**AS_WRITTEN, "font.size": 10}):
        figure = Figure(figsize=(width, tall), dpi=100, facecolor="white")
        figure.suptitle(title, y=1 - 0.15 / tall)
        for number, frame in enumerate(frames):
            row, column = divmod(number, COLUMNS)
            bottom = tall - FOOT - (row + 1) * (height + FOOT) + FOOT
            box = ((column * CELL + 0.03) / width, bottom / tall, (CELL - 0.06) / width, (height - 0.04) / tall)
            axes = figure.add_axes(box, xticks=[], yticks=[])
            axes.imshow(frame.image, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
            axes.set_xlabel(frame.text, labelpad=3)
    return figure
