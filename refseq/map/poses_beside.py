"""Where beside its place the robot is: its scan laid on that of the place (docs/decisions/0032-beside-the-place.md)."""

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief, PoseBeside
from refseq.map.map import Map
from refseq.scan_matching.fit import LaidScan, ScanFit, fitted, laid_scan
from refseq.scan_matching.panorama import panorama
from refseq.scan_matching.screen import Screen
from refseq.view import Scan

ALIKE = 0.87
"""Scans of one place share so many of the beams whose ends both can see: as for joins (decision 0028)."""
KEPT = np.array([0.01, 0.01, np.radians(0.7)])
"""Standard deviations of what no beam tells [m, m, rad]: ranges kept in centimetres, lasers that do not look ahead."""
ARM = 0.3
"""The laser may be so far before or behind the robot's middle [m]: a robot that turns moves it aside."""
KEPT_READY = 512
"""So many places' scans are kept ready to be laid on, 25 kB each: view after view asks for nearly the same ones."""


class PosesBeside:
    """Poses of views beside the places of a map: take each view's scan, then ask for any belief about it."""

    def __init__(self, map_: Map) -> None:
        self._there = lru_cache(KEPT_READY)(lambda place: laid_scan(map_.scan(place)))
        self.take(None)

    def take(self, scan: Scan | None) -> None:
        """Take what the laser saw in the next view; None: nothing that could be trusted."""
        self._scan = laid_scan(None if scan is None else panorama(scan))
        self._fits: dict[int, ScanFit | None] = {}
        self._screen: Screen | None = None
        self._shares: dict[int, float] = {}

    @property
    def sees(self) -> bool:
        """True where the view's scan shows walls."""
        return self._scan is not None

    def shown(self, place: int) -> bool:
        """True where a place's scan shows walls."""
        return self._there(place) is not None

    def most_met(self, places: Sequence[int], most: int) -> list[int]:
        """The ``most`` of some places at which most of the scan's beams meet walls; all, where they are no more."""
        if len(places) <= most or self._scan is None:
            return list(places)
        self._screen = self._screen or Screen(self._scan)
        new = [place for place in places if place not in self._shares]
        self._shares |= zip(new, self._screen.shares([self._there(place) for place in new]).tolist(), strict=True)
        return sorted(places, key=lambda place: -self._shares[place])[:most]

    def fits(self, places: Sequence[int]) -> list[ScanFit | None]:
        """The view's scan laid on those of places; None for one where it does not lie, or where one shows no walls."""
        scan, pairs = self._scan, dict[int, tuple[LaidScan, LaidScan]]()
        for place in places:
            if place not in self._fits:
                self._fits[place] = None
                if scan is not None and (there := self._there(place)) is not None:
                    pairs[place] = there, scan
        self._fits |= zip(pairs, fitted(list(pairs.values())), strict=True)
        return [self._fits[place] for place in places]

    def with_pose(self, belief: Belief) -> Belief:
        """The belief with its pose, where there is one; what that took counts as matching."""
        if self._scan is None or belief.lost > LOST_ABOVE:
            return belief
        start = time.perf_counter()
        pose = self._beside(belief.best)
        spent = belief.timings.matching + time.perf_counter() - start
        return replace(belief, pose=pose, timings=replace(belief.timings, matching=spent))

    def _beside(self, place: int) -> PoseBeside | None:
        [fit] = self.fits([place])
        if fit is None or fit.share < ALIKE:
            return None
        along, aside, heading = fit.motion.tolist()
        return PoseBeside(along, aside, heading, of_robot(fit))


def of_robot(fit: ScanFit) -> NDArray[np.float64]:
    """Covariance (3, 3) of the robot's pose by that of its laser: with what is not known of how it is mounted."""
    turn = fit.motion[2]
    swing = ARM * np.array([1 - np.cos(turn), np.sin(turn), 0.0])
    return np.asarray(fit.covariance + np.diag(KEPT**2) + np.outer(swing, swing))
