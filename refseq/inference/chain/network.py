"""Several paths as one chain: laid far behind each other, and linked where they run through the same places.

The thesis removes a common stretch from one of two sequences and keeps each as a chain of its own (4.4.2). Here every
path stays whole: a view of the removed stretch is a *link* to the place of the other sequence that it is the same as.
A robot on the stretch may come off it along any of the paths that use it, whichever it came on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Chain, ChainSettings, Transitions
from refseq.inference.chain.motion import MotionSettings

APART = 10_000.0
"""Distance between paths that are laid behind each other [m]: no window reaches so far, nor does a relocalisation,
whose range is a kilometre at most."""


@dataclass(frozen=True)
class Network:
    """The chain over the positions of all paths, path after path.

    ``paths`` are each path's distances [m] from its first position, rising; ``places`` (K,) says which place each
    position is. Positions at the same place are linked: of a belief in one of them the share ``crossing`` is, at every
    view, shared out evenly among them. ``loops`` (n, 2) are pairs of places that are one, though each has evidence of
    its own: positions at either are linked as well.
    """

    paths: tuple[NDArray[np.float64], ...]
    places: NDArray[np.intp]
    motion: MotionSettings
    settings: ChainSettings
    crossing: float = 0.5
    loops: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 2), np.intp))
    _latest: "dict[float, LinkedTransitions]" = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def K(self) -> int:
        """Number of positions; there are 2 K states."""
        return len(self.places)

    @cached_property
    def chain(self) -> Chain:
        """The chain without the links."""
        ends = np.cumsum([len(path) for path in self.paths]) - 1
        return Chain(laid_behind(self.paths), self.motion, self.settings, tuple(ends.tolist()))

    @cached_property
    def spots(self) -> NDArray[np.intp]:
        """Number of the spot that each position is at, (K,): its place, and all places that loops lead to from it."""
        if not len(self.loops):
            return self.places
        # A tenth of a second to import, which maps without loops do not wait for.
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count = int(max(self.places.max(), self.loops.max())) + 1
        graph = coo_array((np.ones(len(self.loops)), self.loops.T), shape=(count, count))
        return np.asarray(connected_components(graph, directed=False)[1], np.intp)[self.places]

    @cached_property
    def linked(self) -> NDArray[np.float64]:
        """Number of positions at the same spot as each, itself among them, (K,)."""
        return np.bincount(self.spots)[self.spots].astype(float)

    def start(self) -> NDArray[np.float64]:
        """Log-probability of each state at the first view, (2, K): as many paths as use a spot, it is but one."""
        start = self.chain.start()
        weights = 1 / self.linked
        with np.errstate(divide="ignore"):
            start[0] += np.log(weights * len(weights) / weights.sum())
        return start

    def transitions(self, distance: float) -> "LinkedTransitions":
        """The moves over a travelled distance [m]; the last ones made are kept."""
        if distance not in self._latest:
            self._latest.clear()
            self._latest[distance] = LinkedTransitions(self, self.chain.transitions(distance))
        return self._latest[distance]


class LinkedTransitions:
    """The moves of the chain, and after them those between linked positions."""

    def __init__(self, network: Network, moves: Transitions) -> None:
        self._network, self._moves = network, moves
        self.behind = moves.behind

    def predict(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_i p_i a_ij for every state j: probabilities after the move, with the same sum."""
        moved = self._moves.predict(states)
        moved[0] = self._crossed(moved[0])
        return moved

    def backward(self, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j a_ij q_j for every state i: the transpose of ``predict``."""
        return self._moves.backward(np.stack([self._crossed(states[0]), states[1]]))

    def _crossed(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Its own transpose: what two linked positions give each other is alike."""
        n = self._network
        mean = np.bincount(n.spots, positions)[n.spots] / n.linked
        crossed: NDArray[np.float64] = (1 - n.crossing) * positions + n.crossing * mean
        return crossed


def laid_behind(paths: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Distances of all paths' positions, each path ``APART`` [m] behind the last one."""
    laid, start = [], 0.0
    for path in paths:
        laid.append(start + path - path[0])
        start = laid[-1][-1] + APART
    return np.concatenate(laid)
