"""Two maps beside each other as pictures: the view similarity matrices, and what they share (Fig. 4.6)."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.files import replacing_at
from refseq_bench.scenarios.maps.drawings.matrix import DPI, PICTURES
from refseq_bench.scenarios.maps.similarity import Similarity
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN

WIDE = 11.0
"""Width of the picture [inches]."""
JOINED, REFUSED = "#3fb5e8", "#f08a24"


def draw(path: Path, found: Similarity, decisions: Sequence[Decision]) -> None:
    """Both matrices with the other sequence upwards, brighter where views are more alike, and the stretches on them."""
    metadata = PICTURES[path.suffix.lower()]
    with (
        mpl.rc_context({**AS_WRITTEN, "font.size": 9, "axes.titlesize": 9, "svg.hashsalt": "refseq"}),
        replacing_at(path) as drawn,
    ):
        _figure(found, decisions).savefig(drawn, dpi=DPI, facecolor="white", metadata=metadata)


def _figure(found: Similarity, decisions: Sequence[Decision]) -> Figure:
    K, L = found.there.shape
    figure = Figure(figsize=(WIDE, np.clip(2.0 + 4.4 * L / K, 3.2, 8.5)), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    _panel(left, found.there.T, f"views of {found.one}, looked for in {found.other}", decisions)
    image = _panel(right, found.back, f"views of {found.other}, looked for in {found.one}", decisions)
    left.set_ylabel(f"place of {found.other}")
    for axes in (left, right):
        axes.set_xlabel(f"place of {found.one}")
    figure.colorbar(image, ax=[left, right], label="P(place | view), uniform prior", shrink=0.9)
    if decisions:
        by_label = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
        figure.legend(list(by_label.values()), list(by_label), loc="outside upper center", ncols=2)
    return figure


def _panel(axes: Axes, alike: NDArray[np.float64], title: str, decisions: Sequence[Decision]) -> AxesImage:
    """``alike`` is drawn as it is: rows upwards, columns to the right."""
    image = axes.imshow(
        alike, origin="lower", cmap="magma", norm=PowerNorm(0.5, 0, 1), aspect="auto", interpolation="nearest"
    )
    axes.set_title(title, loc="left")
    for decision in decisions:
        colour, label = (JOINED, "joined") if decision.joined else (REFUSED, "refused")
        axes.plot(decision.first, decision.second, color=colour, linewidth=0.8, marker="o", markersize=4, label=label)
    return image
