"""The Bayes filter over places that knows no odometry: from view to view the robot goes on by a few places."""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.view import View
from scenarios.methods.baselines.answer import answer
from scenarios.methods.baselines.likelihood import Calibration
from scenarios.methods.baselines.vlad import VladMap


@dataclass(frozen=True, slots=True)
class TopologicalSettings:
    """The robot goes on by ``least`` to ``most`` places a view, all alike; ``contrast`` as in ``Calibration``.

    ``least`` is not above 0, for from the last place there is no way on. The published window, −2 to +9, is for a map
    several times denser than the query; this one is for views of both drives taken equally far apart. ``around`` is
    how many places to both sides count as one answer where its probability is told.
    """

    least: int = 0
    most: int = 2
    contrast: float = 7.0
    around: int = 6


class TopologicalFilter:
    """Where the robot is, from how its views look and from their order.

    M. Xu, N. Sünderhauf, M. Milford, "Probabilistic visual place recognition for hierarchical localization", RA-L 6(2),
    2021.

    It has no notion of being off the map. Its doubt, which never goes as far as to say lost, is half the belief that
    lies farther than ``around`` places from the best.
    """

    def __init__(self, places: VladMap, settings: TopologicalSettings | None = None) -> None:
        self._places = places
        self._settings = settings or TopologicalSettings()
        self._calibration = Calibration(self._settings.contrast)
        self._belief: NDArray[np.float64] | None = None

    def reset(self) -> None:
        """Forget all views seen."""
        self._belief = None
        self._calibration.reset()

    def update(self, view: View) -> Belief:
        """Move on by the window, then weigh by what the view looks like."""
        likeness = self._places.compare(view)
        start = time.perf_counter()
        belief = self._predicted()
        if likeness.values is not None:
            belief = belief * self._calibration.likelihood(likeness.values)
        self._belief = belief / belief.sum()
        return answer(self._belief, self._doubt(self._belief), likeness, start)

    def _predicted(self) -> NDArray[np.float64]:
        K, settings = len(self._places), self._settings
        if self._belief is None:
            return np.full(K, 1 / K)
        offsets = np.arange(settings.least, settings.most + 1)
        targets = np.arange(K)[:, None] + offsets
        # From the ends of the path fewer places can be reached, each of them the more often.
        there = (targets >= 0) & (targets < K)
        shares = there / np.maximum(there.sum(axis=1, keepdims=True), 1)
        moved = np.bincount(targets[there], weights=(self._belief[:, None] * shares)[there], minlength=K)
        return np.asarray(moved, np.float64)

    def _doubt(self, belief: NDArray[np.float64]) -> float:
        best, around = int(np.argmax(belief)), self._settings.around
        return (1 - float(belief[max(0, best - around) : best + around + 1].sum())) / 2
