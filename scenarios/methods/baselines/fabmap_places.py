"""FAB-MAP's generative model of one camera: how places show words.

M. Cummins, P. Newman, "FAB-MAP: probabilistic localization and mapping in the space of appearance", International
Journal of Robotics Research 27(6), 2008. Letters as there: z_q says whether a view shows word q, e_q whether the thing
that looks like it exists at place L.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq_bench.scenarios.methods.baselines.chow_liu import ChowLiuTree
from refseq_bench.scenarios.methods.baselines.fabmap_words import Bags

CERTAIN = 1e-3
"""Least distance from 0 and 1 of the probability that a thing exists, before any view of it."""


@dataclass(frozen=True, slots=True)
class Detector:
    """P(z_q = 1 | e_q = 1), a ``detection``, and P(z_q = 1 | e_q = 0), a ``false_alarm``."""

    detection: float = 0.25
    false_alarm: float = 0.02

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for rates with which showing a word tells nothing, or all."""
        if not 0 <= self.false_alarm < self.detection < 1:
            raise ValueError(
                f"detection {self.detection}, false_alarm {self.false_alarm}; valid is 0 <= false_alarm < detection < 1"
            )

    def shows(self, shown: int, exists: int) -> float:
        """P(z = ``shown`` | e = ``exists``)."""
        rate = self.detection if exists else self.false_alarm
        return rate if shown else 1 - rate


class PlaceModel:
    """The likelihood of a view at each place, and at one that was never seen.

    P(Z | L) = Π_q Σ_e P(z_q | e_q, z_p) P(e_q | L), where p is q's parent in the tree, and

    P(z_q | e_q, z_p) ∝ P(z_q | e_q) P(z_q | z_p) / P(z_q),

    normalised over z_q. A tree without edges gives the naive Bayes form, Σ_e P(z_q | e_q) P(e_q | L). A place was seen
    once: P(e_q | L) is Bayes' rule on whether that view showed the word; where it had no such camera, and at a new
    place (the mean-field approximation), P(e_q) is left as it was. The words that are *not* seen count as well: a view
    without any is likely at places that showed few.

    P(e_q) follows from how often the word was seen, P(z_q) = Σ_e P(z_q | e_q) P(e_q).
    """

    def __init__(self, bags: Bags, tree: ChowLiuTree, detector: Detector) -> None:
        self._bags, self._tree = bags, tree
        span = detector.detection - detector.false_alarm
        prior = np.clip((tree.marginal - detector.false_alarm) / span, CERTAIN, 1 - CERTAIN)
        exists = [_after(prior, shown, detector) for shown in (0, 1)]
        self._missed, self._seen, self._new = (_log_table(tree, e, detector) for e in (*exists, prior))

    def log_likelihood(self, shown: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Log P(Z | L) of a view that shows some words (N,), (K + 1,): at each place, then at a new one."""
        cell = shown.astype(np.intp), self._tree.states(shown), np.arange(len(shown))
        missed, new = self._missed[cell], float(self._new[cell].sum())
        at_places = missed.sum() + self._bags.seen @ (self._seen[cell] - missed)
        return np.append(np.where(self._bags.has, at_places, new), new)


def _after(prior: NDArray[np.float64], shown: int, detector: Detector) -> NDArray[np.float64]:
    """P(e_q = 1 | z_q) by Bayes' rule, (N,)."""
    exists, not_there = prior * detector.shows(shown, 1), (1 - prior) * detector.shows(shown, 0)
    after: NDArray[np.float64] = exists / (exists + not_there)
    return after


def _log_table(tree: ChowLiuTree, exists: NDArray[np.float64], detector: Detector) -> NDArray[np.float64]:
    """Log Σ_e P(z_q | e_q, z_p) P(e_q) for z_q and z_p of 0 and 1, (2, 2, N)."""
    total = np.zeros((2, 2, len(exists)))
    for e, share in ((0, 1 - exists), (1, exists)):
        dependent = np.stack(
            [
                detector.shows(0, e) * (1 - tree.given) / (1 - tree.marginal),
                detector.shows(1, e) * tree.given / tree.marginal,
            ]
        )
        total += share * dependent / dependent.sum(axis=0)
    return np.log(total)
