"""The promise of ``best``'s ratios, held against light that is not the map's: places elsewhere average 1 or less.

``REFSEQ_DRIVES`` names a folder of recordings (``refseq record``). Each is asked in the map of each other of its world;
places more than ``APART`` from a view are not its own. A line each: the mean ratio by block, and of their product.
"""

import os
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import Recording, read_recording
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.view import View

pytestmark = pytest.mark.benchmark
APART = 4.0
"""Places so far from a view are elsewhere [m], as in ``LogRatioSettings.apart``."""
MOST, MOST_OF_A_BLOCK = 1.2, 1.6
"""Means that are allowed: of all sensors together, and of a single block, for the samples are small."""


@pytest.fixture(scope="module")
def drives() -> Mapping[str, Recording]:
    folder = os.environ.get("REFSEQ_DRIVES")
    if not folder:
        pytest.skip("REFSEQ_DRIVES names no folder of recordings")
    return {file.stem: read_recording(file) for file in sorted(Path(folder).glob("*.mcap"))}


def evidence_elsewhere(map_: Map, views: Sequence[View]) -> dict[str, float]:
    """Mean ratio of the places elsewhere by block, of each sensor's blocks together ("laser"), and of all ("all")."""
    sequence, model = map_.sequence, map_.sequence.log_ratio_model
    places = np.array([(pose.x, pose.y) for pose in sequence.poses if pose is not None])
    found = defaultdict[str, list[float]](list)
    for view in views:
        assert view.truth is not None
        far = np.hypot(*(places - (view.truth.x, view.truth.y)).T) > APART
        blocks = model.by_block({e.key: e.observe(view).ids for e in sequence.extractors if e.sensor in view.sensors})
        for name, keys in groups(blocks):
            product = model.power(keys) * sum((blocks[key] for key in keys), np.zeros(len(places)))
            found[name].append(float(np.exp(product[far]).mean()))
    return {name: float(np.mean(means)) for name, means in found.items()}


def groups(keys: Mapping[str, object]) -> Iterator[tuple[str, list[str]]]:
    """Blocks alone, those of one sensor, and all."""
    yield from ((key, [key]) for key in keys)
    for sensor in sorted({key.partition("/")[2] for key in keys}):
        yield sensor, [key for key in keys if key.endswith(f"/{sensor}")]
    yield "all", list(keys)


def test_places_elsewhere_average_no_more_than_one(drives: Mapping[str, Recording]) -> None:
    asked = {}
    for reference, query in permutations(drives, 2):
        learnt, other = drives[reference], drives[query]
        if learnt.metadata["world"] == other.metadata["world"]:
            found = evidence_elsewhere(learn(learnt.views, profile=BEST), other.views)
            asked[f"{reference} → {query}"] = found
            figures = "  ".join(f"{name} {mean:.2f}" for name, mean in found.items())
            print(
                f"\n{reference} → {query} ({learnt.metadata['light']} → {other.metadata['light']}):  {figures}",
                flush=True,
            )
    assert asked, "a world needs two drives"
    for name, found in asked.items():
        assert found["all"] <= MOST, name
        assert max(found.values()) <= MOST_OF_A_BLOCK, name
