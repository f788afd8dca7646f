"""Usual views of a drive: one that brings less at a place than they did at theirs speaks against it.

The log ratios of ``best`` are calibrated by what views bring at places that are not theirs. How much one brings at the
place that is its own is not asked: in another light than the map's nobody knows it beforehand. The drive itself tells
it. Where the chain is sure of a view's place, what each block brought there is remembered. Of a later view, at each
place, the share p of them that brought as little is a p-value against the place, and becomes a ratio by the calibrator
that the others have (``refseq.inference.matching.log_ratio``). It only ever takes away: places that are not the robot's
bring no more than before. So are the fits of keys compared, at the places where keys were laid.

A picture is compared with those of no less noise: a lamp that goes out is no way off the path. A sensor that is asked
alone is not doubted so: a camera before a bare wall brings little anywhere, and nothing else tells that it is there.
"""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.inference.matching.incidence import sensor_of
from refseq.inference.matching.log_ratio import log_calibrated, with_more
from refseq.map.map import Map
from refseq.map.matcher import Measurement
from refseq.map.tracking.sure import sure_place

ALIKE = 1.25
"""Noise that differs by no more than this factor is the same."""
FEWEST = 2
"""So many sensors must have been asked about a view for it to be doubted."""
QUIET = 1.0
"""Noise below this is that of any camera by day [grey levels], and not told apart."""


class _Usual(NamedTuple):
    """One view of the drive: log ratios that it ``brought`` at its place, by block, and its pictures' ``noise``."""

    brought: Mapping[str, float]
    noise: Mapping[str, float]


class UsualViews:
    """Weighs the views of a drive by what those before brought: ask, then let it remember what was believed.

    ``log_ratio.usual`` of the map's profile is how many of them are remembered.
    """

    def __init__(self, map_: Map) -> None:
        self._map, settings = map_, map_.profile.log_ratio
        self._blind = settings.blind
        self._usual: deque[_Usual] = deque(maxlen=int(settings.usual))
        self._last: _Usual | None = None

    def reset(self) -> None:
        """Forget all views seen."""
        self._usual.clear()
        self._last = None

    def weighed(self, measured: Sequence[Measurement]) -> list[Measurement]:
        """A view's measurements in every sequence, with what speaks against each place."""
        if self._last is not None and not measured[0].stands:  # while it stands, all its views are one
            self._usual.append(self._last)
            self._last = None
        return [self._weighed(one) for one in measured]

    def remember(self, measured: Sequence[Measurement], belief: Belief) -> None:
        """Remember what a view brought at its place, where the belief is sure of it."""
        best = None if measured[0].stands or not measured[0].by_block else sure_place(self._map, belief)
        if best is None:
            return
        number = self._map.sequence_of(best)
        one = measured[number]
        told = {key: float(ratios[best - self._map.first[number]]) for key, ratios in one.by_block.items()}
        brought = {key: ratio for key, ratio in told.items() if not math.isnan(ratio)}
        self._last = _Usual(brought, one.noise)

    def _weighed(self, measured: Measurement) -> Measurement:
        if measured.log_ratio is None or not self._usual:
            return measured
        by_what_may_be_blind = measured.log_ratio - measured.never_blind
        doubted = with_more(by_what_may_be_blind, -measured.power * self._against(measured), self._blind)
        return measured.with_log_ratio(doubted + measured.never_blind)

    def _against(self, measured: Measurement) -> NDArray[np.float64]:
        """Sum over the blocks of what speaks against each place, (K,), 0 or more."""
        against = np.zeros(len(measured.likelihood))
        if len({sensor_of(key) for key in measured.by_block}) < FEWEST:
            return against
        for key, ratios in measured.by_block.items():
            sensor = sensor_of(key)
            noise = _noise(measured.noise, sensor)
            usual = [
                one.brought[key]
                for one in self._usual
                if key in one.brought and _noise(one.noise, sensor) * ALIKE >= noise
            ]
            against += too_little(np.array(usual), ratios)
        return against


def _noise(by_camera: Mapping[str, float], sensor: str) -> float:
    return max(QUIET, by_camera.get(sensor, 0.0))


def too_little(usual: NDArray[np.float64], brought: NDArray[np.float64]) -> NDArray[np.float64]:
    """Log ratio against places at which a view ``brought`` (K,), by what is ``usual`` (n,) at the right ones; (K,).

    Nothing speaks against a place at which it brought as much as most do, nor against one that was not asked, NaN.
    """
    shares = (1 + np.arange(len(usual) + 1)) / (len(usual) + 1)
    ratios = np.maximum(log_calibrated(shares), 0.0)
    as_little = np.searchsorted(np.sort(usual), brought, side="right")  # of NaN all of them
    against: NDArray[np.float64] = ratios[as_little]
    return against
