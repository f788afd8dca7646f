"""Degenerate Bernoulli mixture over the visible features (card B5, eq. 2.15, Algorithm 1).

Letters as in the thesis: K views, C components Θ (columns of zeros and ones), mixture weights α, hidden data Z (K, C),
``cost`` the penalty of a feature that differs. Two misprints of Algorithm 1 are mended: it loops while the residual
still changes, and its Θ update averages the reference views V_k.
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
    log_observed = fit.log_alpha + missing * np.log(settings.cost)
    log_likelihood = logsumexp(fit.log_z + log_observed, axis=1)[group]
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
    """Parameters at the end of EM: ``theta`` (C, n), ``log_alpha`` (C,), ``log_z`` (D, C)."""

    theta: NDArray[np.float64]
    log_alpha: NDArray[np.float64]
    log_z: NDArray[np.float64]
    iterations: int


def _fit(
    views: NDArray[np.float64], multiplicity: NDArray[np.float64], settings: MixtureSettings, rng: np.random.Generator
) -> _Fit | None:
    """Algorithm 1's loop over the distinct columns ``views`` (D, n); None when it does not settle."""
    K, n = multiplicity.sum(), views.shape[1]
    C = max(1, round(settings.components * K))
    theta = _initial_components(views, multiplicity, C, settings.from_views, rng)
    log_alpha = np.full(C, -np.log(C))
    residual = np.inf
    for iteration in range(1, settings.iterations + 1):
        # E step: how far each view is from each component, and whose it therefore is.
        distance = _hamming(views, theta)
        joint = log_alpha + distance * np.log(settings.cost)
        log_z = joint - logsumexp(joint, axis=1, keepdims=True)
        z = np.exp(log_z)
        # The mean share of features in which a view differs from its components.
        previous, residual = residual, float(multiplicity @ (z * distance).sum(axis=1)) / (K * n)
        if abs(previous - residual) < settings.tolerance:
            return _Fit(theta, log_alpha, log_z, iteration)
        # M step: weights, and components rounded to zeros and ones.
        weight = multiplicity[:, None] * z
        total = weight.sum(axis=0)
        with np.errstate(divide="ignore"):
            log_alpha = np.log(total / K)
        theta = np.round((weight.T @ views) / np.maximum(total, np.finfo(float).tiny)[:, None])
    return None


def _initial_components(
    views: NDArray[np.float64], multiplicity: NDArray[np.float64], C: int, from_views: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Some components copy a view each (without repetition while there are enough), the rest are random (C, n)."""
    copies = min(round(from_views * C), int(multiplicity.sum()))
    owners = np.repeat(np.arange(len(views)), multiplicity.astype(int))
    chosen = rng.choice(owners, size=copies, replace=False)
    drawn = rng.integers(0, 2, size=(C - copies, views.shape[1]))
    return np.concatenate([views[chosen], drawn.astype(float)])


def _hamming(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Number of differing entries between rows of zeros and ones, (len(a), len(b))."""
    distance: NDArray[np.float64] = a.sum(axis=1)[:, None] + b.sum(axis=1)[None, :] - 2 * a @ b.T
    return distance
