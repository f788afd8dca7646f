"""Stands: all views of a robot that stands show the same, and count as one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from refseq.map.matcher import Measurement

LEAST = math.exp(-700.0)
"""The least likelihood of a place that is counted: one view that rules it out does not speak for all."""


@dataclass(frozen=True, slots=True)
class _Sum:
    """Sum of what the views of a stand tell of the places of one sequence; ``first`` is the view that began it."""

    first: Measurement
    count: int
    logs: NDArray[np.float64]
    log_average: float

    @classmethod
    def of(cls, first: Measurement) -> Self:
        return cls(first, 1, _logs(first), first.log_average)

    def plus(self, measured: Measurement) -> "_Sum":
        logs, log_average = self.logs + _logs(measured), self.log_average + measured.log_average
        return _Sum(self.first, self.count + 1, logs, log_average)

    def mean(self, last: Measurement) -> Measurement:
        logs = self.logs / self.count
        return replace(
            last,
            likelihood=softmax(logs),
            distance=self.first.distance,
            log_ratio_carried=self.first.log_ratio_carried,
            log_ratio=None if last.log_ratio is None else logs,
            log_average=self.log_average / self.count,
        )


class Stands:
    """Views in their order, of which those that repeat one (``Measurement.again``) are put together with it.

    What successive views of one place tell is not independent. Their mean tells as much as one, with less noise.
    """

    def __init__(self) -> None:
        self._sums: list[_Sum] = []

    def mean(self, measured: Sequence[Measurement]) -> Sequence[Measurement]:
        """The measurement in every sequence, or the mean of its stand, ``again`` then and with its first one's step."""
        if not measured[0].again or not self._sums:
            self._sums = [_Sum.of(one) for one in measured]
            return measured
        self._sums = [total.plus(one) for total, one in zip(self._sums, measured, strict=True)]
        return [total.mean(one) for total, one in zip(self._sums, measured, strict=True)]


def _logs(measured: Measurement) -> NDArray[np.float64]:
    if measured.log_ratio is not None:
        return measured.log_ratio
    return np.asarray(np.log(np.maximum(measured.likelihood, LEAST)), np.float64)
