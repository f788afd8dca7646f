"""What a view costs the localiser, step by step.

``REFSEQ_REFERENCE`` and ``REFSEQ_QUERY`` name recordings to measure on; without them it is a corridor whose pictures
are drawn from random spots of several sizes, and give as many keys as a real one's.
"""

import os
import time
from dataclasses import fields, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from refseq.belief import Stage, Timings
from refseq.features.memory import DescriptionMemory, described_once
from refseq.intake import usable
from refseq.logs import read_recording
from refseq.map.guard import SensorGuard
from refseq.map.learning import learn
from refseq.map.localiser import localise
from refseq.map.map import Map
from refseq.map.matcher import Matcher
from refseq.map.profile import PROFILES
from refseq.view import View
from tests.support import corridor_drive

pytestmark = pytest.mark.benchmark
COUNT = 118
QUERIES = 24
MOST_FOR_HEALTH = 1.10
"""Watching the sensors may cost this much of a view at most; 1.03 is the aim."""
STEPS = [step.name for step in fields(Timings)]


@pytest.fixture(scope="module")
def drives() -> tuple[list[View], list[View]]:
    names = [os.environ.get(key) for key in ("REFSEQ_REFERENCE", "REFSEQ_QUERY")]
    if all(names):
        reference, query = (list(read_recording(Path(str(name))).views) for name in names)
        return reference, query
    rng = np.random.default_rng(0)
    return [spotted(view, rng, 1.0) for view in corridor_drive(rng, COUNT, size=24)], [
        spotted(view, rng, 0.6) for view in corridor_drive(rng, COUNT, size=24)
    ]


def spotted(view: View, noise: np.random.Generator, brightness: float) -> View:
    """The view with pictures of 640 × 480 that belong to its place, and fresh noise on them."""
    assert view.truth is not None
    images = {}
    for number, name in enumerate(view.images):
        rng = np.random.default_rng([round(view.truth.x / 0.85), number])
        layers = [cv2.resize(rng.random((480 // size, 640 // size)), (640, 480)) for size in (8, 20, 60)]
        picture = 255 * brightness * np.mean(layers, axis=0) + noise.normal(0, 2, (480, 640))
        images[name] = np.clip(picture, 0, 255).astype(np.uint8)
    return replace(view, images=images)


def milliseconds(map_: Map, views: list[View]) -> tuple[dict[str, float], float]:
    """Median cost of a view by step, and the clocks' share of the whole run, which answers at the chain's stage."""
    start = time.perf_counter()
    beliefs = localise(map_, views, stages=(Stage.CHAIN,))[Stage.CHAIN]
    whole = time.perf_counter() - start
    costs = {step: 1e3 * float(np.median([getattr(belief.timings, step) for belief in beliefs])) for step in STEPS}
    return costs, sum(belief.timings.total for belief in beliefs) / whole


@pytest.mark.parametrize("name", PROFILES)
def test_the_cost_of_a_view(name: str, drives: tuple[list[View], list[View]]) -> None:
    """Extraction is of two images and a scan; all after it should take a tenth of that, which is printed."""
    reference, query = drives
    print(f"\n{name}  [ms a view, median]")
    print("places  features of map  " + "  ".join(f"{step:>8}" for step in STEPS) + "     total  after extraction")
    found = []
    for count in (len(reference) // 2, len(reference)):
        map_ = learn(reference[:count], profile=PROFILES[name])
        localise(map_, query[:1])  # what is reckoned once for a map, before the first view
        costs, share = milliseconds(map_, query[:QUERIES])
        total = sum(costs.values())
        after = (total - costs["features"]) / costs["features"]
        numbers = "  ".join(f"{costs[step]:8.2f}" for step in STEPS)
        print(f"{count:6d}  {map_.sequence.matrix.N:15d}  {numbers}  {total:8.2f}  {100 * after:14.1f} %")
        # What is told is what it takes: nothing of weight is left out of the clocks.
        assert 0.7 < share <= 1
        assert after < 0.5, "most of a view's time is its images'"
        found.append(costs)
    half, full = found
    assert full["features"] < 2 * half["features"], "extraction does not depend on the map"
    # The chain's transitions are a matrix of places by places.
    assert full["mixture"] + full["chain"] < 8 * (half["mixture"] + half["chain"])


@pytest.mark.parametrize("name", PROFILES)
def test_the_cost_of_watching_the_sensors(name: str, drives: tuple[list[View], list[View]]) -> None:
    """A view is matched bare, then bare and under guard with its pictures described: finding keys varies by more."""
    reference, query = drives
    map_ = learn(reference, profile=PROFILES[name])
    matchers = {"bare": Matcher(map_), "again": Matcher(map_), "guarded": SensorGuard(map_)}
    spent: dict[str, list[float]] = {label: [] for label in matchers}
    with described_once(DescriptionMemory()):
        # As a log is read: the guard would put right a drawn scan, whose features were then found for it alone.
        for view in map(usable, query[:QUERIES]):
            for label, matcher in matchers.items():
                start = time.process_time()
                matcher.match(view)
                spent[label].append(time.process_time() - start)
    bare, again, guarded = (1e3 * np.array(spent[label][1:]) for label in matchers)
    ratio = float(1 + np.median(guarded - again) / np.median(bare))
    print(f"\n{name}: {np.median(bare):.1f} ms bare, {np.median(guarded - again):+.1f} ms guarded, ratio {ratio:.3f}")
    assert ratio < MOST_FOR_HEALTH
