"""What the localiser costs as the map grows, from 1 000 to 100 000 places: a view, and what a map reckons once.

Maps are drawn with the sparsity of a real one (a hallway of 113 places, both profiles): most words are seen at a few
neighbouring places, a minority comes back all over, half of a view's words are such; the laser's bits hold over
stretches. The patches of the profile ``best`` show one of 16 words for each code in every view, so that a word is seen
at a fiftieth to a third of all places however long the path is. Views are those of a place, half of its features lost,
and as many from elsewhere added. Only extraction is left out; matching, filter and chain are the localiser's own.

Times are of the processor, so that a busy machine counts less; memory is what Python and NumPy ask for.
"""

import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.belief import Stage
from refseq.features.extractor import BaseExtractor
from refseq.inference.chain.emissions import Emissions
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.map.matcher import Matcher
from refseq.map.profile import BEST, THESIS, Matching, Profile
from refseq.map.sequence import ReferenceSequence
from refseq.map.tracking.trackers import tracker_for
from refseq.view import Scan, View

pytestmark = pytest.mark.benchmark
SIZES = (1_000, 10_000, 100_000)
QUERIES = 7
SAMPLED = 5
"""Of how many places the emissions are reckoned where all would take too long."""
SPACING = 0.85  # [m]
STRETCH = 8
"""How far the sightings of a word reach that belongs to a place."""
RAREST, COMMONEST = 0.02, 0.4
"""Shares of the places that show the words that are seen all over: as many of one order as of the next."""
CODES, VALUES, STAYING = 384, 16, 0.2
"""Patches' codes and the words of each; how often a code shows the same word at the next place."""


class Packed(NamedTuple):
    """Rows of one block: ``counts`` (n,) of the places of each, and the places one row after the other."""

    counts: NDArray[np.int64]
    places: NDArray[np.int32]


def packed(rows: NDArray[np.int64], places: NDArray[np.int64], n: int, K: int) -> Packed:
    """Rows of pairs of row and place in any order, pairs outside the path left out, repeated ones once."""
    keys = np.unique((rows * K + places)[places < K])
    return Packed(np.bincount(keys // K, minlength=n), (keys % K).astype(np.int32))


def words(rng: np.random.Generator, K: int, local: int, recurring: int) -> Packed:
    """A camera's words: ``local`` ones a place, at some places of a stretch, then ``recurring`` ones."""
    n = local * K
    first = rng.integers(0, K, n)
    reach = np.minimum(rng.geometric(1 / STRETCH, n), 2 * STRETCH)
    row = np.repeat(np.arange(n), reach)
    offset = np.arange(len(row)) - np.repeat(np.cumsum(reach) - reach, reach)
    seen = (offset == 0) | (rng.random(len(row)) < 0.6)
    few = packed(row[seen], first[row[seen]] + offset[seen], n, K)
    many = stretches(rng, np.geomspace(RAREST, COMMONEST, recurring), 3.0, K)
    return Packed(np.concatenate([few.counts, many.counts]), np.concatenate([few.places, many.places]))


def forward_words(rng: np.random.Generator, K: int) -> Packed:
    """Half of what the forward camera shows comes back all along the path."""
    return words(rng, K, local=7, recurring=300)


def lateral_words(rng: np.random.Generator, K: int) -> Packed:
    return words(rng, K, local=3, recurring=30)


def stretches(rng: np.random.Generator, shares: NDArray[np.float64], length: float, K: int) -> Packed:
    """Bits that are seen over stretches of about ``length`` places, each at its share of the places."""
    counts = rng.poisson(-np.log1p(-np.minimum(shares, 0.999)) * K / length) + 1
    row = np.repeat(np.arange(len(shares)), counts)
    first, reach = rng.integers(0, K, len(row)), rng.geometric(1 / length, len(row))
    rows = np.repeat(row, reach)
    offset = np.arange(len(rows)) - np.repeat(np.cumsum(reach) - reach, reach)
    return packed(rows, np.repeat(first, reach) + offset, len(shares), K)


def patches(rng: np.random.Generator, K: int) -> Packed:
    """Words of patches: every code has one of its values at each place, some far more often than others."""
    weights = 1 / (1 + np.arange(VALUES))
    counts, places = [], []
    for _ in range(CODES):
        drawn = rng.choice(VALUES, K, p=weights / weights.sum()).astype(np.uint8)
        # A code that stays has the value of the last place at which it was drawn.
        source = np.maximum.accumulate(np.where(rng.random(K) < STAYING, 0, np.arange(K)))
        value = drawn[source]
        counts.append(np.bincount(value, minlength=VALUES))
        places.append(np.argsort(value, kind="stable").astype(np.int32))
    return Packed(np.concatenate(counts), np.concatenate(places))


def walls(rng: np.random.Generator, K: int) -> Packed:
    return stretches(rng, np.array([0.9, 0.6, 0.1, 0.05, 0.02]), 10.0, K)


def boundary(rng: np.random.Generator, K: int) -> Packed:
    return stretches(rng, np.array([0.999] * 8 + [0.8]), 30.0, K)


def sectors(rng: np.random.Generator, K: int) -> Packed:
    """As a corridor shows them: a hundred bits at most places, many others at few."""
    return stretches(rng, np.concatenate([np.full(75, 0.75), np.geomspace(0.001, 0.5, 400)]), 3.0, K)


def few_words(rng: np.random.Generator, K: int) -> Packed:
    """Words that each belong to a place."""
    return words(rng, K, local=10, recurring=0)


Block = Callable[[np.random.Generator, int], Packed]
PICTURES: Mapping[str, Block] = {"sift/camera-1": forward_words, "sift/camera-2": lateral_words}
LASER: Mapping[str, Block] = {"walls/laser": walls, "boundary/laser": boundary}
PATCHES: Mapping[str, Block] = {"dense/camera-1": patches, "dense/camera-2": patches}
SECTORS: Mapping[str, Block] = {"sectors/laser": sectors}


class Case(NamedTuple):
    """A profile on a kind of map; ``exponent`` bounds how a view's cost grows."""

    name: str
    profile: Profile
    blocks: Mapping[str, Block]
    exponent: float


CASES = [
    Case("thesis, no word comes back", THESIS, {"sift/camera-1": few_words}, 0.9),
    Case("thesis", THESIS, PICTURES | LASER, 1.2),
    Case("best without patches", BEST, PICTURES | LASER | SECTORS, 1.1),
    Case("best", BEST, PICTURES | PATCHES | LASER | SECTORS, 1.1),
]


@dataclass(frozen=True)
class Drawn(BaseExtractor):
    """An extractor whose views' features were drawn beforehand; a view's time is its number."""

    key: str
    size: int
    drawn: Sequence[NDArray[np.intp]]

    @property
    def sensor(self) -> str:
        return self.key.partition("/")[2]

    def learn(self, view: View) -> NDArray[np.intp]:
        return self.describe(view)

    def describe(self, view: View) -> NDArray[np.intp]:
        return self.drawn[int(view.time)]

    def recognise(self, described: NDArray[np.intp]) -> NDArray[np.intp]:
        return described

    def state(self) -> Mapping[str, NDArray[Any]]:
        return {}

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        return np.arange(size)


def drawn_map(K: int, kinds: Mapping[str, Block], profile: Profile) -> ReferenceSequence:
    """A map of K places, with extractors that show ``QUERIES`` views of neighbouring places."""
    rng = np.random.default_rng(K)
    blocks = {key: kind(rng, K) for key, kind in kinds.items()}
    counts = np.concatenate([block.counts for block in blocks.values()])
    places = np.concatenate([block.places for block in blocks.values()])
    sizes = {key: len(block.counts) for key, block in blocks.items()}
    del blocks
    matrix = IncidenceMatrix.from_rows(np.concatenate([[0], np.cumsum(counts)]), places, K, sizes)
    views = [seen_again(rng, matrix, K // 2 + number) for number in range(QUERIES)]
    extractors = tuple(
        Drawn(key, sizes[key], [within(view, block) for view in views]) for key, block in matrix.blocks.items()
    )
    along = np.cumsum(rng.uniform(0.9, 1.1, K) * SPACING)
    return ReferenceSequence(matrix, extractors, along, (None,) * K, profile)


def seen_again(rng: np.random.Generator, matrix: IncidenceMatrix, place: int) -> NDArray[np.intp]:
    """Half of a place's features, and for each one lost another, common ones more often than rare ones."""
    true = matrix.column(place)
    kept = true[rng.random(len(true)) < 0.5]
    entries = rng.integers(0, len(matrix.places), len(true) - len(kept))
    return np.union1d(kept, np.searchsorted(matrix.pointers, entries, side="right") - 1)


def within(ids: NDArray[np.intp], block: range) -> NDArray[np.intp]:
    return ids[(ids >= block.start) & (ids < block.stop)] - block.start


def queries() -> list[View]:
    image, scan = np.zeros((1, 1), np.uint8), Scan(np.zeros(1, np.float32))
    return [View(float(number), {"camera-1": image, "camera-2": image}, scan, SPACING) for number in range(QUERIES)]


class Cost(NamedTuple):
    """What a map of K places costs: [ms] a view, by step, and [MB]."""

    K: int
    features: int
    entries: int
    matching: float
    steps: tuple[float, ...]
    map_megabytes: float
    peak_megabytes: float
    once: str

    @property
    def total(self) -> float:
        """The whole localiser, at the chain's stage."""
        return self.matching + self.steps[-1]


def processor_milliseconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return 1e3 * (time.process_time() - start)


def once(sequence: ReferenceSequence) -> str:
    """Reckon what the map needs before the first view, or say how long it would take."""
    start = time.process_time()
    if sequence.profile.method.matching is Matching.LOG_RATIO:
        _ = sequence.log_ratio_model
        return f"{time.process_time() - start:8.1f} s"
    if len(sequence) == min(SIZES):
        _ = sequence.emissions
        return f"{time.process_time() - start:8.1f} s"
    places = np.linspace(0, len(sequence) - 1, SAMPLED).astype(int)
    columns = sequence.matrix.columns_of(places)
    rows = [sequence.match(ids, (0, 0)).likelihood for ids in columns]
    spent = (time.process_time() - start) * len(sequence) / SAMPLED
    # As many rows, of the places sampled: the same size, and none of the time.
    numbered = (rows[number * SAMPLED // len(sequence)] for number in range(len(sequence)))
    sequence.__dict__["emissions"] = Emissions.from_posteriors(numbered, sequence.profile.chain)
    return f"{spent:8.0f} s, reckoned from {SAMPLED} places"


def measured(case: Case, K: int) -> Cost:
    """Every view by every stage, once each; then the first view again, for its memory."""
    sequence = drawn_map(K, case.blocks, case.profile)
    reckoned = once(sequence)
    map_ = Map.of(sequence)
    matcher = Matcher(map_)
    trackers = [tracker_for(stage, map_) for stage in Stage]
    spent = []
    for view in queries():
        measured = []
        matching = processor_milliseconds(lambda view=view, to=measured: to.append(matcher.match(view)))
        spent.append([matching, *(processor_milliseconds(lambda t=t, m=measured[0]: t.update(m)) for t in trackers)])
    matching, *steps = np.median(spent, axis=0)
    matrix = sequence.matrix
    held = (matrix.pointers.nbytes + matrix.places.nbytes) / 1e6
    localiser = Localiser(map_)
    tracemalloc.start()
    for view in queries()[:2]:
        belief = localiser.update(view)
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    assert belief.places.shape == (K,)
    assert np.isclose(belief.places.sum(), 1)
    return Cost(K, matrix.N, len(matrix.places), matching, tuple(steps), held, peak, reckoned)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_growth_with_the_map(case: Case) -> None:
    """The aim is 50 ms a view and 2 GB at 100 000 places; whether it is reached is printed, not demanded."""
    print(f"\n{case.name}  [ms a view, median; MB]")
    print("  places  features    entries   match  uniform   prior   chain  match + chain  map  peak of a view  once")
    costs = []
    for K in SIZES:
        cost = measured(case, K)
        steps = "  ".join(f"{step:6.2f}" for step in cost.steps)
        print(
            f"{cost.K:8d}  {cost.features:8d}  {cost.entries:9d}  {cost.matching:6.1f}   {steps}  {cost.total:13.1f}"
            f"  {cost.map_megabytes:4.0f}  {cost.peak_megabytes:13.0f}  {cost.once}"
        )
        costs.append(cost)
    exponent = np.log(costs[-1].total / costs[0].total) / np.log(SIZES[-1] / SIZES[0])
    megabytes = costs[-1].map_megabytes + costs[-1].peak_megabytes
    print(
        f"exponent {exponent:.2f}; at {SIZES[-1]} places {costs[-1].total:.0f} ms (aim 50), {megabytes:.0f} MB (2000)"
    )
    assert exponent < case.exponent
    assert megabytes < 2000
