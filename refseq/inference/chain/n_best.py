"""The N best paths of a drive (list Viterbi; Seshadri and Sundberg 1994), by a search along the trellis.

Viterbi's forward pass scores the best way to every state of every view. From the last view back, a path's end can then
be scored exactly together with the best way to where it begins, so that a best-first search over ends comes upon whole
paths in the order of their scores (the tree-trellis search of Soong and Huang 1991). It looks at N · T states for T
views, O(K) each, where the parallel algorithm keeps N scores for every state of every view.
"""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, islice

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.chain import Chain, Observation
from refseq.inference.chain.forward import expected, weighed
from refseq.inference.chain.viterbi import forward_scores


@dataclass(frozen=True, slots=True)
class RankedPath:
    """A path, oldest view first, and log P(path, views), on the scale of the views' log-likelihoods.

    Its states are places 0 to K − 1 and Lost_Places K to 2 K − 1.
    """

    states: tuple[int, ...]
    log_score: float


_End = tuple[float, int, int, tuple[int, ...], float]
"""Minus the best score of a path that ends so; number; view; states from it on; score of what comes after that view."""


def n_best_paths(observations: Sequence[Observation], chain: Chain, most: int) -> list[RankedPath]:
    """The ``most`` best paths from Lost_0 (3.9), the best one first; fewer where there are no more.

    Paths of the same score come in any order. It holds all views' scores at once, 16 K bytes a view.
    """
    return list(islice(_paths(observations, chain, most), most))


def log_evidence(observations: Sequence[Observation], chain: Chain) -> float:
    """Log P(views), of all paths together: a path's share of the belief is exp(``log_score`` − this).

    Paths are those of a robot that nobody carries, as all that are listed are.
    """
    states, total = None, 0.0
    for observation in observations:
        states, now = weighed(expected(states, replace(observation, carried=0.0), chain), observation)
        total += now
    return total


def _paths(observations: Sequence[Observation], chain: Chain, most: int) -> Iterator[RankedPath]:
    moves = [chain.transitions(observation.distance) for observation in observations]
    scored = forward_scores(observations, moves.__getitem__, chain)
    number = count()  # of two ends with the same score the one found first goes on, and no paths are compared
    last = _best(scored[-1].ravel(), most)
    ends: list[_End] = [(-score, next(number), len(scored) - 1, (state,), 0.0) for state, score in last]
    heapq.heapify(ends)
    while ends:
        score, _, t, states, later = heapq.heappop(ends)
        if not t:
            yield RankedPath(states, -score)
            continue
        # What comes after the view before: this state's view, the way into it, and all later ones.
        now = (observations[t].places[states[0]] if states[0] < chain.K else observations[t].lost) + later
        ways = moves[t].predecessors(states[0]).ravel() + now
        for state, score in _best(scored[t - 1].ravel() + ways, most):
            heapq.heappush(ends, (-score, next(number), t - 1, (state, *states), float(ways[state])))


def _best(scores: NDArray[np.float64], most: int) -> list[tuple[int, float]]:
    """The best states and their scores, those that are possible; no path of the ``most`` best needs another."""
    kept = np.argpartition(-scores, most - 1)[:most] if most < len(scores) else np.arange(len(scores))
    return [(int(state), float(scores[state])) for state in kept if scores[state] > -np.inf]
