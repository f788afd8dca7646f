"""Motion models along the path: the two-level window of Fig. 3.7, discrete or interpolated, in metres."""

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.discrete_motion import DiscreteMotion
from refseq.inference.chain.interpolated_motion import InterpolatedMotion
from refseq.inference.paths import usual_step


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """The window around the travelled distance d, and how far it is trusted.

    High, uniform probability reaches ``slack`` [m] + ``drift`` · |d| to both sides of d; low but non-zero probability,
    ``tail`` times the high one, reaches |d| farther (3.2's own limit). ``regularisation`` is α_reg of (2.17).

    In the thesis a place is in the window or it is not. An ``interpolated`` window is shared out between the places
    around each of its points, so that the belief moves as far as the odometer says however places and views lie.

    With ``stands_once`` all views of a robot that stands count as one, their mean; without, each speaks anew. A robot
    that looks about itself for where it is gains by the second (docs/decisions/0039-a-robot-that-stands.md).

    An odometer's metres may be off the map's by ``odometer_scale`` (a standard deviation): the chain estimates by how
    much on its way (``refseq.map.tracking.odometer_scale``). 0: they are believed.
    """

    slack: float = 0.5
    drift: float = 0.2
    tail: float = 0.1
    interpolated: bool = False
    regularisation: float = 0.9
    stands_once: bool = False
    odometer_scale: float = 0.0

    def half_width(self, distance: float) -> float:
        """Reach of the high probability to either side of ``distance`` [m]."""
        return self.slack + self.drift * abs(distance)

    def unmeasured(self, step: float) -> "MotionSettings":
        """The settings for a motion that nobody measured, of which the usual ``step`` [m] is taken for the distance.

        The window then reaches from standing still to twice the step.
        """
        return replace(self, slack=self.slack + step)


class MotionModel(Protocol):
    """P(k | j, d) for all places j and k, every row of sum 1, without its matrix."""

    def predict(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""

    def backward(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_k P(k | j, d) value(k), (K,): the transpose of ``predict``."""

    def best(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_j score(j) + log P(k | j, d), (K,); −∞ where nothing reaches k."""

    def predecessors(self, k: int) -> tuple[slice, NDArray[np.float64]]:
        """Places among which are all that reach ``k``, and log P(k | j, d) for each of them."""

    def surprise(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d) (−log P(k | j, d)), (K,)."""


def motion_model(
    along: NDArray[np.float64], distance: float, settings: MotionSettings, ends: tuple[int, ...] = (-1,)
) -> MotionModel:
    """The model of a travelled distance [m]; ``ends`` are the last places of the paths that ``along`` is made of."""
    half_width = settings.half_width(distance)
    if settings.interpolated:
        return InterpolatedMotion(along, distance, half_width, settings.tail, ends)
    return DiscreteMotion(along, distance, half_width, settings.tail)


def motion_prior(
    belief: NDArray[np.float64], along: NDArray[np.float64], distance: float, settings: MotionSettings
) -> NDArray[np.float64]:
    """P(k) = α_reg · P(k | d) + (1 − α_reg) / K, (K,), for the view after ``belief`` (2.17); d may be NaN."""
    if math.isnan(distance):
        distance = usual_step(along)
        settings = settings.unmeasured(distance)
    moved = motion_model(along, distance, settings).predict(belief)
    prior: NDArray[np.float64] = settings.regularisation * moved + (1 - settings.regularisation) / len(belief)
    return prior
