from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from refseq.errors import MapError
from refseq.features.neural.words import NeuralSettings
from refseq.map.extractors import FEATURES, make_extractor, make_extractors
from refseq.map.learning import learn
from refseq.map.profile import Profile
from refseq.view import LASER, View
from tests.support import corridor_drive

LASER_FEATURES = "walls, doors, corners, boundary, hu, sectors"


@pytest.fixture(scope="module")
def views() -> list[View]:
    return corridor_drive(np.random.default_rng(1), count=6, size=96)


def test_a_drive_becomes_places(views: list[View]) -> None:
    map_ = learn(views, metadata={"world": "x"})
    sequence = map_.sequence
    assert len(map_) == len(sequence) == 6
    assert map_.has_one_path
    assert map_.paths[0].along == pytest.approx(sequence.along)
    assert sequence.sensors == {"forward", "lateral", LASER}
    laser = {"walls/laser", "doors/laser", "boundary/laser", "hu/laser"}
    assert {e.key for e in sequence.extractors} == {"sift/forward", "sift/lateral"} | laser
    assert sequence.along == pytest.approx(0.85 * np.arange(6))
    assert sequence.poses == tuple(view.truth for view in views)
    assert sequence.metadata == {"world": "x"}
    for extractor in sequence.extractors:
        block = sequence.matrix.blocks[extractor.key]
        assert len(block) == extractor.size
        for place, view in enumerate(views):
            ids = sequence.matrix.column(place)
            own = ids[(ids >= block.start) & (ids < block.stop)] - block.start
            np.testing.assert_array_equal(own, extractor.observe(view).ids)


def test_only_the_sensors_asked_for(views: list[View]) -> None:
    assert learn(views, sensors=["lateral"]).sensors == {"lateral"}
    assert learn(views, sensors=[LASER], features=["sectors"]).sensors == {LASER}


def test_a_view_may_lack_a_sensor(views: list[View]) -> None:
    gappy = [replace(view, scan=None) if k == 2 else view for k, view in enumerate(views)]
    sequence = learn(gappy, features=("boundary",)).sequence
    assert [len(ids) > 0 for ids in sequence.matrix.columns()] == [True, True, False, True, True, True]


def test_places_lie_along_the_path_also_when_the_robot_reversed(views: list[View]) -> None:
    back = [replace(view, distance=d) for view, d in zip(views, (9.0, 1.0, -0.5, 0.0, 1.0, -2.0), strict=True)]
    assert list(learn(back, sensors=[LASER]).sequence.along) == [0.0, 1.0, 1.5, 1.5, 2.5, 4.5]


def test_emissions_are_the_sequence_compared_with_itself(views: list[View]) -> None:
    sequence = learn(views).sequence
    similarity = sequence.emissions.similarity
    assert similarity.sum(axis=1) == pytest.approx(1.0)
    assert (np.diag(similarity) >= similarity.max(axis=1) - 1e-12).all()
    assert similarity[2, 2] > 2 * similarity[2, 5]
    np.testing.assert_array_equal(similarity, learn(views).sequence.emissions.similarity)


@pytest.mark.parametrize(
    ("count", "sensors", "features", "message"),
    [
        (0, None, ("sift",), "the drive holds no view; valid is at least one"),
        (2, ["nose"], ("sift",), "sensor 'nose' is not in the drive; valid are forward, laser, lateral"),
        (2, None, ("smell",), f"feature 'smell' is unknown; valid are {', '.join(FEATURES)}"),
        (
            2,
            [LASER],
            ("sift",),
            "features sift do not fit sensors laser; valid are walls, doors, corners, boundary, hu, sectors",
        ),
    ],
)
def test_messages(
    views: list[View], count: int, sensors: Sequence[str] | None, features: Sequence[str], message: str
) -> None:
    with pytest.raises(MapError) as caught:
        learn(views[:count], sensors=sensors, features=features)
    assert str(caught.value) == message


def test_every_registered_feature_fits_the_interface(views: list[View]) -> None:
    """Keys of the tests' small network are alike: only those that are the same become a word, none lies between two."""
    profile = Profile(neural=NeuralSettings(alias_distance=0.0))
    for name in FEATURES:
        for extractor in make_extractors([name], ["forward", LASER], profile):
            assert extractor.key == f"{name}/{extractor.sensor}"
            learnt = [extractor.learn(view) for view in views]
            for view, ids in zip(views, learnt, strict=True):
                assert list(ids) == sorted(set(ids))
                assert all(0 <= i < extractor.size for i in ids)
                np.testing.assert_array_equal(extractor.observe(view).ids, ids)
            again = make_extractor(extractor.key, profile, extractor.state())
            assert again.size == extractor.size
            np.testing.assert_array_equal(again.observe(views[2]).ids, learnt[2])


@pytest.mark.parametrize("key", ["sift/laser", "walls/forward", "smell/nose", "walls"])
def test_a_key_that_fits_nothing(key: str) -> None:
    with pytest.raises(MapError) as caught:
        make_extractor(key, Profile(), {})
    assert str(caught.value) == (
        f"feature {key!r} is unknown; valid are {', '.join(FEATURES)}, a slash and a fitting sensor"
    )
