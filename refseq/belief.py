"""Belief: a localiser's answer to a view, and the protocol that every localiser fits."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refseq.errors import RefseqError
from refseq.fault import DeclaredFault
from refseq.same_values import SameValues
from refseq.view import View

LOST = -1
"""Stands in ``Belief.path`` where the best path is at a Lost_Place."""


LOST_ABOVE = 0.5
"""A belief whose ``lost`` is above this says that the robot is lost, where nothing else was asked for."""


MODE_FLOOR = 0.01
"""Places below this share of the most probable one's probability part modes: a larger one parts hills of one mode."""

MODE_LEAST = 0.05
"""A run of places of less probability than this, all together, is no mode."""


SLACK = 1e-9
"""A covariance may be off symmetry, or below 0, by so much of its largest entry: rounding."""


class BeliefMode(NamedTuple):
    """One of the stretches that a belief is spread over.

    ``best`` is its most probable place, ``probability`` that of all its places, given that the robot is on the map.
    """

    best: int
    probability: float


@dataclass(frozen=True, slots=True, eq=False)
class PoseBeside(SameValues):
    """Pose of the robot as seen from a place, in the frame of the robot that learnt it.

    ``along`` is how far ahead of the place the robot is and ``aside`` how far to its left [m], ``heading`` how far it
    has turned from the place's heading, counter-clockwise [rad]. ``covariance`` (3, 3) is of these three in this order
    [m², rad², m·rad]: what no sensor tells, as along in a bare corridor, has a variance as large as places leave.
    """

    along: float
    aside: float
    heading: float
    covariance: NDArray[np.float64]

    @property
    def motion(self) -> tuple[float, float, float]:
        """Along and aside [m], heading [rad]."""
        return self.along, self.aside, self.heading


NUMERIC = "iuf"
"""Kinds of NumPy's types that are numbers: texts and truth values, which it would turn into some, are not."""


def pose_beside(motion: ArrayLike, covariance: ArrayLike) -> PoseBeside:
    """A pose from plain numbers: along, aside [m] and heading [rad], and their covariance (3, 3) or row by row (9,).

    Raises ``RefseqError`` for numbers that are not so many or not finite, and for what is no covariance: not symmetric,
    or of a variance below 0 in some direction.
    """
    try:
        given = [np.array(motion), np.array(covariance)]
    except ValueError:  # rows of different lengths
        given = []
    if not given or any(one.dtype.kind not in NUMERIC for one in given):
        raise RefseqError(f"pose {motion!r:.60} ± {covariance!r:.60} is no numbers; valid are 3 and 9")
    moved, spread = (one.astype(np.float64) for one in given)
    if moved.shape != (3,) or spread.shape not in ((9,), (3, 3)):
        raise RefseqError(
            f"pose of shape {moved.shape}, covariance of {spread.shape}; valid are (3,) and (3, 3) or (9,)"
        )
    if not (np.isfinite(moved).all() and np.isfinite(spread).all()):
        raise RefseqError("pose or covariance is not finite; valid are finite numbers")
    spread = spread.reshape(3, 3)
    slack = SLACK * max(1.0, float(np.abs(spread).max()))
    if np.abs(spread - spread.T).max() > slack or np.linalg.eigvalsh(spread).min() < -slack:
        raise RefseqError(f"covariance {spread.ravel().tolist()} is none; valid is symmetric, no variance below 0")
    along, aside, heading = moved.tolist()
    return PoseBeside(along, aside, heading, spread)


class Stage(StrEnum):
    """The thesis' three stages, each one more step of context."""

    UNIFORM = "uniform"
    PRIOR = "prior"
    CHAIN = "chain"

    @property
    def label(self) -> str:
        """The stage in words, for tables and legends."""
        return {
            Stage.UNIFORM: "single view, uniform prior",
            Stage.PRIOR: "with the motion prior",
            Stage.CHAIN: "with the hidden Markov chain",
        }[self]


def stage_named(stage: Stage | str) -> Stage:
    """A stage by its name. Raises ``RefseqError`` for one that there is not."""
    if stage not in list(Stage):
        raise RefseqError(f"stage {stage!r:.60} is unknown; valid are {', '.join(Stage)}")
    return Stage(stage)


@dataclass(frozen=True, slots=True)
class Timings:
    """Wall time spent on one view, by step [s]."""

    features: float = 0.0
    matching: float = 0.0
    mixture: float = 0.0
    chain: float = 0.0

    @property
    def total(self) -> float:
        """Sum of the steps [s]."""
        return self.features + self.matching + self.mixture + self.chain


@dataclass(frozen=True, slots=True, eq=False)
class Belief(SameValues):
    """Distribution over where the robot is.

    ``places`` is (K,) float64 and sums to 1: the probability of each place of the reference sequence, given that the
    robot is on it. ``lost`` is the probability that it is not. ``best`` is the most probable place; ``path`` the best
    places for the last views up to now, oldest first, ``LOST`` where they are at a Lost_Place. ``entropy`` is that of
    ``places`` [nats]. ``faults`` of sensors stand at this view: what they make useless has no part in the belief.

    ``lost_after`` is (K,) float64, the probability of the Lost_Place behind each place: lost, and last sure there
    (3.3.1). What it lacks of ``lost`` is at Lost_0, where nothing is known. None: the method has no Lost_Places.

    ``pose`` is where beside the place ``best`` the robot is, by the scan laid on the place's. None where nothing tells:
    without laser in view, map or sensors, where its walls are others than the place's, and where it says lost.

    ``odometer_scale`` is how many metres of the map a metre of the odometer was taken for; 1: it was believed, or
    nobody tells, as in hindsight.

    Beliefs are equal that are the same answer in all numbers, whatever time they took.
    """

    places: NDArray[np.float64]
    lost: float
    best: int
    path: tuple[int, ...]
    entropy: float
    timings: Timings = field(default=Timings(), compare=False)
    faults: tuple[DeclaredFault, ...] = ()
    lost_after: NDArray[np.float64] | None = None
    pose: PoseBeside | None = None
    odometer_scale: float = 1.0

    @property
    def last_sure(self) -> int | None:
        """The place behind which a robot that says lost most probably got lost.

        None where it does not say lost, or more probably than not nothing is known of where it was (Lost_0).
        """
        if self.lost_after is None or self.lost <= LOST_ABOVE or 2 * self.lost_after.sum() <= self.lost:
            return None
        return int(np.argmax(self.lost_after))

    @property
    def modes(self) -> tuple[BeliefMode, ...]:
        """Stretches of places that the robot may be on, in a map of one sequence (``modes_in``)."""
        return self.modes_in([0])

    def modes_in(self, first: ArrayLike) -> tuple[BeliefMode, ...]:
        """Stretches of places that the robot may be on, the most probable first: several where places look alike.

        A mode is a run of neighbouring places, each of at least ``MODE_FLOOR`` of the highest probability, that have
        ``MODE_LEAST`` together. None runs on from one sequence to the next: ``first`` are their first places
        (``Map.first``). A belief that is the same everywhere is one mode a sequence; one too scattered has none.
        """
        high = np.flatnonzero(self.places >= MODE_FLOOR * self.places.max())
        sequence = np.searchsorted(np.asarray(first), high, side="right")
        runs = np.split(high, np.flatnonzero((np.diff(high) > 1) | (np.diff(sequence) > 0)) + 1)
        modes = [BeliefMode(int(run[np.argmax(self.places[run])]), float(self.places[run].sum())) for run in runs]
        likely = (mode for mode in modes if mode.probability >= MODE_LEAST)
        return tuple(sorted(likely, key=lambda mode: -mode.probability))


def belief_from(
    weights: ArrayLike,
    lost: float = 0.0,
    *,
    best: int | None = None,
    path: tuple[int, ...] | None = None,
    timings: Timings | None = None,
    lost_after: NDArray[np.float64] | None = None,
) -> Belief:
    """A belief from weights of the places (K,), which need not sum to 1, and the probability of being lost.

    ``best`` is by default the place that weighs most, the first of several; ``path`` by default ends there and then.
    ``lost_after`` is taken as it is.
    Raises ``RefseqError`` for weights that make no probabilities (negative, not finite, all 0), and for ``lost``
    outside 0 to 1.
    """
    given = np.asarray(weights, dtype=np.float64)
    largest = float(given.max()) if given.ndim == 1 and given.size else 0.0
    if not 0 < largest < np.inf or not (given >= 0).all():
        span = f", {given.min():g} to {given.max():g}," if given.size else ""
        raise RefseqError(
            f"belief: weights of shape {given.shape}{span} make no probabilities; valid are (K,) finite numbers of 0 "
            "or more, not all 0"
        )
    if not 0 <= lost <= 1:
        raise RefseqError(f"belief: lost = {lost} is not valid; it should be from 0 to 1")
    scaled = given / largest  # so that the sum of large weights cannot overflow
    places = scaled / scaled.sum()
    top = int(np.argmax(given)) if best is None else best
    way = (top,) if path is None else path
    return Belief(places, float(lost), top, way, entropy(places), timings or Timings(), lost_after=lost_after)


def entropy(distribution: NDArray[np.float64]) -> float:
    """Entropy [nats]; 0 · log 0 is 0."""
    positive = distribution[distribution > 0]
    return float(-(positive * np.log(positive)).sum())


def normalised_entropy(distribution: NDArray[np.float64]) -> float:
    """Entropy as a share of the uniform distribution's: 0 is sure, 1 knows nothing; a single place is always sure."""
    return entropy(distribution) / np.log(len(distribution)) if len(distribution) > 1 else 0.0


class LocaliserProtocol(Protocol):
    """Anything that the bench can judge: ours, the baselines, a user's own class."""

    def reset(self) -> None:
        """Forget all views seen."""

    def update(self, view: View) -> Belief:
        """Take the next view and answer from the views up to it."""
