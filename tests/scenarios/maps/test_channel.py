from dataclasses import replace

import numpy as np
import pytest

from refseq.inference.matching.channel import capacity
from refseq.map.map import Map
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.maps.channel import channel_summaries, learnt_channels, placed
from tests.refseq.rooms import bits_drive, bits_map

K = 30


def drive(bits: np.ndarray, known: bool = True) -> list[View]:
    views = bits_drive({"camera": bits})
    return [replace(view, truth=Pose(float(k), 0.0, 0.0) if known else None) for k, view in enumerate(views)]


@pytest.fixture
def bits() -> np.ndarray:
    return np.random.default_rng(3).random((K, 200)) < 0.2


@pytest.mark.parametrize("known", [True, False])
def test_the_rates_of_a_drive_are_learnt_with_and_without_true_poses(bits: np.ndarray, known: bool) -> None:
    rng = np.random.default_rng(4)
    map_ = bits_map(drive(bits, known))
    seen = rng.random(bits.shape) < np.where(bits, 0.8, 0.03)
    counts = learnt_channels(map_, drive(seen, known))
    (found,) = channel_summaries(map_, counts, rng)
    assert (found.noise.detection, found.noise.false_alarm) == pytest.approx((0.8, 0.03), abs=0.02)
    assert found.capacity == capacity(found.noise) < found.z_capacity
    assert found.told.bits <= found.told.limit == np.log2(K)
    assert found.features_told > found.told.bits


def test_views_off_the_map_count_for_nothing(bits: np.ndarray) -> None:
    map_: Map = bits_map(drive(bits))
    views = [replace(view, truth=Pose(float(k), 9.0 * (k % 2), 0.0)) for k, view in enumerate(drive(bits))]
    assert [one.place for one in placed(map_, views)] == list(range(0, K, 2))
    with pytest.raises(ScenarioError, match="none of 1 views is at a place of the map; valid"):
        learnt_channels(map_, views[1:2])


def test_a_drive_without_the_map_s_sensors_is_told(bits: np.ndarray) -> None:
    map_, views = bits_map(drive(bits)), drive(bits)
    with pytest.raises(ScenarioError, match="no view has a sensor of the map; valid are views of camera"):
        learnt_channels(map_, [replace(view, images={}) for view in views])
