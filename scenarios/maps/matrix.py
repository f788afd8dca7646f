"""The incidence matrix of a map: its figures, and what its features tell about the place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

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
from refseq_bench.scenarios.tables import TextTable


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
