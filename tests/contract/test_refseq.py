"""What holds for every stage of the localiser and for every feature."""

from dataclasses import replace

import numpy as np
import pytest

from refseq.belief import LOST, Belief, LocaliserProtocol, Stage
from refseq.features import Extractor
from refseq.map.extractors import FEATURES, make_extractor, make_extractors
from refseq.map.learning import learn
from refseq.map.localiser import Localiser
from refseq.map.map import Map
from refseq.map.profile import Profile
from refseq.view import View
from tests.refseq.floors import Leaf, wall_with_doors
from tests.refseq.rooms import cast, rectangle
from tests.support import CAMERAS, corridor_drive

CAMERA = CAMERAS[0]
SENSORS = (CAMERA, "laser")
SIDES = (
    *wall_with_doors((0.0, -1.2, 102.0, -1.2), [(at, at + 0.9, Leaf.NONE) for at in range(2, 100, 5)], 0.15)[0],
    *wall_with_doors((102.0, 1.2, 0.0, 1.2), [(at, at + 1.0, Leaf.AJAR) for at in range(2, 100, 7)], 0.15)[0],
    (102.0, -1.2, 102.0, 1.2),
    (0.0, -4.0, 102.0, -4.0),
    (0.0, 4.0, 102.0, 4.0),
)
"""A corridor of 102 m with doors to rooms on both sides."""
every_stage = pytest.mark.parametrize("stage", list(Stage))
every_feature = pytest.mark.parametrize("feature", list(FEATURES))


@pytest.fixture(scope="module")
def drives() -> tuple[list[View], list[View]]:
    """The same corridor twice, the second time darker and on another line; one camera and the laser."""
    rng = np.random.default_rng(0)
    return equipped(corridor_drive(rng, 9, size=96)), equipped(corridor_drive(rng, 9, brightness=0.7, size=96))


def equipped(views: list[View]) -> list[View]:
    """With one of the cameras, and scans of a corridor that has doors and a cupboard."""
    walls = [*SIDES, *rectangle(5.0, 0.7, 6.0, 1.2)]
    return [replace(v, images={CAMERA: v.images[CAMERA]}, scan=cast(walls, v.truth)) for v in views]


@pytest.fixture(scope="module")
def map_(drives: tuple[list[View], list[View]]) -> Map:
    return learn(drives[0])


def answers(localiser: LocaliserProtocol, views: list[View]) -> list[Belief]:
    return [localiser.update(view) for view in views]


# --- every stage ---


@every_stage
def test_a_stage_answers_with_probabilities(stage: Stage, map_: Map, drives: tuple[list[View], list[View]]) -> None:
    places = len(map_)
    for number, belief in enumerate(answers(Localiser(map_, stage=stage), drives[1])):
        assert belief.places.shape == (places,)
        assert (belief.places >= 0).all()
        assert belief.places.sum() == pytest.approx(1.0)
        assert 0.0 <= belief.lost <= 1.0
        assert belief.places[belief.best] == belief.places.max()
        assert 1 <= len(belief.path) <= min(number + 1, int(map_.profile.chain.window))
        assert all(place == LOST or 0 <= place < places for place in belief.path)
        positive = belief.places[belief.places > 0]
        assert belief.entropy == pytest.approx(-np.sum(positive * np.log(positive)), abs=1e-9)
        assert belief.timings.total > 0


@pytest.mark.quick_cases("chain")
@every_stage
def test_a_stage_answers_the_same_to_the_same_views_and_after_a_reset(
    stage: Stage, map_: Map, drives: tuple[list[View], list[View]]
) -> None:
    localiser = Localiser(map_, stage=stage, seed=4)
    first = answers(localiser, drives[1])
    localiser.reset()
    again, other = answers(localiser, drives[1]), answers(Localiser(map_, stage=stage, seed=4), drives[1])
    assert first == again == other


@pytest.mark.quick_cases("chain")
@every_stage
def test_a_stage_answers_from_the_views_up_to_now(
    stage: Stage, map_: Map, drives: tuple[list[View], list[View]]
) -> None:
    whole = answers(Localiser(map_, stage=stage), drives[1])
    part = answers(Localiser(map_, stage=stage), drives[1][:6])
    assert whole[:6] == part


@pytest.mark.quick_cases("chain")
@every_stage
def test_a_stage_never_looks_at_the_truth(stage: Stage, map_: Map, drives: tuple[list[View], list[View]]) -> None:
    blindfold = [replace(view, truth=None) for view in drives[1]]
    seeing, blind = (answers(Localiser(map_, stage=stage), views) for views in (drives[1], blindfold))
    assert seeing == blind


@every_stage
def test_a_stage_finds_the_places_of_the_drive_that_it_learnt(
    stage: Stage, map_: Map, drives: tuple[list[View], list[View]]
) -> None:
    found = [belief.best for belief in answers(Localiser(map_, stage=stage), drives[0])]
    # The chain starts from the Lost_Place: its first answers may still be off.
    late = range(3, len(found))
    assert np.mean([abs(found[k] - k) <= 1 for k in late]) > 0.8


@every_stage
def test_a_stage_answers_to_a_view_without_any_sensor(
    stage: Stage, map_: Map, drives: tuple[list[View], list[View]]
) -> None:
    localiser = Localiser(map_, stage=stage)
    answers(localiser, drives[0][:3])
    belief = localiser.update(View(time=9.0, distance=0.85))
    assert np.isfinite(belief.places).all()
    assert belief.places.sum() == pytest.approx(1.0)


# --- every feature ---


def extractors(feature: str) -> tuple[Extractor, ...]:
    return make_extractors([feature], SENSORS, Profile())


def test_every_feature_is_for_some_sensor() -> None:
    assert all(len(extractors(feature)) >= 1 for feature in FEATURES)


@every_feature
def test_a_feature_names_itself_and_its_sensor(feature: str) -> None:
    for extractor in extractors(feature):
        assert extractor.sensor in SENSORS
        assert extractor.key == f"{feature}/{extractor.sensor}"


@every_feature
def test_ids_are_sorted_unique_and_in_range(feature: str, drives: tuple[list[View], list[View]]) -> None:
    for extractor in extractors(feature):
        learnt = [extractor.learn(view) for view in drives[0]]
        seen = [extractor.observe(view).ids for view in drives[1]]
        assert sum(map(len, learnt)) > 0
        assert sum(map(len, seen)) > 0
        for ids in (*learnt, *seen):
            assert np.issubdtype(ids.dtype, np.integer)
            assert (np.diff(ids) > 0).all()
            assert len(ids) == 0 or (ids[0] >= 0 and ids[-1] < extractor.size)


@every_feature
def test_what_was_learnt_is_found_again(feature: str, drives: tuple[list[View], list[View]]) -> None:
    for extractor in extractors(feature):
        learnt = [set(extractor.learn(view).tolist()) for view in drives[0]]
        seen = [set(extractor.observe(view).ids.tolist()) for view in drives[0]]
        # A word that came later may be nearer to a descriptor than the one that it became at first.
        again = sum(len(one & other) for one, other in zip(learnt, seen, strict=True))
        assert again >= 0.75 * sum(map(len, learnt))


@every_feature
def test_observing_adds_nothing(feature: str, drives: tuple[list[View], list[View]]) -> None:
    for extractor in extractors(feature):
        for view in drives[0]:
            extractor.learn(view)
        size, state = extractor.size, {name: array.copy() for name, array in extractor.state().items()}
        for view in drives[1]:
            extractor.observe(view)
        assert extractor.size == size
        assert all(np.array_equal(array, extractor.state()[name]) for name, array in state.items())


@every_feature
def test_a_feature_is_deterministic_and_survives_saving(feature: str, drives: tuple[list[View], list[View]]) -> None:
    for one, other in zip(extractors(feature), extractors(feature), strict=True):
        for view in drives[0]:
            assert np.array_equal(one.learn(view), other.learn(view))
        loaded = make_extractor(one.key, Profile(), {name: array.copy() for name, array in one.state().items()})
        assert loaded.size == one.size
        for view in drives[1]:
            seen = one.observe(view)
            assert np.array_equal(seen.ids, other.observe(view).ids)
            assert np.array_equal(seen.ids, loaded.observe(view).ids)
            assert seen.extraction > 0
            assert seen.matching >= 0
