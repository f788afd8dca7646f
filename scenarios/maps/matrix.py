"""The incidence matrix of a map: its figures, what its features tell about the place, and its picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from refseq.files import replacing_at
from refseq.inference.matching.incidence import IncidenceMatrix, Statistics, sensor_of
from refseq.inference.matching.information import (
    Information,
    Noise,
    column_information,
    feature_information,
    neighbour_noise,
    view_information,
)
from refseq.inference.matching.neighbours import Neighbours
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.plots.as_written import AS_WRITTEN
from refseq_bench.scenarios.tables import TextTable, plural

PICTURES = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Formats of pictures by the file's ending, and what keeps the hour out of them: the same map gives the same bytes."""

DPI, WIDTH, HEIGHT, LOWEST = 150, 1200, 1500, 45
"""Pixels an inch; pixels of a panel's width, of all panels' height together, and of the lowest panel."""

LEFT, RIGHT, TOP, BOTTOM, GAP = 130, 150, 100, 80, 50
"""Margins around the panels, and between one and the next [pixels]."""


@dataclass(frozen=True, slots=True)
class MatrixSummary:
    """Statistics and information of some rows of a matrix: an extractor's, a sensor's, or all.

    ``noise`` is how an extractor's features are seen again at the next place, ``None`` where there are several
    extractors; ``told`` is the information of views with that noise, ``distinct`` of the matrix taken at its word.
    """

    name: str
    statistics: Statistics
    noise: Noise | None
    told: Information
    distinct: Information


@dataclass(frozen=True, slots=True)
class FeatureSummary:
    """One feature: its extractor and number there, where it was seen, and its information with and without noise."""

    name: str
    sightings: int
    first: int
    last: int
    told: float
    distinct: float


def summaries(
    matrix: IncidenceMatrix,
    rng: np.random.Generator,
    neighbours: Neighbours | None = None,
    draws: int = 1000,
) -> list[MatrixSummary]:
    """Each extractor, each sensor that several extractors use, and all together.

    ``draws`` are the views by which ``told`` is estimated; fewer take less time and leave a larger error of it.
    """
    noise = _noise(matrix, neighbours)
    groups: dict[str, tuple[str, ...]] = {key: (key,) for key in matrix.blocks}
    for sensor in matrix.sensors:
        keys = tuple(key for key in matrix.blocks if sensor_of(key) == sensor)
        if 1 < len(keys) < len(matrix.blocks):
            groups[sensor] = keys
    if len(matrix.blocks) > 1:
        groups["all"] = tuple(matrix.blocks)
    return [_summary(name, keys, matrix, noise, rng, draws) for name, keys in groups.items()]


def _summary(
    name: str,
    keys: Sequence[str],
    matrix: IncidenceMatrix,
    noise: Mapping[str, Noise],
    rng: np.random.Generator,
    draws: int,
) -> MatrixSummary:
    return MatrixSummary(
        name,
        matrix.statistics(*(matrix.blocks[key] for key in keys)),
        noise[keys[0]] if len(keys) == 1 else None,
        view_information(matrix, {key: noise[key] for key in keys}, rng, draws),
        column_information(matrix, *(matrix.blocks[key] for key in keys)),
    )


def top_features(matrix: IncidenceMatrix, count: int, neighbours: Neighbours | None = None) -> list[FeatureSummary]:
    """The features that tell the most about the place, given the noise of their extractors."""
    noise = _noise(matrix, neighbours)
    told = np.concatenate([feature_information(matrix, block, noise[key]) for key, block in matrix.blocks.items()])
    names = [(key, number) for key, block in matrix.blocks.items() for number in range(len(block))]
    found = []
    for row in np.argsort(-told, kind="stable")[:count]:
        places = matrix.places[matrix.pointers[row] : matrix.pointers[row + 1]]
        if not len(places):
            break  # what was never seen tells nothing, and is nowhere
        key, number = names[row]
        distinct = feature_information(matrix, range(row, row + 1))[0]
        found.append(
            FeatureSummary(
                f"{key} {number}", len(places), int(places[0]), int(places[-1]), float(told[row]), float(distinct)
            )
        )
    return found


def _noise(matrix: IncidenceMatrix, neighbours: Neighbours | None) -> dict[str, Noise]:
    return {key: neighbour_noise(matrix, block, neighbours) for key, block in matrix.blocks.items()}


# --- tables ---


def statistics_table(title: str, found: Sequence[MatrixSummary]) -> TextTable:
    """The figures of the rows."""
    headings = (">rows", ">always", ">never", ">once", ">a view", ">zeros", ">B/place")
    table = TextTable("features of", *headings, title=title)
    for one in found:
        s = one.statistics
        a_view = f"{s.fewest}-{s.median:g}-{s.most}"
        counts = (str(count) for count in (s.features, s.everywhere, s.nowhere, s.once))
        table.add_row(one.name, *counts, a_view, f"{100 * s.sparsity:.1f} %", f"{s.bytes_a_place:.0f}")
    return table


def information_table(found: Sequence[MatrixSummary]) -> TextTable:
    """The information of the views, in bits, beside the noise that it was reckoned with."""
    limit = found[0].told.limit
    title = f"Information of a view about the place, of {limit:.2f} bits"
    table = TextTable("features of", ">seen again", ">false alarms", ">bits", ">without noise", title=title)
    for one in found:
        rates = (
            (f"{100 * one.noise.detection:.1f} %", f"{100 * one.noise.false_alarm:.2f} %") if one.noise else ("", "")
        )
        table.add_row(one.name, *rates, f"{one.told.bits:.2f} ± {one.told.error:.2f}", f"{one.distinct.bits:.2f}")
    return table


def features_table(found: Sequence[FeatureSummary]) -> TextTable:
    """The features that tell the most."""
    headings = (">seen at", ">from", ">to", ">bits", ">without noise")
    table = TextTable("feature", *headings, title=f"The {len(found)} features that tell the most")
    for one in found:
        seen = (str(number) for number in (one.sightings, one.first, one.last))
        table.add_row(one.name, *seen, f"{one.told:.3f}", f"{one.distinct:.3f}")
    return table


# --- picture ---


def check_picture(path: Path) -> None:
    """Raise ``ScenarioError`` for a file's ending that no picture has."""
    if path.suffix.lower() not in PICTURES:
        raise ScenarioError(f"{path}: is no picture's name; valid are names that end in {', '.join(PICTURES)}")


def draw(path: Path, matrix: IncidenceMatrix, title: str) -> None:
    """Draw the matrix as the thesis does, black where a feature was seen, a panel an extractor (Fig. 2.10).

    Columns are places; rows are features in the order of their first sighting, so that what is new at each place makes
    a diagonal. Where a pixel stands for many features or places it is as dark as their share of sightings.
    """
    metadata = PICTURES[path.suffix.lower()]
    with (
        mpl.rc_context({**AS_WRITTEN, "font.size": 8, "axes.titlesize": 8, "svg.hashsalt": "refseq"}),
        replacing_at(path) as drawn,
    ):
        _figure(matrix, title).savefig(drawn, dpi=DPI, facecolor="white", metadata=metadata)


def _figure(matrix: IncidenceMatrix, title: str) -> Figure:
    heights = _heights([len(block) for block in matrix.blocks.values()])
    width, height = LEFT + WIDTH + RIGHT, TOP + sum(heights) + GAP * (len(heights) - 1) + BOTTOM
    figure = Figure(figsize=(width / DPI, height / DPI))

    def axes_at(left: int, top: int, wide: int, high: int) -> Axes:
        return figure.add_axes((left / width, 1 - (top + high) / height, wide / width, high / height))

    top = TOP
    for key, high in zip(matrix.blocks, heights, strict=True):
        axes = axes_at(LEFT, top, WIDTH, high)
        image = _draw_block(axes, matrix, key, high)
        top += high + GAP
    axes.tick_params(labelbottom=True)
    axes.set_xlabel("place")
    figure.text(20 / width, 0.5, "feature, in the order of first sighting", rotation=90, va="center")
    figure.text(LEFT / width, 1 - 40 / height, title, weight="bold", va="center")
    figure.colorbar(image, cax=axes_at(LEFT + WIDTH + 40, TOP, 20, 400), label="share of the pixel's features seen")
    return figure


def _draw_block(axes: Axes, matrix: IncidenceMatrix, key: str, height: int) -> AxesImage:
    """An extractor's panel, ``height`` pixels high."""
    block = matrix.blocks[key]
    axes.set_title(f"{key}: {plural(len(block), 'feature')}", loc="left", pad=4)
    axes.tick_params(labelbottom=False)
    image = axes.imshow(
        _shares(matrix, block, height, WIDTH),
        extent=(-0.5, matrix.K - 0.5, max(1, len(block)) - 0.5, -0.5),
        cmap="gray_r",
        vmin=0,
        vmax=1,
        aspect="auto",
        interpolation="nearest",
    )
    axes.locator_params(axis="y", nbins=max(2, min(8, height // 45)), integer=True)
    return image


def _heights(sizes: Sequence[int]) -> list[int]:
    """Height of each extractor's panel [pixels]: in proportion to its features, but none too low to be read."""
    return [max(LOWEST, round(HEIGHT * size / max(1, sum(sizes)))) for size in sizes]


def _shares(matrix: IncidenceMatrix, block: range, height: int, width: int) -> NDArray[np.float64]:
    """Share of sightings in each pixel of at most ``height`` by ``width``, features in order of first sighting."""
    n, K = len(block), matrix.K
    h, w = min(height, n), min(width, K)
    first, last = matrix.pointers[block.start], matrix.pointers[block.stop]
    rank = np.empty(n, np.intp)
    rank[np.argsort(_first_sightings(matrix, block), kind="stable")] = np.arange(n)
    rows = np.repeat(rank, matrix.sightings(block)) * h // max(1, n)
    columns = matrix.places[first:last].astype(np.intp) * w // K
    sightings = np.bincount(rows * w + columns, minlength=h * w).reshape(h, w)
    features, places = (np.bincount(np.arange(of) * into // max(1, of)) for of, into in ((n, h), (K, w)))
    return sightings / np.outer(features, places)


def _first_sightings(matrix: IncidenceMatrix, block: range) -> NDArray[np.int64]:
    """The first place of each feature; K for one that was never seen."""
    starts = matrix.pointers[block.start : block.stop]
    return np.where(matrix.sightings(block) > 0, np.append(matrix.places, matrix.K)[starts], matrix.K)
