"""Where the odometer says the robot is now: the two-level window of Fig. 3.7, in metres along the path."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.inference.chain.discrete_motion import CountedWindow
from refseq.inference.chain.interpolated_motion import SpreadWindow


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """The window around the travelled distance d, and how far it is trusted.

    High, uniform probability reaches ``slack`` [m] + ``drift`` · |d| to both sides of d; low but non-zero probability,
    ``thin`` times the high one, reaches |d| farther (3.2's own limit). ``regularisation`` is α_reg of (2.17).

    In the thesis a place is in the window or it is not. With ``spread`` the window is shared out between the places
    around each of its points, so that the belief moves as far as the odometer says however places and views lie.
    """

    slack: float = 0.5
    drift: float = 0.2
    thin: float = 0.1
    spread: bool = False
    regularisation: float = 0.9

    def wide(self, distance: float) -> float:
        """How far the high probability reaches to both sides of ``distance`` [m]."""
        return self.slack + self.drift * abs(distance)


class MotionWindow(Protocol):
    """P(k | j, d) for all places j and k, every row of sum 1, without its matrix."""

    def shift(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d), (K,): the belief after the motion, with the same sum."""

    def pull(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_k P(k | j, d) value(k), (K,): the transpose of ``shift``."""

    def best(self, score: NDArray[np.float64]) -> NDArray[np.float64]:
        """max_j score(j) + log P(k | j, d), (K,); −∞ where nothing reaches k."""

    def into(self, k: int) -> tuple[slice, NDArray[np.float64]]:
        """Places among which are all that reach ``k``, and log P(k | j, d) for each of them."""

    def surprise(self, belief: NDArray[np.float64]) -> NDArray[np.float64]:
        """Σ_j P(j) P(k | j, d) (−log P(k | j, d)), (K,)."""


def motion_window(
    along: NDArray[np.float64], distance: float, settings: MotionSettings, ends: tuple[int, ...] = (-1,)
) -> MotionWindow:
    """The window over a travelled distance [m]; ``ends`` are the last places of the paths that ``along`` is made of."""
    if settings.spread:
        return SpreadWindow(along, distance, settings.wide(distance), settings.thin, ends)
    return CountedWindow(along, distance, settings.wide(distance), settings.thin)


def motion_prior(
    belief: NDArray[np.float64], along: NDArray[np.float64], distance: float, settings: MotionSettings
) -> NDArray[np.float64]:
    """P(k) = α_reg · P(k | d) + (1 − α_reg) / K, (K,), for the view after ``belief`` (2.17)."""
    moved = motion_window(along, distance, settings).shift(belief)
    prior: NDArray[np.float64] = settings.regularisation * moved + (1 - settings.regularisation) / len(belief)
    return prior
