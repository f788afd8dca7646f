"""Page's test for a change from health to a fault, or back, and for the view since when.

The score is the largest log-likelihood ratio, over all views at which the change may have come, of what was seen since.
A change is declared when it reaches ``DECLARE``. Where the ratios are honest, a healthy sensor reaches it no more often
than once in exp(``DECLARE``) views on average (G. Lorden, "Procedures for reacting to a change in distribution", Annals
of Mathematical Statistics 42, 1971).
"""

import math
from typing import NamedTuple

DECLARE = math.log(10_000)
"""Score at which a fault is declared [nats]: a larger one declares later, and fewer in vain."""

RECOVER = math.log(100)
"""Score at which a sensor is well again [nats]: it is less than ``DECLARE``, as a sensor left out costs little."""

MOST = 8.0
"""One view counts for no more [nats], whatever it shows: a single odd measurement is no fault."""

CERTAIN = 20.0
"""Evidence of what cannot be on a healthy robot [nats], such as stamps that go back: one view is enough."""


class Moment(NamedTuple):
    """The number of a view, and its time [s]."""

    view: int
    time: float


class ChangeTest:
    """One fault of one sensor. ``declared``: the fault stands; ``since`` the moment at which it must have come."""

    def __init__(self) -> None:
        self.declared = False
        self.score, self.since = -math.inf, Moment(0, 0.0)
        self.evidence = 0.0

    def update(self, now: Moment, ratio: float, change: float | None = None) -> None:
        """Take the view of a moment: log-likelihood ratios of the fault to health [nats], bounded by ``MOST``.

        ``ratio`` compares a sensor that was ill at the last view too with one that was well at both; ``change`` is for
        one that fell ill in between, by default the same. Where the fault stands, ``change`` is for getting well.
        """
        towards = -ratio if self.declared else ratio
        begun = towards if change is None else change
        if begun >= self.score + towards:
            self.score, self.since = begun, now
        else:
            self.score += towards

    @property
    def due(self) -> bool:
        """True where the change is sure enough to be told."""
        return self.score >= (RECOVER if self.declared else DECLARE)

    def turn_over(self) -> None:
        """Tell the change: the fault stands from now on, or does so no more."""
        self.declared, self.evidence = not self.declared, self.score
        self.restart()

    def restart(self) -> None:
        """Forget all that speaks for a change."""
        self.score = -math.inf


def bounded(ratio: float) -> float:
    """A log-likelihood ratio within ±``MOST``."""
    return max(-MOST, min(MOST, ratio))


def gaussian(value: float, fault: tuple[float, float], health: tuple[float, float]) -> float:
    """Log-likelihood ratio of a value under two normal distributions, each by its mean and standard deviation."""
    return _log_density(value, *fault) - _log_density(value, *health)


def _log_density(value: float, mean: float, deviation: float) -> float:
    return -0.5 * ((value - mean) / deviation) ** 2 - math.log(deviation)
