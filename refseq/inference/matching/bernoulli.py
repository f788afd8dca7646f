"""The full Bernoulli mixture of a feature incidence matrix, by EM (2.3 to 2.13).

Letters as in the thesis: K views V_k of N features, C components Θ_c with shares α_c, hidden data Z. Probabilities of
exactly 0 and 1 are legal; everything is reckoned in logarithms, a column that a component excludes having −∞.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.special import logsumexp

from refseq.inference.matching.columns import Columns, Rows, distinct_columns

SOFT = 0.25
"""Components start between this and one less this (a choice): at 0 or 1 a feature could never change again."""


@dataclass(frozen=True, slots=True)
class Stopping:
    """EM has settled when the mean residual changes by less than ``tolerance``, and ends after ``iterations`` anyway.

    ``limit`` keeps the components within [limit, 1 − limit], so that no single feature can exclude a view. The M step
    under that bound is still a maximum, hence the likelihood never decreases.
    """

    tolerance: float = 1e-6
    iterations: int = 200
    limit: float = 0.0


@dataclass(frozen=True, slots=True)
class Convergence:
    """Course of EM: the log-likelihood [nat] (2.5) and the mean residual after each E step, and whether it settled.

    The residual is Σ_k Σ_c z_kc |V_k − Θ_c| / (K N), the mean difference of a view from the components it belongs to.
    """

    log_likelihood: NDArray[np.float64]
    residual: NDArray[np.float64]
    settled: bool

    @property
    def iterations(self) -> int:
        """Number of E steps."""
        return len(self.residual)


class MixturePosterior(NamedTuple):
    """A distribution over places (K,). Where the view is not ``possible``, it tells nothing: this is then the prior.

    ``log_evidence`` is log P(v), of the view at any place, under the prior.
    """

    places: NDArray[np.float64]
    possible: bool
    log_evidence: float = -np.inf


@dataclass(frozen=True, slots=True)
class BernoulliMixture:
    """P(v | Θ) = Σ_c α_c Π_j Θ_cj^v_j (1 − Θ_cj)^(1 − v_j) (2.3, 2.4).

    ``alpha`` is (C,), ``theta`` (C, N); ``z`` (K, C) are the shares that the views it was fitted to have in the
    components. ``convergence`` tells how the fit went.
    """

    alpha: NDArray[np.float64]
    theta: NDArray[np.float64]
    z: NDArray[np.float64]
    convergence: Convergence

    @classmethod
    def fit(
        cls,
        V: NDArray[np.bool_],
        C: int,
        rng: np.random.Generator,
        *,
        from_views: float = 0.5,
        stopping: Stopping | None = None,
        restarts: int = 1,
    ) -> Self:
        """Fit C components to the columns of a matrix (N, K).

        The share ``from_views`` of the components starts near columns of the matrix, no two the same, the rest at
        random (card B6). EM finds the nearest maximum only: with ``restarts`` it is run from as many starts, and the
        likeliest end is taken. Raises ``ValueError`` for a matrix without columns and for less than one component or
        start.
        """
        if V.ndim != 2 or V.shape[1] == 0:
            raise ValueError(f"the matrix has shape {V.shape}; valid is (features, places) with at least one place")
        if C < 1 or restarts < 1:
            raise ValueError(f"components = {C}, restarts = {restarts}; valid is at least 1 of each")
        columns = distinct_columns(Rows.from_dense(V))
        D = len(columns.multiplicity)
        ends = []
        for _ in range(restarts):
            seeds = rng.permutation(D)[: round(from_views * C)]
            ends.append(maximise(columns, soft_start(columns.views[seeds], C, rng), stopping or Stopping()))
        best = max(ends, key=lambda end: float(end.convergence.log_likelihood[-1]))
        return cls(best.alpha, best.theta, best.z[columns.group], best.convergence)

    def log_probability(self, v: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Log P(v | Θ) [nat] (2.3) of a column (N,), or of each row of (M, N); −∞ where no component allows it."""
        joint = log_probabilities(np.atleast_2d(v).astype(float), self.theta) + _log(self.alpha)
        return np.asarray(logsumexp(joint, axis=1)).reshape(v.shape[:-1])

    def posterior(
        self, v: NDArray[np.bool_], prior: NDArray[np.float64] | None = None, *, as_printed: bool = False
    ) -> MixturePosterior:
        """P(k | v) ∝ P(V_k) Σ_c z_kc P(v | Θ_c) over the places fitted to, under a ``prior`` (K,) or a uniform one.

        (2.12) has a factor α_c besides, which counts a component's size twice, for z_kc grows with α_c already
        (docs/decisions/0002): a column that all components explain alike would then favour the larger ones.
        ``as_printed`` puts it in. Raises ``ValueError`` for a prior that is none.
        """
        K = len(self.z)
        prior = np.full(K, 1 / K) if prior is None else prior
        total = prior.sum()
        if prior.shape != (K,) or not (prior >= 0).all() or not 0 < total < np.inf:
            raise ValueError(f"the prior has shape {prior.shape}, sum {total}; valid are {K} numbers ≥ 0, not all zero")
        log_p = log_probabilities(np.atleast_2d(v).astype(float), self.theta)[0]
        log_p += _log(self.alpha) if as_printed else 0.0
        # A place may belong to unlikely components only: sum in logarithms.
        joint = logsumexp(log_p + _log(self.z), axis=1) + _log(prior / total)
        evidence = logsumexp(joint)
        if evidence == -np.inf:
            return MixturePosterior(prior / total, possible=False)
        places = np.exp(joint - evidence)
        return MixturePosterior(places / places.sum(), possible=True, log_evidence=float(evidence))


class Start(NamedTuple):
    """Parameters to start EM from: ``alpha`` (C,) and ``theta`` (C, N)."""

    alpha: NDArray[np.float64]
    theta: NDArray[np.float64]


def soft_start(seeds: NDArray[np.float64], C: int, rng: np.random.Generator) -> Start:
    """C components of equal shares, the first near the columns ``seeds`` (at most C, N), the rest drawn."""
    drawn = rng.uniform(SOFT, 1 - SOFT, size=(C - len(seeds), seeds.shape[1]))
    return Start(np.full(C, 1 / C), np.concatenate([SOFT + (1 - 2 * SOFT) * seeds, drawn]))


def maximise(columns: Columns, start: Start, stopping: Stopping) -> BernoulliMixture:
    """EM from a start; its ``z`` is (D, C), one line for each distinct column."""
    K, N, limit = columns.K, max(1, columns.views.shape[1]), stopping.limit
    alpha, theta = start.alpha, np.clip(start.theta, limit, 1 - limit)
    views = columns.factor(len(theta))
    log_likelihood: list[float] = []
    residual: list[float] = []
    while True:
        # E step (2.9).
        joint = log_probabilities(views, theta) + _log(alpha)
        evidence = np.asarray(logsumexp(joint, axis=1))
        z = np.exp(joint - evidence[:, None])
        counted = z * columns.multiplicity[:, None]
        owned, seen = counted.sum(axis=0), (views.T @ counted).T
        log_likelihood.append(float(columns.multiplicity @ evidence))
        residual.append(float(seen.sum() + owned @ theta.sum(axis=1) - 2 * (seen * theta).sum()) / (K * N))
        settled = len(residual) > 1 and abs(residual[-2] - residual[-1]) < stopping.tolerance
        if settled or len(residual) == stopping.iterations:
            record = Convergence(np.array(log_likelihood), np.array(residual), settled)
            return BernoulliMixture(alpha, theta, z, record)
        # M step (2.10, 2.11); a component without views stays as it is, with a share of nothing.
        alpha = owned / K
        means = np.divide(seen, owned[:, None], out=theta.copy(), where=owned[:, None] > 0)
        theta = np.clip(means, limit, 1 - limit)


def log_probabilities(views: NDArray[np.float64] | csr_matrix, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithms of P(v | Θ_c) (2.4) of the lines of ``views`` (D, N) under components ``theta`` (C, N), (D, C)."""
    never, always = theta <= 0, theta >= 1
    seen, missed = _log(np.where(never, 1.0, theta)), _log(np.where(always, 1.0, 1 - theta))
    log_p: NDArray[np.float64] = views @ (seen - missed).T + missed.sum(axis=1)
    if never.any() or always.any():
        # How many features are there that cannot be, or lack that must be.
        excluded = views @ (never.astype(float) - always).T + always.sum(axis=1)
        log_p[excluded > 0] = -np.inf
    return log_p


def _log(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """The logarithm, −∞ at zero without a warning."""
    with np.errstate(divide="ignore"):
        return np.log(p)
