"""The Bayes filter over places that knows no odometry: from view to view the robot goes on by a few places."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from refseq.view import View
from refseq_bench.scenarios.methods.baselines.likelihood import SimilarityLikelihood
from refseq_bench.scenarios.methods.baselines.place_filter import PlaceFilter, neighbours
from refseq_bench.scenarios.methods.baselines.vlad import Likeness, VladMap, as_vlad

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference


@dataclass(frozen=True, slots=True)
class TopologicalSettings:
    """The robot goes on by ``least`` to ``most`` places a view, all alike; ``contrast`` as in ``SimilarityLikelihood``.

    ``least`` is not above 0, for from the last place there is no way on. The published window, −2 to +9, is for a map
    several times denser than the query; this one is for views of both drives taken equally far apart. ``around`` is
    how many places to both sides count as one answer where its probability is told.
    """

    least: int = 0
    most: int = 2
    contrast: float = 7.0
    around: int = 6


class TopologicalFilter(PlaceFilter[Likeness]):
    """Where the robot is, from how its views look and from their order.

    M. Xu, N. Sünderhauf, M. Milford, "Probabilistic visual place recognition for hierarchical localization", RA-L 6(2),
    2021.

    It has no notion of being off the map. Its doubt, which never goes as far as to say lost, is half the belief that
    lies farther than ``around`` places from the best.
    """

    def __init__(self, places: VladMap, settings: TopologicalSettings | None = None) -> None:
        super().__init__()
        self._places = places
        self._settings = settings or TopologicalSettings()
        self._similarity = SimilarityLikelihood(self._settings.contrast)

    def reset(self) -> None:
        """Forget all views seen."""
        super().reset()
        self._similarity.reset()

    def _observe(self, view: View) -> Likeness:
        return self._places.compare(view)

    def _predict(self, belief: NDArray[np.float64] | None, view: View) -> NDArray[np.float64]:
        K, settings = len(self._places), self._settings
        if belief is None:
            return np.full(K, 1 / K)
        targets, there = neighbours(K, settings.least, settings.most)
        # From the ends of the path fewer places can be reached, each of them the more often.
        shares = there / np.maximum(there.sum(axis=1, keepdims=True), 1)
        moved = np.bincount(targets[there], weights=(belief[:, None] * shares)[there], minlength=K)
        return np.asarray(moved, np.float64)

    def _likelihood(self, seen: Likeness) -> NDArray[np.float64]:
        return np.ones(len(self._places)) if seen.values is None else self._similarity(seen.values)

    def _places_and_lost(self, belief: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        best, around = int(np.argmax(belief)), self._settings.around
        return belief, (1 - float(belief[max(0, best - around) : best + around + 1].sum())) / 2


def learnt(reference: "Reference") -> TopologicalFilter:
    """The method, once it has learnt a reference drive."""
    return TopologicalFilter(reference.once(as_vlad))
