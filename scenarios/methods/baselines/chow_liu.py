"""The best tree of dependences between words: who tells most about whom.

C. K. Chow, C. N. Liu, "Approximating discrete probability distributions with dependence trees", IEEE Transactions on
Information Theory 14(3), 1968.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.special import xlogy

ROOT = -1
"""Stands for the parent of a word that has none."""

PSEUDO = 1.0
"""Views with and as many without each word that are counted besides the real ones; chosen in the annex."""


@dataclass(frozen=True, slots=True)
class ChowLiuTree:
    """P(z) = Π_q P(z_q | z_parent(q)) over N words, z_q saying whether a view shows word q.

    ``parents`` (N,) holds each word's parent, ``ROOT`` for a word that depends on none. ``marginal`` (N,) is
    P(z_q = 1); ``given`` (2, N) is P(z_q = 1 | z_parent = 0) and P(z_q = 1 | z_parent = 1), both the marginal where
    there is no parent.
    """

    parents: NDArray[np.intp]
    marginal: NDArray[np.float64]
    given: NDArray[np.float64]

    @classmethod
    def independent(cls, views: csr_array) -> Self:
        """No edges at all: every word by itself, from views (K, N) of zeros and ones."""
        return cls._with(views, np.full(views.shape[1], ROOT, np.intp))

    @classmethod
    def learn(cls, views: csr_array) -> Self:
        """The tree that makes views (K, N) of zeros and ones most likely, K ≥ 1."""
        return cls._with(views, best_parents(views))

    @classmethod
    def _with(cls, views: csr_array, parents: NDArray[np.intp]) -> Self:
        """A tree of given shape, its probabilities counted in the views.

        Counts of a drive are small: a word seen once would follow its parent without fail. So 2 ``PSEUDO`` views are
        counted besides, half of which show the word, and covariances shrink as if words were independent in those:
        joint probabilities are then positive and have exactly the marginals.
        """
        K = views.shape[0]
        counts = np.asarray(views.sum(axis=0), np.float64)
        marginal = (counts + PSEUDO) / (K + 2 * PSEUDO)
        child = np.flatnonzero(parents != ROOT)
        parent = parents[child]
        columns = views.tocsc()
        together = np.asarray(columns[:, child].multiply(columns[:, parent]).sum(axis=0), np.float64)
        covariance = (together / K - counts[child] * counts[parent] / K**2) * K / (K + 2 * PSEUDO)
        given = np.tile(marginal, (2, 1))
        given[0, child] -= covariance / (1 - marginal[parent])
        given[1, child] += covariance / marginal[parent]
        return cls(parents, marginal, given)

    def states(self, shown: NDArray[np.bool_]) -> NDArray[np.intp]:
        """State of each word's parent, shown or not, (N,) of 0 and 1, by a view (N,); 0 for a word without parent."""
        return np.where(self.parents == ROOT, False, shown[self.parents]).astype(np.intp)


def best_parents(views: csr_array) -> NDArray[np.intp]:
    """Parents (N,) in a tree of the greatest sum of mutual information, by Prim's algorithm; word 0 is the root.

    Words that were seen in the very same views are merged first. None tells more about one of them than the others,
    I(x; y) ≤ H(x) = I(x; x), so a best tree joins them directly; most words of a drive are like that. The N² mutual
    informations are never held: each word that is joined is compared with all others once.
    """
    first, group = _distinct(views)
    parents = first[group]
    parents[first] = ROOT
    joined = _prim(views.tocsc()[:, first])
    parents[first[1:]] = first[joined[1:]]
    return parents


def _distinct(views: csr_array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first word of each set of equal ones, rising, and the set of each word, (N,)."""
    columns = views.tocsc().sorted_indices()
    sets: dict[bytes, int] = {}
    bounds = zip(columns.indptr[:-1], columns.indptr[1:], strict=True)
    group = np.array([sets.setdefault(columns.indices[a:b].tobytes(), len(sets)) for a, b in bounds], np.intp)
    return np.unique(group, return_index=True)[1], group


def _prim(words: csr_array) -> NDArray[np.intp]:
    """Parents (D,) in a maximum spanning tree of the mutual information between columns of (K, D), from column 0."""
    K, D = words.shape
    counts = np.asarray(words.sum(axis=0)).astype(np.intp)
    rows = words.T.tocsr()
    best, parents = np.full(D, -np.inf), np.full(D, ROOT, np.intp)
    outside = np.ones(D, np.bool_)
    newest = 0
    for _ in range(D - 1):
        outside[newest] = False
        seen = np.zeros(K)
        seen[rows.indices[rows.indptr[newest] : rows.indptr[newest + 1]]] = 1
        told = mutual_information(K, counts, counts[newest], (rows @ seen).astype(np.intp))
        closer = outside & (told > best)
        best[closer], parents[closer] = told[closer], newest
        newest = int(np.argmax(np.where(outside, best, -np.inf)))
    return parents


def mutual_information(
    K: int, counts: NDArray[np.intp], count: np.intp, together: NDArray[np.intp]
) -> NDArray[np.float64]:
    """I(x; y) [nat] of words x, seen ``counts`` (D,) times, and y, seen ``count`` times, in K views.

    ``together`` (D,) is how often both were seen. Equal counts give equal bits, so that ties are ties.
    """
    n_log_n = xlogy(np.arange(K + 1), np.arange(K + 1))
    cells = (together, counts - together, count - together, K - counts - count + together)
    joint = sum(n_log_n[cell] for cell in cells)
    alone = n_log_n[counts] + n_log_n[K - counts] + n_log_n[count] + n_log_n[K - count]
    told: NDArray[np.float64] = (joint - alone + n_log_n[K]) / K
    return told
