"""The place whose column of the incidence matrix differs least from the view, each view for itself."""

import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Timings
from refseq.features import Observed
from refseq.map.sequence import ReferenceSequence
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import answer

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference


class NearestColumn:
    """The mixture's features without the mixture: fewest bits that differ, over all sensors.

    Bits are the rows of ``sequence``'s incidence matrix, whose places are ``views``. What the view shows and the place
    does not counts as much as the reverse. Sensors that the view lacks do not count; a place that lacked one is there
    as far from the view as places are on average. A place is as likely as the price of a bit that differs, the
    mixture's own (2.15), to the power of their number.

    It has no notion of being off the map. Its doubt, which never goes as far as to say lost, is half the share of the
    bits differing at the best place among those that it or the view shows, each counted once for each that shows it.
    """

    def __init__(self, sequence: ReferenceSequence, views: Sequence[View]) -> None:
        self._sequence = sequence
        self._sensor = {e.key: e.sensor for e in sequence.extractors}
        self._has = {sensor: np.array([sensor in view.sensors for view in views]) for sensor in sequence.sensors}
        self._shown = {
            key: self._sightings(key, np.arange(len(block))) for key, block in sequence.matrix.blocks.items()
        }

    def reset(self) -> None:
        """Nothing is kept from view to view."""

    def update(self, view: View) -> Belief:
        """Compare with all places."""
        observed = {e.key: e.observe(view) for e in self._sequence.extractors if e.sensor in view.sensors}
        start = time.perf_counter()
        differing, shown = self.differing(observed), self._all_shown(observed)
        spent = Timings(
            sum(seen.extraction for seen in observed.values()),
            sum(seen.matching for seen in observed.values()) + time.perf_counter() - start,
        )
        best = int(np.argmin(differing))
        doubt = differing[best] / shown[best] / 2 if shown[best] else 0.5
        return answer(self._sequence.profile.mixture.cost ** (differing - differing[best]), float(doubt), spent)

    def differing(self, observed: Mapping[str, Observed]) -> NDArray[np.float64]:
        """Count the bits of each place (K,) that differ from what a view's extractors observed."""
        total = np.zeros(len(self._sequence))
        for key, seen in observed.items():
            bits = len(seen.ids) + self._shown[key] - 2 * self._sightings(key, seen.ids)
            there = self._has[self._sensor[key]]
            total += np.where(there, bits, bits[there].mean())
        return total

    def _all_shown(self, observed: Mapping[str, Observed]) -> NDArray[np.float64]:
        """Bits that the view shows and those that each place does, by the same extractors, together, (K,)."""
        total = np.zeros(len(self._sequence))
        for key, seen in observed.items():
            total += len(seen.ids) + self._shown[key]
        return total

    def _sightings(self, key: str, ids: NDArray[np.intp]) -> NDArray[np.intp]:
        """Count an extractor's features that each place showed, (K,)."""
        rows = self._sequence.matrix.block(key).select(ids)
        return np.bincount(rows.places, minlength=len(self._sequence))


def learnt(reference: "Reference") -> NearestColumn:
    """The method, once it has learnt a reference drive."""
    return NearestColumn(reference.map("thesis").sequence, reference.views)
