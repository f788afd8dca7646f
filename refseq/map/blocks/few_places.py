"""Evidence that is too dear to be asked of all places: the few likeliest ones are chosen, all others get a ratio of 1.

A block says of some places how much likelier the view is there than elsewhere, calibrated as the words are
(``refseq.inference.matching.log_ratio``): the scores of reference views at places far from them tell what a place
elsewhere looks like.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief
from refseq.inference.matching.log_ratio import with_more
from refseq.map.map import Map
from refseq.map.matcher import Measurement

EXPECTED = 3
"""So many of the places are those that the last belief thought likeliest, the others the words'."""
OPEN = 2
"""So many times as many places are asked where the robot may be anywhere: at a start, and while it is lost."""
BESIDE = 2
"""Places learnt so many views of a path apart are beside each other, and show the same walls."""
NO_PLACES = np.zeros(0, np.intp)
"""None are screened."""


class Block(Protocol):
    """Evidence for a few places: ``most`` of them are asked on the way, 0 is none.

    Where ``screened`` is not 0, so many that words find likeliest are looked through as well. ``blind`` is the chance
    that the view tells nothing of its place, neither by its words nor by this block.
    """

    most: int
    screened: int
    blind: float

    @property
    def sees(self) -> bool:
        """True where the view tells anything."""

    def log_ratios(self, places: NDArray[np.intp], screened: NDArray[np.intp] = NO_PLACES) -> NDArray[np.float64]:
        """Log-likelihood ratios of some places and of those ``screened``, (n,), both counted through the map."""

    def brought(self, places: NDArray[np.intp]) -> Mapping[str, NDArray[np.float64]]:
        """Log ratios by key, (n,) each, that ``UsualViews`` compares with other views' of the drive; may be none."""


class FewPlaces:
    """Adds the log-likelihood ratios of some blocks to those of words, view by view.

    Each block is asked for the places that the words alone, and the last belief, name: none follows from another. What
    it brought there stands in ``Measurement.by_block`` where usual views are asked for, NaN at all other places.
    """

    def __init__(self, map_: Map, blocks: Sequence[Block]) -> None:
        self._map, self._asks_usual = map_, map_.profile.log_ratio.usual > 0
        # What is blind where words are is one product with them; a ratio of its own is multiplied behind it.
        self._blocks = sorted((block for block in blocks if block.most), key=lambda block: -block.blind)

    def weighed(self, measured: Sequence[Measurement], last: Belief | None) -> list[Measurement]:
        """Measurements with the blocks' evidence; ``last`` is the belief on the view before, where it is a prior."""
        words = [one.log_ratio for one in measured if one.log_ratio is not None]
        asked = [block for block in self._blocks if block.sees]
        if not asked or len(words) < len(measured):
            return list(measured)
        by_words = np.concatenate(words)
        ratios, never_blind, brought = by_words.copy(), np.zeros(len(by_words)), dict[str, NDArray[np.float64]]()
        start = time.perf_counter()
        likeliest = np.argsort(-by_words, kind="stable")
        for block in asked:
            named = self._places(block.most, likeliest, last, measured[0].distance)
            screened = np.setdiff1d(likeliest[: block.screened], named)
            places, more = np.concatenate([named, screened]), block.log_ratios(named, screened)
            ratios[places] = with_more(ratios[places], more, block.blind)
            if not block.blind:
                never_blind[places] += more
            for key, told in block.brought(places).items() if self._asks_usual else ():
                brought[key] = np.full(len(ratios), np.nan)
                brought[key][places] = told
        stretches = [slice(*bounds) for bounds in pairwise(self._map.first.tolist())]
        weighed = [
            replace(
                one.with_log_ratio(ratios[its]),
                never_blind=never_blind[its],
                by_block={**one.by_block, **{key: told[its] for key, told in brought.items()}},
            )
            for one, its in zip(measured, stretches, strict=True)
        ]
        timings = weighed[0].timings
        spent = timings.matching + time.perf_counter() - start
        return [replace(weighed[0], timings=replace(timings, matching=spent)), *weighed[1:]]

    def _moved(self, places: NDArray[np.float64], distance: float) -> NDArray[np.float64]:
        """The last belief, carried on by the odometer along each sequence."""
        if not np.isfinite(distance):
            return places
        shares = np.split(places, self._map.first[1:-1])
        return np.concatenate(
            [
                np.interp(sequence.along - distance, sequence.along, share, left=0.0, right=0.0)
                for sequence, share in zip(self._map.sequences, shares, strict=True)
            ]
        )

    def _places(self, most: int, likeliest: NDArray[np.intp], last: Belief | None, distance: float) -> NDArray[np.intp]:
        """The places that are asked for: ``likeliest`` by the words of this view, and where it is expected."""
        most = most if last is not None and last.lost <= LOST_ABOVE else OPEN * most
        by_words = likeliest[:most]
        if last is None:
            return by_words
        many = min(EXPECTED, most // 2)
        expected = np.argsort(-self._moved(last.places, distance), kind="stable")[:many]
        return np.union1d(by_words[: most - many], expected)


def beside(map_: Map, places: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Pairs of some places that are beside each other, (n, n)."""
    return map_.in_a_row(places[:, None], places, BESIDE)


def beyond_nearest(far: NDArray[np.float64], beside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """By how much places that are ``far`` (n,) are farther than the nearest of those ``beside`` (n, n) them, (n,).

    It is 0 for a place that is infinitely far.
    """
    nearest = np.where(beside, far, np.inf).min(axis=1, initial=np.inf)
    beyond: NDArray[np.float64] = np.subtract(far, nearest, out=np.zeros(len(far)), where=np.isfinite(far))
    return beyond


def pairs_elsewhere(map_: Map, views: int, places: int) -> Iterator[tuple[int, int]]:
    """Views of the reference, ``views`` of each sequence spread evenly, each with ``places`` places far from it.

    Both are counted through the map; far is what ``log_ratio.apart`` of its profile says.
    """
    rng, apart = np.random.default_rng(0), map_.profile.log_ratio.apart
    for first, sequence in zip(map_.first[:-1].tolist(), map_.sequences, strict=True):
        for view in np.unique(np.linspace(0, len(sequence) - 1, views).round().astype(int)).tolist():
            far = np.flatnonzero(np.abs(sequence.along - sequence.along[view]) > apart)
            for place in rng.choice(far, min(places, len(far)), replace=False).tolist():
                yield first + view, first + place
