"""The nearest column, on drives whose features are set bit by bit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.view import View
from refseq_bench.scenarios.methods.baselines.hamming import NearestColumn
from tests.refseq.rooms import bits_drive, bits_sequence, without

SIZES = {"one": 7, "two": 5}


def bits(seed: int, views: int, share: float = 0.5) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {sensor: rng.random((views, size)) < share for sensor, size in SIZES.items()}


def learnt(views: list[View]) -> NearestColumn:
    return NearestColumn(bits_sequence(views), views)


@given(st.integers(0, 10_000), st.integers(1, 9), st.floats(0.1, 0.9))
def test_bits_that_differ_are_counted(seed: int, places: int, share: float) -> None:
    reference, query = bits(seed, places, share), bits(seed + 1, 4, share)
    localiser = learnt(bits_drive(reference))
    for t, view in enumerate(bits_drive(query)):
        differing, shown = [], []
        for k in range(places):
            pairs = [(int(a), int(b)) for s in SIZES for a, b in zip(reference[s][k], query[s][t], strict=True)]
            differing.append(sum(a != b for a, b in pairs))
            shown.append(sum(a + b for a, b in pairs))
        found = localiser.update(view)
        best = differing.index(min(differing))
        assert found.best == best
        weights = [0.8**d for d in differing]
        assert found.places == pytest.approx([w / sum(weights) for w in weights])
        assert found.lost == pytest.approx(differing[best] / shown[best] / 2 if shown[best] else 0.5)


def test_its_own_place_is_certain_and_the_opposite_is_doubted() -> None:
    seen = bits(3, 6)
    localiser = learnt(bits_drive(seen))
    for k, view in enumerate(bits_drive(seen)):
        assert localiser.update(view).best == k
        assert localiser.update(view).lost == 0
    single = learnt(bits_drive(seen)[:1])
    opposite = bits_drive({sensor: ~image[:1] for sensor, image in seen.items()})[0]
    assert single.update(opposite).lost == 0.5


def test_a_sensor_that_the_view_lacks_does_not_count() -> None:
    reference, query = bits_drive(bits(0, 6)), bits_drive(bits(1, 4))
    alone = learnt([without(view, "two") for view in reference])
    for view in query:
        part = without(view, "two")
        assert learnt(reference).update(part).places == pytest.approx(alone.update(part).places)


def test_a_place_that_lacked_a_sensor_is_as_far_as_the_average() -> None:
    reference, query = bits(5, 4), bits(6, 1)
    sequence, views = bits_sequence(bits_drive(reference)), bits_drive(reference)
    # The matrix has nothing of the second sensor at place 2, as if all its bits were 0.
    dark = {**reference, "two": reference["two"].copy()}
    dark["two"][2] = False
    sequence = bits_sequence(bits_drive(dark))
    views[2] = without(views[2], "two")
    view = bits_drive(query)[0]
    found = NearestColumn(sequence, views).differing({e.key: e.observe(view) for e in sequence.extractors})
    one, two = ((reference[s] != query[s]).sum(axis=1) for s in SIZES)
    assert found == pytest.approx([*(one + two)[:2], one[2] + two[[0, 1, 3]].mean(), one[3] + two[3]])


def test_a_view_without_sensors_tells_nothing() -> None:
    found = learnt(bits_drive(bits(0, 5))).update(replace(bits_drive(bits(0, 1))[0], images={}))
    assert found.places == pytest.approx(np.full(5, 0.2))
    assert found.lost == 0.5
