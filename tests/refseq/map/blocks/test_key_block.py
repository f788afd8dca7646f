"""Keys that fit as a block of its own: it tells places that words cannot, keeps its promise, and is silent unasked."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from refseq.atlas.decision import Decision
from refseq.atlas.merge import merge_maps
from refseq.belief import Stage, belief_from
from refseq.features.key_fit import KeyFit
from refseq.features.word_extractor import PictureKeys
from refseq.inference.matching.log_ratio import Calibration
from refseq.map.blocks import few_places, key_block
from refseq.map.blocks.few_places import FewPlaces
from refseq.map.blocks.key_block import FARTHEST, FEWEST, PRIOR, KeyBlock, laid, score, shared, together
from refseq.map.guard import SensorGuard
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise, smoothed
from refseq.map.map import Map
from refseq.map.profile import BEST, Profile, profile_named
from refseq.planar import Pose
from refseq.view import View

ASKED, PLAIN = "best", "best+log_ratio.geometry=0"

PLACES, TILE = 24, 60
quick = settings(derandomize=True)


def tiles(place: int) -> list[np.ndarray]:
    """Eight posters; places 12 apart have the same ones."""
    rng = np.random.default_rng(place % (PLACES // 2))
    drawn = [rng.integers(0, 255, (10, 10)).astype(np.uint8) for _ in range(8)]
    return [cv2.resize(one, (TILE, TILE), interpolation=cv2.INTER_CUBIC) for one in drawn]


def picture(place: int, aside: int = 0) -> np.ndarray:
    """A grey wall with the posters of a place, hung in an order of its own, seen from so many pixels aside."""
    wall = np.full((240, 480), 128, np.uint8)
    for spot, number in enumerate(np.random.default_rng(1000 + place).permutation(8)):
        y, x = 30 + 110 * (spot // 4), 40 + aside + 105 * (spot % 4)
        wall[y : y + TILE, x : x + TILE] = tiles(place)[number]
    return wall


def drive(places: Sequence[int], aside: int = 0) -> list[View]:
    return [
        View(
            float(k),
            images={"camera": picture(place, aside)},
            distance=0.85 if k else 0.0,
            truth=Pose(0.85 * place, 0.0, 0.0),
        )
        for k, place in enumerate(places)
    ]


@pytest.fixture(scope="module")
def asked() -> Map:
    return learn(drive(range(PLACES)), profile=ASKED, features=["sift"])


@pytest.fixture(scope="module")
def views() -> list[View]:
    return drive(range(PLACES), aside=11)


@pytest.fixture(scope="module")
def block(asked: Map) -> KeyBlock:
    return KeyBlock(asked)


def take(block: KeyBlock, map_: Map, view: View) -> None:
    guard = SensorGuard(map_)
    guard.match(view)
    block.take(guard.keys())


def test_places_of_the_same_words_are_told_by_where_they_are(asked: Map, views: list[View]) -> None:
    """Each picture has the posters of two places: words cannot say which, their order does."""
    words = learn(drive(range(PLACES)), profile=PLAIN, features=["sift"])
    single = {
        name: localise(map_, views, stages=[Stage.UNIFORM])[Stage.UNIFORM]
        for name, map_ in {"words": words, "asked": asked}.items()
    }
    right = {name: sum(one.best == k for k, one in enumerate(told)) for name, told in single.items()}
    either = sum(one.best % 12 == k % 12 for k, one in enumerate(single["words"]))
    assert either == PLACES
    assert right["asked"] >= PLACES - 4
    assert right["words"] <= right["asked"] - 4


def test_all_but_a_few_places_keep_their_ratios(asked: Map, block: KeyBlock, views: list[View]) -> None:
    guard = SensorGuard(asked)
    measured = guard.match(views[3])
    block.take(guard.keys())
    last = belief_from(np.exp(-np.abs(np.arange(PLACES) - 20.0)))
    (weighed,) = FewPlaces(asked, [block]).weighed(measured, last)
    before = measured[0].log_ratio
    assert before is not None
    assert weighed.log_ratio is not None
    changed = np.flatnonzero(weighed.log_ratio != before)
    assert {3, 15} <= set(changed.tolist())
    assert len(changed) <= 6
    assert weighed.log_ratio[3] - before[3] > 1 > weighed.log_ratio[15] - before[15]  # a poster or two hang alike
    assert weighed.likelihood == pytest.approx(np.exp(weighed.log_ratio) / np.exp(weighed.log_ratio).sum())
    assert weighed.timings.matching > measured[0].timings.matching


def test_too_few_matches_tell_nothing(asked: Map, block: KeyBlock) -> None:
    take(block, asked, View(0.0, images={"camera": np.full((240, 480), 128, np.uint8)}))
    assert not block.sees
    keys = asked.keys(3)["camera"]
    block.take({"camera": PictureKeys(keys.points[: FEWEST - 1], keys.descriptors[: FEWEST - 1])})
    assert block.sees
    assert block.log_ratios(np.arange(PLACES)).tolist() == [0.0] * PLACES


def test_a_camera_that_is_not_there_is_not_asked(asked: Map, block: KeyBlock) -> None:
    block.take({"other": asked.keys(3)["camera"]})
    assert block.log_ratios(np.arange(PLACES)).tolist() == [0.0] * PLACES


def test_the_score_is_a_share_of_the_matches() -> None:
    assert score(KeyFit(12, 10)) == 10 / (12 + PRIOR)
    assert together({}) == KeyFit()
    one = together({"left": KeyFit(10, 6, 1.2), "right": KeyFit(20, 2, 0.9)})
    assert (one.matches, one.inliers) == (30, 8)
    assert one.scale == pytest.approx((1.2**6 * 0.9**2) ** (1 / 8))


counts = st.integers(0, 60).flatmap(lambda m: st.tuples(st.just(m), st.integers(0, m)))


@quick
@given(st.lists(counts, min_size=2, max_size=12))
def test_a_pair_that_is_like_those_elsewhere_averages_no_more_than_one(pairs: list[tuple[int, int]]) -> None:
    """By enumeration: of any drawn fits, each is read in turn by all others, as a view elsewhere would be."""
    scores = np.array([score(KeyFit(*pair)) for pair in pairs if pair[0] >= FEWEST])
    ratios = [np.exp(Calibration(np.delete(scores, k)).log_ratios(scores[k : k + 1]))[0] for k in range(len(scores))]
    silent = [1.0] * (len(pairs) - len(scores))
    assert np.mean([*ratios, *silent]) <= 1 + 1e-9


fits = st.lists(
    st.tuples(st.integers(0, 30), st.floats(0, 5), st.floats(-1, 1)), min_size=1, max_size=10, unique_by=lambda t: t[0]
)


@quick
@given(fits)
def test_neighbours_share_the_best_fit_and_the_nearest_has_it_whole(told: list[tuple[int, float, float]]) -> None:
    places, ratios, zoom = (np.array(column) for column in zip(*told, strict=True))
    beside = np.abs(places[:, None] - places) <= 2
    after = shared(beside, ratios.astype(float), zoom.astype(float))
    for place, ratio in enumerate(after):
        near = np.flatnonzero(beside[place])
        best = ratios[near].max()
        assert 0 <= ratio <= best
        assert ratio >= best - FARTHEST
        if abs(zoom[place]) <= np.abs(zoom[near]).min():
            assert ratio == best


def test_a_place_whose_keys_do_not_fit_counts_less_than_its_neighbours() -> None:
    beside = np.ones((3, 3), bool)
    np.testing.assert_allclose(shared(beside, np.array([0.0, 3.0, 0.0]), np.array([np.inf, 0.0, 0.1])), [1, 3, 2.5])
    alone = np.eye(3, dtype=bool)
    np.testing.assert_allclose(shared(alone, np.array([0.0, 3.0, 0.0]), np.array([np.inf, 0.5, 0.1])), [0, 3, 0])


def test_places_of_two_sequences_are_not_beside_each_other() -> None:
    """The last place of one path and the first of the next follow each other by number alone."""
    halves = {"a": drive(range(12)), "b": drive(range(12, PLACES))}
    map_ = merge_maps([learn(half, profile=ASKED, features=["sift"]).named(name) for name, half in halves.items()]).map
    assert map_.first.tolist() == [0, 12, 24]
    beside = few_places.beside(map_, np.array([9, 10, 11, 12, 14, 15]))
    one, other = np.ones((3, 3)), np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]])
    np.testing.assert_array_equal(beside, np.block([[one, np.zeros((3, 3))], [np.zeros((3, 3)), other]]))


@pytest.fixture(scope="module")
def merged(asked: Map) -> Map:
    """The map as a long path, whose views 8 to 11 are at the four places of a short one."""
    short = learn(drive(range(8, 12)), profile=ASKED, features=["sift"])
    joined = Decision("short", "long", (0, 3), (8, 11), (0.0, 0.0), joined=True, why="by a person")
    map_ = merge_maps([short.named("short"), asked.named("long")], wishes=[joined]).map
    assert map_.first.tolist() == [0, 4, 24]
    return map_


def test_keys_of_views_whose_places_were_given_away_are_not_kept(asked: Map, merged: Map) -> None:
    long = merged.paths[1]
    assert np.flatnonzero(long.keys["camera"].counts == 0).tolist() == [8, 9, 10, 11]
    for view in (*range(8), *range(12, PLACES)):
        place = int(merged.numbered(long)[view])
        before, now = asked.keys(view)["camera"], merged.keys(place)["camera"]
        np.testing.assert_array_equal(now.points, before.points)
        np.testing.assert_array_equal(now.descriptors, before.descriptors)
    assert Map.from_bytes(merged.to_bytes()) == merged


def test_places_on_both_sides_of_a_stretch_that_was_given_away_are_not_beside_each_other(merged: Map) -> None:
    beside = few_places.beside(merged, np.array([10, 11, 12, 13]))  # views 6, 7, 12 and 13 of the long one
    two = np.ones((2, 2))
    np.testing.assert_array_equal(beside, np.block([[two, 0 * two], [0 * two, two]]))


def test_what_does_not_fit_speaks_against_no_place(asked: Map, block: KeyBlock, views: list[View]) -> None:
    """Noise instead of a picture has hundreds of keys that match and do not fit, at each place."""
    noise = np.random.default_rng(5).integers(0, 255, (240, 480)).astype(np.uint8)
    take(block, asked, replace(views[3], images={"camera": noise}))
    fits = [together(laid(asked.keys(place), block._view)) for place in range(PLACES)]
    assert max(fit.matches for fit in fits) > 5 * FEWEST
    assert (block.log_ratios(np.arange(PLACES)) >= 0).all()
    assert np.median(block.log_ratios(np.arange(PLACES))) == 0


def test_what_does_not_fit_is_less_than_is_usual(asked: Map, block: KeyBlock, views: list[View]) -> None:
    """It speaks against no place by itself; to views of the drive whose keys did fit it is compared as it is."""
    noise = np.random.default_rng(5).integers(0, 255, (240, 480)).astype(np.uint8)
    places = np.arange(PLACES)
    take(block, asked, replace(views[3], images={"camera": noise}))
    (of_noise,) = block.brought(places).values()
    take(block, asked, views[3])
    ((key, fits),) = block.brought(places).items()
    assert key == "keys/camera"
    assert of_noise[3] < 0 < fits[3]
    assert fits[3] == fits[1:6].max() == block.log_ratios(places)[3]  # neighbours share the best


def test_places_elsewhere_average_little_more_than_one_on_another_drive(
    asked: Map, block: KeyBlock, views: list[View]
) -> None:
    """At all places 4 m away and more, their look-alikes among them, in pictures that are darker."""
    ratios = []
    for number, view in list(enumerate(views))[::2]:
        darker = {"camera": (view.images["camera"] * 0.4).astype(np.uint8)}
        take(block, asked, replace(view, images=darker))
        far = np.flatnonzero(np.abs(np.arange(PLACES) - number) > 5)
        ratios += np.exp(block.log_ratios(far)).tolist()
    assert len(ratios) > 100
    assert np.mean(ratios) <= 1.3


def test_without_the_option_nothing_is_kept_and_no_belief_changes(views: list[View]) -> None:
    plain = learn(drive(range(PLACES)), profile=PLAIN, features=["sift"])
    assert not plain.paths[0].keys
    assert not KeyBlock(plain).most
    with_keys = learn(drive(range(PLACES)), profile=ASKED, features=["sift"])
    unasked = replace(plain, paths=(replace(plain.paths[0], keys=with_keys.paths[0].keys),))
    ours, theirs = localise(plain, views[:6]), localise(unasked, views[:6])
    guard = SensorGuard(plain)
    measured = guard.match(views[0])
    assert FewPlaces(plain, [KeyBlock(plain)]).weighed(measured, None)[0] is measured[0]
    for stage in Stage:
        for one, other in zip(ours[stage], theirs[stage], strict=True):
            assert one.places.tobytes() == other.places.tobytes()
            assert one.lost == other.lost


def test_ways_of_localising_agree(asked: Map, views: list[View]) -> None:
    told = localise(asked, views[:3])
    alone = Localiser(asked)
    for view, belief in zip(views[:3], told[Stage.CHAIN], strict=True):
        assert alone.update(view).places.tobytes() == belief.places.tobytes()
    alone.reset()
    assert alone.update(views[0]).places.tobytes() == told[Stage.CHAIN][0].places.tobytes()
    assert [one.best for one in smoothed(asked, views[:3])] == [0, 1, 2]


def test_maps_of_before_do_not_ask() -> None:
    content = BEST.to_dict()
    del content["log_ratio"]["geometry"]
    assert Profile.from_dict(content) == profile_named(PLAIN)


def test_maps_with_a_setting_that_is_no_more_are_read() -> None:
    content = BEST.to_dict()
    content["log_ratio"]["geometry_alone"] = 0
    assert Profile.from_dict(content) == BEST


def test_a_view_is_laid_by_the_cameras_that_both_have() -> None:
    keys = PictureKeys(np.zeros((1, 2), np.float32), np.zeros((1, 128), np.uint8))
    place: Mapping[str, PictureKeys] = {"left": keys, "right": keys}
    assert laid(place, {"right": keys, "up": keys}) == {"right": KeyFit(matches=1)}


def test_keys_are_laid_on_a_place_once_a_view_however_many_stages_ask(
    asked: Map, views: list[View], monkeypatch: pytest.MonkeyPatch
) -> None:
    block = KeyBlock(asked)
    take(block, asked, views[3])
    block.log_ratios(np.array([0]))  # scores of places elsewhere are asked for once
    places: list[Mapping[str, PictureKeys]] = []

    def counted(place: Mapping[str, PictureKeys], view: Mapping[str, PictureKeys]) -> dict[str, KeyFit]:
        places.append(place)
        return laid(place, view)

    monkeypatch.setattr(key_block, "laid", counted)
    told = block.log_ratios(np.array([2, 3, 4]))
    assert block.log_ratios(np.array([3]))[0] == pytest.approx(told[1])
    assert len(places) == 3
    take(block, asked, views[4])
    block.log_ratios(np.array([3]))
    assert len(places) == 4
