"""Degenerate Bernoulli mixture over the visible features (card B5, eq. 2.15, Algorithm 1).

Letters as in the thesis: K views V_k, C components Θ_c (columns of zeros and ones), hidden data Z (whose view is whose
component), ``cost`` the penalty of a feature that differs. Two misprints of Algorithm 1 are mended: it loops while the
residual still changes, and its Θ update averages the reference views. Z is rounded to zeros and ones like Θ, because
soft shares wear sparse components down to nothing (docs/decisions/0002 has the figures).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp


@dataclass(frozen=True, slots=True)
class MixtureSettings:
    """``cost`` between 0.8 and 0.95 (2.15); C is ``components`` · K, of which the share ``from_views`` starts as views.

    EM stops when the mean residual changes by less than ``tolerance``, and has failed after ``iterations``.
    """

    cost: float = 0.8
    components: float = 0.5
    from_views: float = 0.8
    tolerance: float = 1e-3
    iterations: int = 20


@dataclass(frozen=True, slots=True)
class Match:
    """How well each place explains the view: ``likelihood`` (K,) sums to 1, uniform when EM ``failed``.

    It is the posterior under a uniform prior; with any other prior, multiply and normalise (2.12).
    """

    likelihood: NDArray[np.float64]
    failed: bool
    iterations: int


def match_view(visible: NDArray[np.bool_], settings: MixtureSettings, rng: np.random.Generator) -> Match:
    """Compare a view with the K places by the mixture of its visible features.

    ``visible`` is the reduced incidence matrix (n, K): the rows of the n features that the view shows. The observed
    column is therefore all ones. Without visible features, or when EM does not settle, the answer is uniform.

    Each view belongs to one component, so (2.13)'s sum over components has one term, cost to the power of the features
    that the component lacks. Its factor α_c is left out: Z holds it already (docs/decisions/0002).

    Identical columns are merged and counted: exact, and much cheaper, since most places share none of the features.
    """
    n, K = visible.shape
    if n == 0 or not visible.any():
        return Match(np.full(K, 1 / K), failed=True, iterations=0)
    views, group, multiplicity = _distinct_columns(visible)
    fit = _fit(views, multiplicity, settings, rng)
    if fit is None:
        return Match(np.full(K, 1 / K), failed=True, iterations=settings.iterations)
    missing = n - fit.theta.sum(axis=1)
    log_likelihood = (missing * np.log(settings.cost))[fit.owner][group]
    likelihood = np.exp(log_likelihood - logsumexp(log_likelihood))
    return Match(likelihood, failed=False, iterations=fit.iterations)


def _distinct_columns(
    visible: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.float64]]:
    """Distinct columns as rows (D, n), the one that each place has (K,), and how many places have it (D,)."""
    packed = np.packbits(visible, axis=0).T
    keys = np.ascontiguousarray(packed).view(np.dtype((np.void, packed.shape[1]))).ravel()
    _, first, group, counts = np.unique(keys, return_index=True, return_inverse=True, return_counts=True)
    return visible[:, first].T.astype(float), group.ravel(), counts.astype(float)


@dataclass(frozen=True, slots=True)
class _Fit:
    """The end of EM: components ``theta`` (C, n) of zeros and ones, and the ``owner`` of each distinct view (D,)."""

    theta: NDArray[np.float64]
    owner: NDArray[np.intp]
    iterations: int


def _fit(
    views: NDArray[np.float64], multiplicity: NDArray[np.float64], settings: MixtureSettings, rng: np.random.Generator
) -> _Fit | None:
    """Algorithm 1's loop over the distinct columns ``views`` (D, n); None when it does not settle."""
    K, n = multiplicity.sum(), views.shape[1]
    C = max(1, round(settings.components * K))
    theta = _initial_components(views, multiplicity, C, settings.from_views, rng)
    residual = np.inf
    for iteration in range(1, settings.iterations + 1):
        # E step: each view belongs to the component that it differs from the least.
        distance = _hamming(views, theta)
        owner = np.argmin(distance, axis=1)
        # The mean share of features in which a view differs from its component.
        previous, residual = residual, float(multiplicity @ distance.min(axis=1)) / (K * n)
        if abs(previous - residual) < settings.tolerance:
            return _Fit(theta, owner, iteration)
        # M step: the mean of its views, rounded to zeros and ones; a component without views stays as it is.
        z = np.zeros((len(views), C))
        z[np.arange(len(views)), owner] = multiplicity
        total = z.sum(axis=0)[:, None]
        theta = np.where(total > 0, np.round((z.T @ views) / np.maximum(total, 1)), theta)
    return None


def _initial_components(
    views: NDArray[np.float64], multiplicity: NDArray[np.float64], C: int, from_views: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Components to start from (C, n): copies of the views that share the most with the observed one, the rest random.

    A view that shares little needs no component of its own, for it differs little from an empty one.
    """
    copies = min(round(from_views * C), int(multiplicity.sum()))
    richest = np.argsort(-views.sum(axis=1), kind="stable")
    owners = np.repeat(richest, multiplicity[richest].astype(int))
    drawn = rng.integers(0, 2, size=(C - copies, views.shape[1]))
    return np.concatenate([views[owners[:copies]], drawn.astype(float)])


def _hamming(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Number of differing entries between rows of zeros and ones, (len(a), len(b))."""
    distance: NDArray[np.float64] = a.sum(axis=1)[:, None] + b.sum(axis=1)[None, :] - 2 * a @ b.T
    return distance
