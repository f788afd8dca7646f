"""Channels through which a drive sees a map's features again, by extractor, and their capacity in bits (6.4.2)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE
from refseq.features import Extractor
from refseq.inference.matching.channel import FeatureCounts, capacity, feature_counts, z_channel
from refseq.inference.matching.information import Information, Noise, feature_information, view_information
from refseq.map.localiser import smoothed
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.drives.evaluate import places_as_views
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath
from refseq_bench.scenarios.tables import TextTable


@dataclass(frozen=True, slots=True)
class ChannelSummary:
    """The channel of an extractor's ``features``.

    ``capacity`` and ``z_capacity`` are what a feature tells at most, with its false alarms and without [bits];
    ``features_told`` what all tell as they are spread over the places, each by itself, added up; ``told`` what a view
    tells, which is never more than log2 K.
    """

    name: str
    features: int
    noise: Noise
    capacity: float
    z_capacity: float
    features_told: float
    told: Information


@dataclass(frozen=True)
class ViewAtPlace:
    """A view of a later drive, and the place where it was taken."""

    view: View
    place: int


def placed(map_: Map, views: Sequence[View]) -> Iterator[ViewAtPlace]:
    """The views that were taken at a place of the map, by true poses; where those lack, by the chain in hindsight."""
    path = ReferencePath(places_as_views(map_))
    if path.known and any(view.truth is not None for view in views):
        for view in views:
            if path.within(view.truth, WIDE).any() and (place := path.nearest(view.truth)) is not None:
                yield ViewAtPlace(view, place)
        return
    for view, belief in zip(views, smoothed(map_, views), strict=True):
        if belief.lost <= LOST_ABOVE:
            yield ViewAtPlace(view, belief.best)


def learnt_channels(map_: Map, views: Sequence[View]) -> Mapping[str, FeatureCounts]:
    """Channels of each extractor's features in a drive, of those whose sensor it has.

    Raises ``ScenarioError`` where no view is at a place, and where the drive has none of the map's sensors.
    """
    at = list(placed(map_, views))
    if not at:
        raise ScenarioError(f"none of {len(views)} views is at a place of the map; valid is a drive along its path")
    sequence, found = map_.sequence, {}
    for extractor in sequence.extractors:
        seen = [(one.place, _ids(extractor, one.view)) for one in at if extractor.sensor in one.view.sensors]
        if seen:
            found[extractor.key] = feature_counts(sequence.matrix, sequence.matrix.blocks[extractor.key], seen)
    if not found:
        raise ScenarioError(f"no view has a sensor of the map; valid are views of {', '.join(sorted(map_.sensors))}")
    return found


def _ids(extractor: Extractor, view: View) -> NDArray[np.intp]:
    return np.unique(extractor.recognise(extractor.describe(view)))


def channel_summaries(map_: Map, counts: Mapping[str, FeatureCounts], rng: np.random.Generator) -> list[ChannelSummary]:
    """Each extractor's channel, and what all tell together."""
    matrix, noise = map_.sequence.matrix, {key: one.noise for key, one in counts.items()}
    return [
        ChannelSummary(
            key,
            len(matrix.blocks[key]),
            one,
            capacity(one),
            capacity(z_channel(one)),
            float(feature_information(matrix, matrix.blocks[key], one).sum()),
            view_information(matrix, {key: one}, rng),
        )
        for key, one in noise.items()
    ]


def channel_table(title: str, found: Sequence[ChannelSummary]) -> TextTable:
    """A row an extractor, and a line for all of them."""
    headings = (">features", ">seen again", ">false alarms", ">capacity\n[bit]", ">as Z\n[bit]", ">all features\n[bit]")
    table = TextTable("features of", *headings, f">a view, of\n{found[0].told.limit:.2f} bit", title=title)
    for one in found:
        rates = f"{100 * one.noise.detection:.1f} %", f"{100 * one.noise.false_alarm:.2f} %"
        bits = f"{one.capacity:.3f}", f"{one.z_capacity:.3f}", f"{one.features_told:.1f}"
        table.add_row(one.name, str(one.features), *rates, *bits, f"{one.told.bits:.2f} ± {one.told.error:.2f}")
    return table
