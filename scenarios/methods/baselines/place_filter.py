"""Bayes filters over the places of a map: predict from view to view, then weigh by the view's likelihood."""

import time
from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import Spent, answer

Seen = TypeVar("Seen", bound=Spent)


class PlaceFilter(ABC, Generic[Seen]):
    """The recursion that the filters share; ``Seen`` is what they make of a view."""

    def __init__(self) -> None:
        self._belief: NDArray[np.float64] | None = None

    def reset(self) -> None:
        """Forget all views seen."""
        self._belief = None

    def update(self, view: View) -> Belief:
        """Move the belief on, then weigh it by what the view shows."""
        seen = self._observe(view)
        start = time.perf_counter()
        belief = self._predict(self._belief, view) * self._likelihood(seen)
        self._belief = belief / belief.sum()
        places, lost = self._places_and_lost(self._belief)
        return answer(places, lost, seen, start)

    @abstractmethod
    def _observe(self, view: View) -> Seen:
        """Compare a view with the map."""

    @abstractmethod
    def _predict(self, belief: NDArray[np.float64] | None, view: View) -> NDArray[np.float64]:
        """Belief before the view is looked at; ``belief`` is None before the first."""

    @abstractmethod
    def _likelihood(self, seen: Seen) -> NDArray[np.float64]:
        """Likelihood of what was seen in each state."""

    def _places_and_lost(self, belief: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Weights of the places and P(lost): the last state is that of being off the map."""
        return belief[:-1], float(belief[-1])


def neighbours(count: int, least: int, most: int) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Places ``least`` to ``most`` ahead of each of ``count``, (K, W), and which of them there are.

    Those that there are not are the first or the last place.
    """
    places = np.arange(count)[:, None] + np.arange(least, most + 1)
    return np.clip(places, 0, count - 1), (places >= 0) & (places < count)
