"""Pictures that follow each other: whether each camera shows what it showed a step before, moved, or something else.

A robot that was carried sees another place; one that drove by itself sees most of what it saw before. So the keys of a
picture are laid on those of the one before it. How often they do not fit although the robot drove, the drive itself
tells: of a camera that looks aside, or at bare walls, hardly anything ever fits, and it then says nothing.
"""

import math
from collections.abc import Mapping

from refseq.features.key_fit import fit_keys
from refseq.features.word_extractor import PictureKeys

FITS = 12
"""Pictures follow each other where so many keys fit."""
CHANCE = 0.05
"""So many pictures of two places fit by chance, in a world of like doors and posters (0050)."""
MOST = 4.0
"""One picture says no more than this [nats]: someone may step before it."""
MOVED = 0.05
"""A shorter way shows nothing new [m]: the picture before that is kept."""
LARGEST_TURN = math.radians(20.0)
"""After a larger turn a camera sees something else."""


class PictureSteps:
    """The pictures of a drive, each laid on the one before it."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._misfits: dict[str, tuple[int, int]] = {}
        self._last: Mapping[str, PictureKeys] = {}
        self._way = self._turn = 0.0

    def update(self, keys: Mapping[str, PictureKeys], distance: float, turn: float) -> float:
        """Log-likelihood ratio of a robot that was carried against one that came so, ``distance`` and ``turn`` [nats].

        The motion is that since the last view [m, rad]; after one that nobody measured the ratio is 0.
        """
        self._way, self._turn = self._way + abs(distance), self._turn + abs(turn)
        if self._way < MOVED:
            self._last = {**keys, **self._last}
            return 0.0
        compared = self._turn <= LARGEST_TURN  # not so for NaN
        last = self._last if compared else {}
        self._begin(keys)
        return math.fsum(self._ratio(name, last[name], its) for name, its in keys.items() if name in last)

    def _begin(self, keys: Mapping[str, PictureKeys]) -> None:
        self._last, self._way, self._turn = keys, 0.0, 0.0

    def _ratio(self, camera: str, before: PictureKeys, now: PictureKeys) -> float:
        """The ratio of one camera, by the share of its steps that did not fit, counted from one of two."""
        misfits, steps = self._misfits.get(camera, (1, 2))
        fits = fit_keys(before, now).inliers >= FITS
        self._misfits[camera] = misfits + (not fits), steps + 1
        share = misfits / steps
        if fits:
            return max(-MOST, min(0.0, math.log(CHANCE / (1 - share))))
        return min(MOST, max(0.0, math.log((1 - CHANCE) / share)))
