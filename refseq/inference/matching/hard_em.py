"""Hard-assignment EM, the thesis' degenerate mixture: components of zeros and ones, each view in one (2.14, 2.15).

Both price a feature that differs: log P(v | Θ_c) = −Σ_j w_j |v_j − Θ_cj| up to a constant, with weights
w_j ≥ 0. Z is rounded to zeros and ones like Θ, because soft shares wear sparse components down to nothing
(docs/decisions/0002 has the figures). Two misprints of Algorithm 1 are mended: it loops while the residual still
changes, and its Θ update averages the reference views.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from refseq.inference.matching.columns import Columns

DISTANCES = 1 << 18
"""Most distances of views to components that are held at a time; by measurement."""
EXACT = 1 << 22
"""Up to this, sums and differences of whole numbers are exact in single precision."""


class Seeding(StrEnum):
    """Choice of the views that components start from.

    ``likeness`` takes those that share the most with the observed one: a view that shares little needs no component of
    its own, for it differs little from an empty one. ``variety`` does not look at the observed one: after the richest
    view each next one differs the most from those taken (the farthest-first traversal of Gonzalez, 1985).
    """

    LIKENESS = "likeness"
    VARIETY = "variety"


@dataclass(frozen=True, slots=True)
class HardMixture:
    """The end of EM: components ``theta`` (C, n) of zeros and ones, and the ``owner`` of each distinct view (D,)."""

    theta: NDArray[np.float64]
    owner: NDArray[np.intp]
    iterations: int

    def differences(self, v: NDArray[np.bool_], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted number of features in which ``v`` (n,) differs from each distinct view's component, (D,)."""
        differing = weights @ v + self.theta @ (weights * (1.0 - 2.0 * v))
        return np.asarray(differing[self.owner])

    def sizes(self, columns: Columns) -> NDArray[np.float64]:
        """Number of places in the component of each distinct view, K α_c, (D,)."""
        sizes: NDArray[np.float64] = np.bincount(self.owner, columns.multiplicity)[self.owner].astype(float)
        return sizes


def fit(
    columns: Columns, theta: NDArray[np.float64], weights: NDArray[np.float64], tolerance: float, iterations: int
) -> HardMixture | None:
    """Algorithm 1's loop from components ``theta`` (C, n); ``weights`` (n,) are the features', and not all zero.

    It ends when the mean residual, the share of features in which views differ from their components, changes by less
    than ``tolerance``; None when it has not after ``iterations``.
    """
    views = columns.factor(len(theta)).astype(_sufficient(weights))
    residual = np.inf
    for iteration in range(1, iterations + 1):
        # E step: each view belongs to the component that it differs from the least.
        owner, least = _nearest(views, theta, weights)
        previous, residual = residual, float(columns.multiplicity @ least) / (columns.K * weights.sum())
        if abs(previous - residual) < tolerance:
            return HardMixture(theta, owner, iteration)
        theta = _majority(columns, owner, theta)
    return None


def _sufficient(weights: NDArray[np.float64]) -> type[np.floating[Any]]:
    """Single precision where it is exact, for whole numbers that add up to few: half the work."""
    whole = bool((weights == np.round(weights)).all()) and weights.sum() < EXACT
    return np.float32 if whole else np.float64


def _nearest(
    views: NDArray[np.floating[Any]] | csr_matrix, theta: NDArray[np.float64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """The component from which each view differs the least, the first of equals, and by how much; both (D,)."""
    # |v − Θ| = v + Θ − 2 v Θ for zeros and ones; the view's own term is the same for all components.
    weighted = theta * weights
    turned, own = (-2 * weighted.T).astype(views.dtype), weighted.sum(axis=1).astype(views.dtype)
    D = views.shape[0]
    owner, least = np.empty(D, np.intp), np.empty(D)
    # A few views at a time: their distances to all components stay in the processor's cache.
    step = max(1, DISTANCES // len(theta))
    for start in range(0, D, step):
        some = slice(start, start + step)
        distance = views[some] @ turned
        distance += own
        owner[some] = nearest = np.argmin(distance, axis=1)
        least[some] = distance[np.arange(len(nearest)), nearest]
    return owner, views @ weights + least


def _majority(columns: Columns, owner: NDArray[np.intp], theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """M step: the mean of a component's views, rounded to zeros and ones; one without views stays as it is."""
    order = np.argsort(owner, kind="stable")
    owners, first = np.unique(owner[order], return_index=True)
    multiplicity = columns.multiplicity[order]
    belonging = csr_matrix((multiplicity, order, np.append(first, len(order))), shape=(len(owners), len(order)))
    theta = theta.copy()
    theta[owners] = np.round(belonging @ columns.views / np.add.reduceat(multiplicity, first)[:, None])
    return theta


def initial_components(
    columns: Columns, v: NDArray[np.bool_], C: int, from_views: float, seeds: Seeding, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Components to start from (C, n): the share ``from_views`` copies of views, the rest drawn."""
    copies = min(round(from_views * C), columns.K)
    drawn = rng.integers(0, 2, size=(C - copies, len(v))).astype(float)
    return np.concatenate([columns.views[seed_views(columns, v, copies, seeds)], drawn])


def seed_views(columns: Columns, v: NDArray[np.bool_], count: int, seeds: Seeding) -> NDArray[np.intp]:
    """``count`` distinct views to start components from, one that several places have as often, at most K."""
    order = _most_shared(columns, v) if seeds is Seeding.LIKENESS else _most_varied(columns, count)
    return np.repeat(order, columns.multiplicity[order].astype(int))[:count]


def _most_shared(columns: Columns, v: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Distinct views, those that share the most with ``v`` first, (D,)."""
    return np.argsort(-(columns.views @ v), kind="stable")


def _most_varied(columns: Columns, count: int) -> NDArray[np.intp]:
    """Distinct views, each as different as can be from those before it, ``count`` of them at most."""
    views, sizes = columns.views, columns.views.sum(axis=1)
    order = [int(np.argmax(sizes))]
    away = np.full(len(views), np.inf)
    while len(order) < min(count, len(views)):
        last = order[-1]
        np.minimum(away, sizes + sizes[last] - 2 * views @ views[last], out=away)
        order.append(int(np.argmax(away)))
    return np.array(order)
