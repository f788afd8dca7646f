"""Proportions with Wilson's 95 % score interval."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True, slots=True)
class Proportion:
    """``successes`` out of ``trials``."""

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share, ``nan`` without trials."""
        return self.successes / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % score interval (E. B. Wilson, JASA 22, 1927); (0, 1) without trials: nothing is known."""
        if not self.trials:
            return 0.0, 1.0
        from scipy.stats import binomtest  # a second to import, which a command without figures need not wait

        found = binomtest(self.successes, self.trials).proportion_ci(method="wilson")
        return float(found.low), float(found.high)

    @classmethod
    def pooled(cls, shares: Iterable[Self]) -> Self:
        """The share of all that some are shares of."""
        found = list(shares)
        return cls(sum(one.successes for one in found), sum(one.trials for one in found))

    def __str__(self) -> str:
        return share_words(self.value, *self.interval)


def share_words(value: float, low: float, high: float) -> str:
    """A share in per cent with its interval; ``nan`` is one of nothing."""
    return "n/a" if math.isnan(value) else f"{100 * value:.1f} % [{100 * low:.0f}, {100 * high:.0f}]"
