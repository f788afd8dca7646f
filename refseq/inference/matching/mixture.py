"""Comparing a view with all places by a Bernoulli mixture: the settings, the forms, and the answer (2.3 to 2.15).

Letters as in the thesis: K views V_k, C components Θ_c, hidden data Z (which share of a view is whose component),
``cost`` the price of a feature that differs.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from refseq.inference.matching import bernoulli, hard_em
from refseq.inference.matching.columns import Columns, Rows, distinct_columns
from refseq.inference.matching.hard_em import Seeding


class MixtureForm(StrEnum):
    """Form of the comparison of a view with the components.

    ``hard_em`` is (2.15), the thesis' degenerate mixture: components of zeros and ones, visible features only, one
    price for all. ``penalty`` is (2.14): components of zeros and ones, all features, a price each. ``bernoulli`` is
    (2.4): probabilities.

    ``counting`` is (2.15) with a component of its own for each place, the place's view, and nothing to fit: the
    likelihood is cost^(visible features that the place lacks). It is the yardstick of what EM brings.
    """

    COUNTING = "counting"
    HARD_EM = "hard_em"
    PENALTY = "penalty"
    BERNOULLI = "bernoulli"


@dataclass(frozen=True, slots=True)
class MixtureSettings:
    """C is ``components`` · K, but at most ``most``; the share ``from_views`` of C starts as views, as ``seeds`` says.

    ``cost`` between 0.8 and 0.95 is the price of a feature that differs (2.15), of the hard form and of counting.

    ``visible`` and ``invisible`` are the penalty form's cost_j of features that the view shows and does not (2.14).
    As printed, cost_j > ½ would reward features that differ, so cost_j is the probability that a feature is like the
    component's (card B4). It should be close to 0 for invisible features, says the thesis, which as a probability would
    favour the places that differ from the view: read as little weight, that is ½, with which a feature says nothing.
    With ``visible`` = 1 / (1 + cost) and ``invisible`` = ½ the form is the hard one.

    ``limit`` keeps the Bernoulli form's components within [limit, 1 − limit]. At 0 a feature never seen with the others
    rules out a component, and nearly every view is impossible.

    EM stops when the mean residual changes by less than ``tolerance``, and has failed after ``iterations``.

    Two for comparison. With ``as_printed`` α_c is in the answer, as (2.13) has it, and counts a component's size twice.
    With ``all_features`` the features that the view does not show are compared as well (Fig. 2.6), at the same price.
    """

    form: MixtureForm = MixtureForm.HARD_EM
    cost: float = 0.8
    visible: float = 0.7
    invisible: float = 0.5
    limit: float = 0.25
    components: float = 0.5
    most: int = 1000
    from_views: float = 0.8
    seeds: Seeding = Seeding.LIKENESS
    as_printed: bool = False
    all_features: bool = False
    tolerance: float = 1e-3
    iterations: int = 20

    def __post_init__(self) -> None:
        """Raise ``ValueError`` for probabilities with which the forms are not what they are called."""
        for name, low, high in (("visible", 0.5, 1.0), ("invisible", 0.5, 1.0), ("limit", 0.0, 0.5)):
            if not low <= (value := getattr(self, name)) < high:
                raise ValueError(f"mixture.{name} is {value}; valid is at least {low} and less than {high}")


@dataclass(frozen=True, slots=True)
class Match:
    """Likelihood of the view at each place: ``likelihood`` (K,) sums to 1, uniform when EM ``failed``.

    It is the posterior under a uniform prior; with any other prior, multiply and normalise (2.12). ``log_average`` is
    the log-likelihood of the average feature combination of all places (1.4.3), on the same scale: 0 would be as
    likely as all places together.
    """

    likelihood: NDArray[np.float64]
    failed: bool
    iterations: int
    log_average: float


def match_view(
    matrix: NDArray[np.bool_] | Rows,
    settings: MixtureSettings,
    rng: np.random.Generator,
    observed: NDArray[np.bool_] | None = None,
) -> Match:
    """Compare a view with the K places by a mixture of some features.

    ``matrix`` holds the features' rows of the incidence matrix, as (n, K) or packed; ``observed`` (n,) is which of them
    the view shows. Without it all: the matrix is then the reduced one, of the visible features only, as hard EM
    has it anyway. Without features, or when EM does not settle, the answer is uniform.

    Identical columns are merged and counted: exact, and much cheaper, since most places share none of the features.
    """
    rows = matrix if isinstance(matrix, Rows) else Rows.from_dense(matrix)
    v = np.ones(rows.n, np.bool_) if observed is None else observed
    visible_only = settings.form in (MixtureForm.HARD_EM, MixtureForm.COUNTING) and not settings.all_features
    if visible_only and not v.all():
        rows, v = rows.select(np.flatnonzero(v)), v[v]
    if not len(rows.places):
        return _nothing(rows.K, 0)
    if settings.form is MixtureForm.COUNTING:
        return _count_differing(rows, v, settings.cost)
    columns = distinct_columns(rows)
    match settings.form:
        case MixtureForm.HARD_EM:
            return _match_hard(columns, v, np.ones(rows.n), np.log(settings.cost), settings, rng)
        case MixtureForm.PENALTY:
            odds = np.log([settings.invisible / (1 - settings.invisible), settings.visible / (1 - settings.visible)])
            return _match_hard(columns, v, odds[v.astype(int)], -1.0, settings, rng)
        case MixtureForm.BERNOULLI:
            return _match_soft(columns, v, settings, rng)


def _count_differing(rows: Rows, v: NDArray[np.bool_], cost: float) -> Match:
    """Each place's own view as its component: log P(v | V_k) is log ``cost`` times the features that differ."""
    signs = (1.0 - 2.0 * v)[rows.numbers()]
    differing = v.sum() + np.bincount(rows.places, signs, minlength=rows.K)
    log_likelihood = np.log(cost) * differing
    average = np.diff(rows.pointers) / rows.K
    log_average = float(np.log(cost) * np.abs(v - average).sum() - logsumexp(log_likelihood))
    return Match(softmax(log_likelihood), failed=False, iterations=0, log_average=log_average)


def _match_hard(
    columns: Columns,
    v: NDArray[np.bool_],
    weights: NDArray[np.float64],
    price: float,
    settings: MixtureSettings,
    rng: np.random.Generator,
) -> Match:
    """Components of zeros and ones: log P(v | Θ_c) is ``price`` times the weights of the features that differ.

    Each view belongs to one component, so (2.12)'s sum over components has one term. Its factor α_c is left out unless
    ``as_printed``: Z holds it already (docs/decisions/0002).
    """
    if not weights.any():
        return _nothing(columns.K, 0)
    C = _count(columns.K, settings)
    start = hard_em.initial_components(columns, v, C, settings.from_views, settings.seeds, rng)
    fit = hard_em.fit(columns, start, weights, settings.tolerance, settings.iterations)
    if fit is None:
        return _nothing(columns.K, settings.iterations)
    log_likelihood = (fit.differences(v, weights) * price)[columns.group]
    if settings.as_printed:
        log_likelihood += np.log(fit.sizes(columns) / columns.K)[columns.group]
    log_sum = logsumexp(log_likelihood)
    log_average = float(weights @ np.abs(v - _average(columns)) * price - log_sum)
    return Match(np.exp(log_likelihood - log_sum), failed=False, iterations=fit.iterations, log_average=log_average)


def _match_soft(columns: Columns, v: NDArray[np.bool_], settings: MixtureSettings, rng: np.random.Generator) -> Match:
    """The full mixture, fitted to these features."""
    C = _count(columns.K, settings)
    seeds = np.unique(hard_em.seed_views(columns, v, round(settings.from_views * C), settings.seeds))
    start = bernoulli.soft_start(columns.views[seeds], C, rng)
    stopping = bernoulli.Stopping(settings.tolerance, int(settings.iterations), settings.limit)
    mixture = bernoulli.maximise(columns, start, stopping)
    record = mixture.convergence
    share = columns.multiplicity / columns.K
    posterior = mixture.posterior(v, share, as_printed=settings.as_printed)
    if not (record.settled and posterior.possible):
        return _nothing(columns.K, record.iterations)
    likelihood = (posterior.places / columns.multiplicity)[columns.group]
    average = np.clip(_average(columns), stopping.limit, 1 - stopping.limit)
    log_average = float(bernoulli.log_probabilities(v[None].astype(float), average[None])[0, 0])
    log_sum = posterior.log_evidence + np.log(columns.K)
    return Match(likelihood, failed=False, iterations=record.iterations, log_average=log_average - log_sum)


def _average(columns: Columns) -> NDArray[np.float64]:
    """The average feature combination: the share of the places that show each feature, (n,)."""
    return np.asarray(columns.multiplicity @ columns.views / columns.K)


def _count(K: int, settings: MixtureSettings) -> int:
    """C, the number of components."""
    return max(1, min(round(settings.components * K), int(settings.most)))


def _nothing(K: int, iterations: int) -> Match:
    """The answer to a view that tells nothing."""
    return Match(np.full(K, 1 / K), failed=True, iterations=iterations, log_average=-float(np.log(K)))
