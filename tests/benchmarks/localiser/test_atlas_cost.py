"""What maps side by side cost: comparing two, merging eight, and localising in an atlas of eight.

The drives are along one corridor whose pictures are drawn from random spots, and give about as many features as real
ones; all shorter maps are stretches of one that was learnt. Times are of the processor and are compared within one run.
"""

import math
import time
from collections.abc import Callable
from dataclasses import fields, replace
from itertools import combinations

import cv2
import numpy as np
import pytest

from refseq.atlas.merge import merge_maps
from refseq.atlas.overlap import PairSearch, overlaps
from refseq.atlas.similarity import view_similarity
from refseq.belief import Belief, Timings
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map, beside
from refseq.map.profile import BEST
from refseq.map.reduction import reduced
from refseq.map.sequence import ReferenceSequence
from refseq.view import View
from tests.benchmarks.stopwatch import Stopwatch
from tests.refseq.rooms import named_maps

pytestmark = pytest.mark.benchmark
CAMERAS = ("forward", "lateral")
SPACING = 0.85  # [m]
COUNT = 200
QUERIES = 12
STEPS = [step.name for step in fields(Timings)]
NAMES = tuple("abcdefgh")
MERGED, EVERY = 32, 12
"""Views of each of the eight maps that are merged, and how many views behind the last one the next begins."""


def drive(seed: int, count: int = COUNT, brightness: float = 1.0) -> list[View]:
    """A view each ``SPACING``, with the pictures that belong to its place, and fresh noise on them."""
    noise = np.random.default_rng(seed)
    return [
        View(
            float(k),
            {name: picture(k, n, brightness, noise) for n, name in enumerate(CAMERAS)},
            distance=SPACING * (k > 0),
        )
        for k in range(count)
    ]


def picture(place: int, camera: int, brightness: float, noise: np.random.Generator) -> np.ndarray:
    """Spots of three sizes, the larger the longer to be seen along the way, (480, 640) uint8."""
    layers = []
    for lasting, size in ((3, 8), (6, 20), (12, 60)):
        rng = np.random.default_rng([place // lasting, camera, size])
        layers.append(cv2.resize(rng.random((480 // size, 640 // size)), (640, 480)))
    drawn = 255 * brightness * np.mean(layers, axis=0) + noise.normal(0, 2, (480, 640))
    return np.asarray(np.clip(drawn, 0, 255), np.uint8)


@pytest.fixture(scope="module")
def whole() -> ReferenceSequence:
    return learn(drive(1), profile=BEST).sequence


@pytest.fixture(scope="module")
def again() -> ReferenceSequence:
    """The same way in other light."""
    return learn(drive(2, brightness=0.7), profile=BEST).sequence


def stretch(of: ReferenceSequence, start: int, count: int) -> ReferenceSequence:
    """Some places of a map as a map of its own, of which nothing has been reckoned yet."""
    return reduced(of, np.arange(start, start + count))


def seconds(work: Callable[..., object], *given: object) -> float:
    start = time.process_time()
    work(*given)
    return time.process_time() - start


def test_comparing_two_maps_grows_with_the_product_of_their_lengths_at_most(
    whole: ReferenceSequence, again: ReferenceSequence
) -> None:
    """Words of one are looked for among those of the other, and each view at each place."""
    sizes = (50, 100, 200)
    print("\nplaces  words in both  comparing [s]  a pair of views [ms]")
    costs = []
    for count in sizes:
        pairs = [(stretch(again, 0, count), stretch(whole, 0, count)) for _ in range(3)]
        cost = min(seconds(view_similarity, *pair) for pair in pairs)
        words = stretch(whole, 0, count).matrix.N + stretch(again, 0, count).matrix.N
        print(f"{count:6d}  {words:13d}  {cost:13.2f}  {1e3 * cost / count**2:20.4f}")
        costs.append(cost)
    for (small, cost), (large, more) in combinations(zip(sizes, costs, strict=True), 2):
        assert more < 1.2 * cost * (large / small) ** 2


def test_a_view_among_eight_paths_costs_less_than_two_on_one_as_long(whole: ReferenceSequence) -> None:
    """What all of them need of a view is described once; words that several know are looked for in each."""
    parts = [stretch(whole, n * COUNT // 8, COUNT // 8) for n in range(8)]
    query = drive(3, QUERIES + 1, 0.7)
    localisers: dict[str, Localiser] = {
        "one path": Localiser(Map.of(stretch(whole, 0, COUNT))),
        "eight paths": Localiser(beside(named_maps(NAMES, parts))),
    }
    print(f"\na view among {COUNT} places [ms]: in all, and by the clock " + ", ".join(STEPS))
    costs = []
    for name, localiser in localisers.items():
        localiser.update(query[0])  # what is reckoned once for a map
        told: list[Belief] = []
        cost = [seconds(lambda view, to=localiser, told=told: told.append(to.update(view)), view) for view in query[1:]]
        steps = [1e3 * float(np.median([getattr(belief.timings, step) for belief in told])) for step in STEPS]
        print(f"{name:18}  {1e3 * np.median(cost):8.1f}  " + "  ".join(f"{step:8.1f}" for step in steps))
        costs.append(float(np.median(cost)))
    one, eight = costs
    print(f"eight cost {eight / one:.2f} times one")
    assert eight < 2 * one, "half as much again is the aim"


def test_merging_eight_costs_what_comparing_them_two_by_two_does(
    whole: ReferenceSequence, again: ReferenceSequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each meets the next in twenty views. What is left when places are taken out is shorter, but is reckoned anew."""
    maps = [stretch((whole, again)[n % 2], EVERY * n, MERGED) for n in range(8)]
    apart = math.fsum(seconds(overlaps, *pair) for pair in combinations(maps, 2))
    watch = Stopwatch()
    watch.watch(monkeypatch, PairSearch, "overlaps", "comparing")
    unused = [replace(sequence) for sequence in maps]
    with watch.counting("the rest"):
        merged = merge_maps(named_maps(NAMES, unused))
    comparing, rest = (float(watch.spent[name][1]) for name in ("comparing", "the rest"))
    joins = sum(decision.joined for decision in merged.decisions)
    print(f"\neight maps of {MERGED} views, {joins} joins: {comparing:.2f} s comparing + {rest:.2f} s merging")
    print(f"their 28 pairs, each by itself: {apart:.2f} s")
    assert joins >= 5
    assert len(merged.map) < 8 * MERGED
    assert comparing + rest < 1.3 * apart
    assert rest < 0.3 * comparing
