"""Matching: a view's features, compared with the places of every sequence of a map."""

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logit, softmax

from refseq.belief import Timings
from refseq.errors import MapError, RefseqError
from refseq.features.memory import clock
from refseq.intake import names_in
from refseq.map.map import Map, check_is_map
from refseq.map.sequence import ReferenceSequence
from refseq.view import View

Features = Mapping[str, NDArray[np.intp]]
"""Ids of the features that a view shows, by extractor, each numbered from 0."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """A view after matching with one sequence: the likelihood of each of its places (K,), sum 1.

    ``timings`` is what matching cost. ``log_ratio`` (K,) is the log-likelihood ratio of each place against being
    elsewhere, ``None`` where the matching does not tell; the likelihood is then the same but for a factor.
    ``log_average`` is the log-likelihood of the average feature combination on the scale of ``likelihood``
    (``mixture.Match``), of the mixture alone.

    ``distance`` and ``turn`` are the motion since the last view [m, rad], NaN where nobody measured it; with ``again``
    the robot has stood, and this view shows the same once more. ``log_ratio_carried`` is the log-likelihood ratio of a
    robot that was carried against one that came as its odometer tells [nats]; 0 where nothing tells, or nobody asks.

    ``never_blind`` (K,) is the part of ``log_ratio`` that holds though the view's words may tell nothing: the scan's.

    Where usual views are asked for (``UsualViews``), ``by_block`` and ``power`` are those of the words' ``LogRatios``,
    the former with what other blocks brought at the places that they were asked about, NaN elsewhere, and ``noise`` is
    that of the view's pictures by camera [grey levels].
    """

    likelihood: NDArray[np.float64]
    distance: float
    timings: Timings
    log_ratio: NDArray[np.float64] | None = None
    log_average: float = -math.inf
    never_blind: NDArray[np.float64] | float = 0.0
    again: bool = False
    turn: float = math.nan
    by_block: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    power: float = 1.0
    noise: Mapping[str, float] = field(default_factory=dict)
    log_ratio_carried: float = 0.0

    @property
    def stands(self) -> bool:
        """True for a view of a robot that has not moved since the last one."""
        return self.again or self.distance == 0.0

    def log_odds_carried(self, before: float) -> float:
        """Log odds that the robot was carried since the last view, by the probability of it ``before`` it was seen."""
        return float(logit(before)) + self.log_ratio_carried

    def with_log_ratio(self, log_ratio: NDArray[np.float64]) -> "Measurement":
        """The same view with other log ratios of the places, (K,), and the likelihoods that follow from them."""
        return replace(self, log_ratio=log_ratio, likelihood=softmax(log_ratio))


class Matcher:
    """Views to measurements, one for each sequence; what all sequences need of a view is described once.

    ``sensors`` is a subset of the map's (default: all); a view that lacks one is matched by the others. Raises
    ``MapError`` for a sensor that the map does not have, and without the neural network that it was learnt with.
    ``described`` is what was found in the last view, by
    extractor.
    """

    def __init__(self, map_: Map, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        wanted = wanted_of(map_, sensors)
        check_seed(seed)
        self._sequences = map_.sequences
        self.extractors = [tuple(e for e in one.extractors if e.sensor in wanted) for one in map_.sequences]
        for one in (e for own in self.extractors for e in own):
            one.prepare()
        self._seed = seed
        self._count = 0
        self.described: Mapping[str, Any] = {}

    def reset(self) -> None:
        """Start counting views anew; the count is part of the seed."""
        self.described = {}
        self._count = 0

    def match(self, view: View) -> list[Measurement]:
        """Compare a view with the places of every sequence."""
        start = clock()
        described = {e.key: e.describe(view) for e in self.extractors[0] if e.sensor in view.sensors}
        spent = clock() - start
        distance, turn = (view.distance, view.turn) if view.has_odometry else (math.nan, math.nan)
        measured = []
        for sequence, extractors in zip(self._sequences, self.extractors, strict=True):
            start = time.perf_counter()
            seen = {e.key: e.recognise(described[e.key]) for e in extractors if e.key in described}
            timings = Timings(features=spent, matching=time.perf_counter() - start)
            found = compare(sequence, seen, distance, (self._seed, self._count), timings)
            measured.append(replace(found, turn=turn))
            spent = 0.0  # it is the first one's
        self._count += 1
        self.described = described
        return measured


def compare(
    sequence: ReferenceSequence, seen: Features, distance: float, seed: tuple[int, int], spent: Timings
) -> Measurement:
    """Compare the features of a view, ``distance`` [m] after the last one, with all places of a sequence.

    ``seed`` starts the mixture's random components; ``spent`` is what finding the features took.
    """
    start = time.perf_counter()
    if sequence.profile.by_log_ratios:
        found = sequence.ratios(seen)
        measured = Measurement(softmax(found.log_ratios), distance, spent, found.log_ratios)
        if sequence.profile.log_ratio.usual > 0:
            measured = replace(measured, by_block=found.by_block, power=found.power)
    else:
        rows = [sequence.matrix.blocks[key].start + ids for key, ids in seen.items()]
        match = sequence.match(np.concatenate([*rows, np.zeros(0, np.intp)]), seed)
        measured = Measurement(match.likelihood, distance, spent, log_average=match.log_average)
    return replace(measured, timings=replace(spent, mixture=time.perf_counter() - start))


def wanted_of(map_: Map, sensors: Sequence[str] | None) -> frozenset[str]:
    """The sensors to match by: those asked for, or all of the map.

    Raises ``MapError`` for what is no map, and for a sensor that the map does not have.
    """
    check_is_map(map_)
    wanted = frozenset(names_in(sensors) or map_.sensors)
    check_among(wanted, map_.sensors)
    return wanted


def check_seed(seed: object) -> None:
    """Raise ``RefseqError`` for what is no seed."""
    if not isinstance(seed, Integral) or seed < 0:
        raise RefseqError(f"seed {seed!r} is not valid; valid is a whole number from 0")


def check_among(wanted: Iterable[str], there: Iterable[str]) -> None:
    """Raise ``MapError`` for the first sensor wanted that the map does not have."""
    known = sorted(there)
    for sensor in sorted(set(wanted)):
        if sensor not in known:
            raise MapError(f"sensor {sensor!r} is not in the map; valid are {', '.join(known)}")
