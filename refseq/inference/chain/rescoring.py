"""The N best paths in the light of what a first-order chain cannot say (6.4.5): durations, and moves over two steps.

A post-processor adds terms to the paths' scores and sorts them anew, log P̂ = log P(path, views) + Σ terms, as Juang
et al. (1985) do for durations. The answer is exact where the best path is among the N that are looked at.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, xlogy

from refseq.inference.chain.chain import Chain, Observation
from refseq.inference.chain.motion import motion_model
from refseq.inference.chain.n_best import RankedPath

Term = Callable[[RankedPath], float]
"""Addition to a path's score [nats]."""
SHORTEST = 0.05
"""A stay counts as at least this share of the usual one: a robot that stands has not left in no time."""


def rescored(paths: Iterable[RankedPath], *terms: Term) -> list[RankedPath]:
    """The paths with all ``terms`` in their scores, the best first; of equal ones the order stays."""
    scored = [replace(path, log_score=path.log_score + math.fsum(term(path) for term in terms)) for path in paths]
    return sorted(scored, key=lambda path: -path.log_score)


@dataclass(frozen=True)
class DurationModel:
    """Distance gone while at a place over the one expected: a gamma distribution of their ratio.

    ``usual`` (K,) [m] is half the way to the place before and half that to the one behind, ``spread`` the ratio's
    standard deviation; its mean is 1. A compact sequence has places of all lengths, whose stays a chain of one state a
    place takes for ever less probable the longer they are.
    """

    usual: NDArray[np.float64]
    spread: float = 0.5

    @classmethod
    def of(cls, chain: Chain, spread: float = 0.5) -> Self:
        """The model of a chain's places."""
        gaps = np.diff(chain.along)
        gaps[[end % chain.K for end in chain.ends if end % chain.K < chain.K - 1]] = 0.0  # from path to path
        usual = (np.append(gaps, 0.0) + np.append(0.0, gaps)) / 2
        usual[usual == 0] = np.median(usual[usual > 0]) if usual.any() else 1.0
        return cls(usual, spread)

    def learnt(self, path: RankedPath, observations: Sequence[Observation]) -> Self:
        """The same with the spread of a drive whose path is known; as it was, where that tells fewer than two stays."""
        ratios = self.ratios(path, observations)
        return replace(self, spread=float(np.std(ratios))) if len(ratios) > 1 and np.std(ratios) > 0 else self

    def ratios(self, path: RankedPath, observations: Sequence[Observation]) -> NDArray[np.float64]:
        """Ratio of each stay at a place to the usual one; a drive's first and last are not whole and left out."""
        steps = [0.0 if math.isnan(o.distance) else abs(o.distance) for o in observations]
        stays, t = [], 0
        for state, views in groupby(path.states):
            count = len(list(views))
            stays.append((state, math.fsum(steps[t : t + count])))
            t += count
        K = len(self.usual)
        return np.array([way / self.usual[state] for state, way in stays[1:-1] if state < K])

    def term(self, observations: Sequence[Observation], weight: float = 1.0) -> Term:
        """α Σ_j log p(d_j), α being the ``weight``."""
        shape = self.spread**-2
        constant = math.log(shape) - float(gammaln(shape))  # of the density of a gamma distribution of mean 1

        def score(path: RankedPath) -> float:
            ratios = np.maximum(self.ratios(path, observations), SHORTEST)
            return weight * float((xlogy(shape - 1, shape * ratios) - shape * ratios + constant).sum())

        return score


def second_order_term(observations: Sequence[Observation], chain: Chain, weight: float = 1.0) -> Term:
    """Moves that depend on the place before the last one: P(k | i, j) ∝ P(k | j, d) P(k | i, d + d')^weight.

    Over two steps the robot has gone the sum of both distances, give or take the slack of the motion window once: two
    errors of a step that add up are less probable than two that cancel out, as where a place is told a little too far
    on. The term is log P(k | i, j) − log P(k | j, d) over all places k that follow two others. Steps that nobody
    measured have none.
    """
    distances = [observation.distance for observation in observations]

    @cache
    def row(first: int, last: int, place: int) -> NDArray[np.float64]:
        way = math.fsum(distances[first : last + 1])
        moves = motion_model(chain.along, way, chain.motion, chain.ends)
        return moves.predict(np.eye(1, chain.K, place)[0])

    @cache
    def of_three(t: int, i: int, j: int, k: int) -> float:
        once, twice = row(t, t, j), row(t - 1, t, i) ** weight
        total = float(once @ twice)
        return math.log(twice[k] / total) if total > 0 and twice[k] > 0 else -math.inf

    def score(path: RankedPath) -> float:
        triples = zip(path.states, path.states[1:], path.states[2:], strict=False)
        return math.fsum(
            of_three(t, *triple)
            for t, triple in enumerate(triples, start=2)
            if max(triple) < chain.K and not math.isnan(distances[t] + distances[t - 1])
        )

    return score
