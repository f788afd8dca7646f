"""FAB-MAP against enumeration: of all things that may exist, of all views, of all states."""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from refseq.errors import MapError
from refseq.features.sift import SiftSettings
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.chow_liu import ROOT, ChowLiuTree
from refseq_bench.scenarios.methods.baselines.fabmap import FabMap, FabMapSettings
from refseq_bench.scenarios.methods.baselines.fabmap_places import CERTAIN, Detector, PlaceModel
from refseq_bench.scenarios.methods.baselines.fabmap_words import Bags, ShownWords, WordMap
from tests.support import CAMERAS, corridor_drive

WORDS, PLACES = 4, 3
DETECTORS = (Detector(), Detector(0.39, 0.0), Detector(0.8, 0.1))


def bags(seen: np.ndarray, has: np.ndarray | None = None) -> Bags:
    return Bags(csr_array(seen.astype(float)), np.ones(len(seen), np.bool_) if has is None else has)


def some(seed: int, views: int = PLACES, words: int = WORDS) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.random((views, words)) < rng.uniform(0.1, 0.9, words)


def model_of(seed: int, *, tree: bool, detector: Detector) -> tuple[PlaceModel, np.ndarray, ChowLiuTree]:
    """A model whose places and whose tree are of different drives, so that neither follows from the other."""
    seen, trained = some(seed), csr_array(some(seed + 1, views=12).astype(float))
    learnt = ChowLiuTree.learn(trained) if tree else ChowLiuTree.independent(trained)
    return PlaceModel(bags(seen), learnt, detector), seen, learnt


def shows(z: int, e: int, detector: Detector) -> float:
    rate = detector.detection if e else detector.false_alarm
    return rate if z else 1 - rate


def dependent(q: int, z: tuple[int, ...], e: int, tree: ChowLiuTree, detector: Detector) -> float:
    """P(z_q | e_q, z_p) as a ratio of odds, the form in which the paper gives it."""
    p = tree.parents[q]
    given = tree.marginal[q] if p == ROOT else tree.given[z[p], q]
    likely, unlikely = (given, 1 - given) if z[q] else (1 - given, given)
    often = tree.marginal[q] if z[q] else 1 - tree.marginal[q]
    alpha = often * shows(1 - z[q], e, detector) * unlikely
    beta = (1 - often) * shows(z[q], e, detector) * likely
    return beta / (alpha + beta)


def existence(shown: bool | None, marginal: float, detector: Detector) -> float:
    """P(e = 1) at a place whose view showed the word, did not, or that was never seen."""
    prior = (marginal - detector.false_alarm) / (detector.detection - detector.false_alarm)
    prior = min(max(prior, CERTAIN), 1 - CERTAIN)
    if shown is None:
        return prior
    there = prior * shows(int(shown), 1, detector)
    return there / (there + (1 - prior) * shows(int(shown), 0, detector))


@given(st.integers(0, 10_000), st.booleans(), st.sampled_from(DETECTORS))
def test_likelihoods_are_sums_over_all_that_may_exist(seed: int, tree: bool, detector: Detector) -> None:
    model, seen, learnt = model_of(seed, tree=tree, detector=detector)
    z = tuple(int(shown) for shown in some(seed + 2, 1)[0])
    expected = []
    for place in (*seen, [None] * WORDS):
        exists = [existence(shown, learnt.marginal[q], detector) for q, shown in enumerate(place)]
        total = 0.0
        for things in itertools.product((0, 1), repeat=WORDS):
            total += math.prod(
                dependent(q, z, e, learnt, detector) * (exists[q] if e else 1 - exists[q]) for q, e in enumerate(things)
            )
        expected.append(math.log(total))
    assert model.log_likelihood(np.array(z, np.bool_)) == pytest.approx(expected)


@given(st.integers(0, 10_000), st.booleans(), st.sampled_from(DETECTORS))
def test_all_views_that_a_place_may_show_have_probability_one(seed: int, tree: bool, detector: Detector) -> None:
    model, _, _ = model_of(seed, tree=tree, detector=detector)
    views = itertools.product((False, True), repeat=WORDS)
    total = sum(np.exp(model.log_likelihood(np.array(z))) for z in views)
    assert total == pytest.approx(np.ones(PLACES + 1))


def test_a_new_place_shows_words_as_often_as_the_drive_did() -> None:
    detector = Detector(0.9, 0.0)
    rates = np.array([0.1, 0.3, 0.6, 0.8])
    tree = ChowLiuTree(np.full(WORDS, ROOT), rates, np.tile(rates, (2, 1)))
    model = PlaceModel(bags(some(0)), tree, detector)
    for z in itertools.product((False, True), repeat=WORDS):
        expected = sum(math.log(r if shown else 1 - r) for r, shown in zip(rates, z, strict=True))
        assert model.log_likelihood(np.array(z))[-1] == pytest.approx(expected)


def test_a_view_without_words_is_of_a_place_that_showed_few() -> None:
    seen = np.zeros((6, 30), np.bool_)
    for k in range(6):
        seen[k, : 6 * k] = True
    for learn in (ChowLiuTree.independent, ChowLiuTree.learn):
        found = PlaceModel(bags(seen), learn(csr_array(seen.astype(float))), Detector()).log_likelihood(
            np.zeros(30, np.bool_)
        )
        assert np.isfinite(found).all()
        assert (np.diff(found[:-1]) < 0).all()


def test_a_place_that_lacked_the_camera_is_like_a_new_one() -> None:
    seen, has = some(3), np.array([True, False, True])
    seen[1] = False
    tree = ChowLiuTree.learn(csr_array(some(4, 12).astype(float)))
    found = PlaceModel(bags(seen, has), tree, Detector()).log_likelihood(np.array([True, False, True, True]))
    whole = PlaceModel(bags(seen), tree, Detector()).log_likelihood(np.array([True, False, True, True]))
    assert found[1] == found[-1] == whole[-1]
    assert found[[0, 2]].tolist() == whole[[0, 2]].tolist()


def test_rates_that_tell_nothing_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"^detection 0\.1, false_alarm 0\.2; valid is 0 <= false_alarm < detection < 1$"
    ):
        Detector(0.1, 0.2)


# --- words ---


@given(st.integers(0, 10_000), st.integers(1, 8))
def test_the_first_sighting_of_a_word_does_not_count(seed: int, places: int) -> None:
    rng = np.random.default_rng(seed)
    has = rng.random(places) < 0.7
    seen = (rng.random((places, 6)) < 0.4) & has[:, None]
    expected = []
    known: set[int] = set()
    for k in np.flatnonzero(has):
        shown = set(np.flatnonzero(seen[k]).tolist())
        expected.append([float(q in shown & known) for q in range(6)])
        known |= shown
    found = bags(seen, has).recognised
    assert found.shape == (len(expected), 6)
    assert found.toarray().tolist() == expected


def test_places_show_the_words_that_their_views_show() -> None:
    drive = corridor_drive(np.random.default_rng(0), 5, spacing=1.0, size=96)
    drive[2] = replace(drive[2], images={CAMERAS[0]: drive[2].images[CAMERAS[0]]})
    words = WordMap(drive, SiftSettings(alias_distance=1.0))  # no two keys are the same word
    assert words.bags[CAMERAS[1]].has.tolist() == [True, True, False, True, True]
    for k, view in enumerate(drive):
        glance = words.observe(view)
        assert set(glance.shown) == set(view.images)
        for camera, shown in glance.shown.items():
            assert shown.sum() > 0
            assert words.bags[camera].seen.toarray()[k].tolist() == shown.astype(float).tolist()


def test_a_drive_without_words_is_refused() -> None:
    blank = View(1.0, images={"c": np.full((48, 64), 90, np.uint8)})
    with pytest.raises(MapError, match=r"^2 views show no word; valid is a drive with images$"):
        WordMap([View(0.0), blank])


# --- the filter ---


class Shown:
    """Stands for ``WordMap``: a view's number says which row of each camera's table it shows; below 0, no camera."""

    def __init__(self, seen: Mapping[str, np.ndarray], queries: Mapping[str, np.ndarray]) -> None:
        self.bags = {camera: bags(table) for camera, table in seen.items()}
        self._queries = queries

    def __len__(self) -> int:
        return len(next(iter(self.bags.values())).has)

    def observe(self, view: View) -> ShownWords:
        if view.time < 0:
            return ShownWords({}, 0.0, 0.0)
        return ShownWords({camera: table[int(view.time)] for camera, table in self._queries.items()}, 0.0, 0.0)


def path(count: int) -> list[View]:
    return [View(float(k)) for k in range(count)]


def transition(places: int, new: float) -> np.ndarray:
    """P(state | last state), the new place last, written out edge by edge."""
    T = np.zeros((places + 1, places + 1))
    for j in range(places):
        for k in (j - 1, j, j + 1):
            T[j, k if 0 <= k < places else places] += (1 - new) / 3
    T[places, :places] = (1 - new) / places
    T[:, places] += new
    assert T.sum(axis=1) == pytest.approx(np.ones(places + 1))
    return T


@given(st.integers(0, 10_000), st.integers(1, 6), st.booleans(), st.floats(0.05, 0.95))
def test_the_filter_is_the_forward_recursion(seed: int, places: int, tree: bool, new: float) -> None:
    settings = FabMapSettings(new=new, smoothing=0.9)
    seen = {camera: some(seed + n, places) for n, camera in enumerate(CAMERAS)}
    queries = {camera: some(seed + 5 + n, 4) for n, camera in enumerate(CAMERAS)}
    localiser = FabMap(Shown(seen, queries), tree=tree, settings=settings)
    learn: Callable[[csr_array], ChowLiuTree] = ChowLiuTree.learn if tree else ChowLiuTree.independent
    models = {c: PlaceModel(bags(s), learn(bags(s).recognised), settings.detector) for c, s in seen.items()}
    state = np.append(np.full(places, (1 - new) / places), new)
    for number, view in enumerate(path(4)):
        if number:
            state = state @ transition(places, new)
        likelihood = math.prod(np.exp(models[c].log_likelihood(queries[c][number])) for c in CAMERAS)
        state = state * (0.9 * likelihood / likelihood.sum() + 0.1 / (places + 1))
        state /= state.sum()
        found = localiser.update(view)
        assert found.lost == pytest.approx(state[-1])
        assert found.places == pytest.approx(state[:-1] / state[:-1].sum())
        assert found.best == np.argmax(found.places)


@pytest.mark.parametrize("tree", [False, True])
def test_places_are_found_and_other_places_are_new(tree: bool) -> None:
    """Words are shared by neighbours, and half of a place's are seen again; elsewhere words come at random."""
    rng = np.random.default_rng(0)
    places, words = 20, 400
    seen = np.zeros((places, words), np.bool_)
    for k in range(places):
        seen[k, 20 * k : 20 * k + 30] = True
    again = seen & (rng.random(seen.shape) < 0.5)
    elsewhere = rng.random((6, words)) < 0.04
    localiser = FabMap(Shown({"c": seen}, {"c": np.concatenate([again, elsewhere])}), tree=tree)
    found = [localiser.update(view) for view in path(places + 6)]
    assert [belief.best for belief in found[:places]] == list(range(places))
    on, off = ([belief.lost for belief in part] for part in (found[:places], found[places:]))
    assert np.median(on) < 0.1
    assert np.median(off) > 0.9


def test_a_view_without_a_camera_leaves_the_prior() -> None:
    localiser = FabMap(Shown({"c": np.eye(9, dtype=np.bool_)}, {"c": np.eye(9, dtype=np.bool_)}))
    before = localiser.update(path(5)[4])
    after = localiser.update(View(-1.0))
    state = np.append(before.places * (1 - before.lost), before.lost) @ transition(9, 0.9)
    assert after.lost == pytest.approx(state[-1])
    assert after.places == pytest.approx(state[:-1] / state[:-1].sum())
