"""Test for a robot that has stood since the last view that counted, by pictures, scans and odometer."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.health.change import bounded, gaussian
from refseq.health.pictures import MOVED, SIZE, STANDING, LevelledPicture, change, is_large, levelled
from refseq.health.scan_motion import STILL, moved_ratio
from refseq.view import Scan, View, measures

CLEAR = 2.0
"""Evidence for or against standing that is acted on [nats]."""

SHOWN = 4.0
"""Median grey level off a picture's own below which it would show no motion: a bare wall, the dark."""


class Motion(Enum):
    """Kinds of motion since the last view that counted."""

    MEASURED = auto()
    """As the odometer tells."""
    STOOD = auto()
    """The robot has stood: the view shows once more what that one showed."""
    UNKNOWN = auto()
    """Nobody measured it, or pictures and scans deny what the odometer tells."""


@dataclass(frozen=True)
class Sight:
    """The part of a view that can tell of motion: ``images`` of the cameras that are well, and a scan."""

    images: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)
    scan: Scan | None = None

    @cached_property
    def pictures(self) -> Mapping[str, LevelledPicture]:
        """The images reduced, noise averaged out; without those that are too small, and those that show nothing."""
        reduced = {name: levelled(_reduced(image)) for name, image in self.images.items() if is_large(image)}
        return {name: one for name, one in reduced.items() if one.spread >= SHOWN}

    def moved_since(self, last: "Sight") -> float | None:
        """Log-likelihood ratio of having moved since another sight against having stood [nats]; None: nothing tells."""
        pairs = [(last.pictures[name], now) for name, now in self.pictures.items() if name in last.pictures]
        told = [moved_between(before, now) for before, now in pairs]
        if self.scan is not None and last.scan is not None:
            told += [one for one in [moved_ratio(last.scan, self.scan)] if one is not None]
        return math.fsum(told) if told else None


@dataclass(frozen=True, slots=True)
class Step:
    """The ``motion`` since the last view that counted; ``distance`` [m] and ``turn`` [rad] where it is measured."""

    motion: Motion
    distance: float = 0.0
    turn: float = 0.0


class StandWatch:
    """Views in their order: which of them show a robot that stands, and which a motion that nobody measured.

    Each is compared with the last one that counted, not with the one before: a robot that creeps has moved at length.
    An odometer that stands is believed where pictures and scans agree, and, once it has told of a motion, where they
    cannot tell.
    """

    def __init__(self) -> None:
        self._last: Sight | None = None
        self._alive = False
        self._distance = self._turn = 0.0

    def update(self, view: View, sight: Sight, *, trusted: bool) -> Step:
        """Take the next view; ``trusted`` is False where the odometer is declared ill."""
        measured = trusted and measures(view)
        if measured:
            self._distance, self._turn = self._distance + view.distance, self._turn + view.turn
        motion = self._motion(sight, measured)
        if motion is Motion.STOOD:
            return Step(motion)
        step = Step(motion, self._distance, self._turn) if motion is Motion.MEASURED else Step(motion)
        self._last, self._distance, self._turn = sight, 0.0, 0.0
        return step

    def _motion(self, sight: Sight, measured: bool) -> Motion:
        untold = Motion.MEASURED if measured else Motion.UNKNOWN
        still = abs(self._distance) < STILL and abs(self._turn) < STILL
        self._alive = self._alive or (measured and not still)
        if self._last is None or (measured and not still):
            return untold
        moved = sight.moved_since(self._last)
        if moved is None:
            return untold
        if moved < -CLEAR or (measured and self._alive and moved < CLEAR):
            return Motion.STOOD
        return Motion.UNKNOWN if moved > CLEAR else untold


def moved_between(before: LevelledPicture, now: LevelledPicture) -> float:
    """Log-likelihood ratio of a camera that has moved between two reduced pictures [nats].

    A change smaller than that of a camera that stands says no more for standing than its mean.
    """
    return bounded(gaussian(max(math.log(max(change(before, now), 1e-9)), STANDING[0]), MOVED, STANDING))


def _reduced(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    return np.asarray(cv2.resize(image.astype(np.float32), SIZE, interpolation=cv2.INTER_AREA), np.float32)
