"""Localising in an atlas: P(s), and where in it; against a single sequence, synthetic walks, and by definition."""

from itertools import product

import numpy as np
import pytest

from refseq.atlas.merge import merge_maps
from refseq.belief import LOST, Stage, Timings
from refseq.inference.chain.chain import Chain, ChainSettings, Observation
from refseq.inference.chain.motion import MotionSettings
from refseq.map.localiser import Localiser
from refseq.map.map import Map, beside
from refseq.map.matcher import Matcher, Measurement
from refseq.map.measurer import Measurer
from refseq.map.profile import BEST, THESIS, Profile, profile_named
from refseq.map.tracking.hindsight import Hindsight
from refseq.map.tracking.trackers import NetworkTracker, SurestSequence, sureness_of_path
from tests.refseq.rooms import named_maps
from tests.refseq.walks import Leg, Town, apart

TOWN = Town()
ALIKE = profile_named("best+log_ratio.usual=0")
"""Trackers alone and hindsight do not ask what is usual on a drive."""
PROFILES = [pytest.param(ALIKE, id="best"), pytest.param(THESIS, id="thesis")]
A, B = [("A", 0, 30), ("B", 0, 30)], [("C", 0, 25), ("B", 0, 30), ("D", 0, 20)]


@pytest.mark.quick_cases("thesis-prior", "best-chain")
@pytest.mark.parametrize("stage", list(Stage))
@pytest.mark.parametrize("profile", PROFILES)
def test_of_one_path_the_trackers_of_several_answer_as_its_sequence(profile: Profile, stage: Stage) -> None:
    only = Map.of(TOWN.learnt(A, profile=profile))
    networked = profile is ALIKE and stage is Stage.CHAIN
    localiser, matcher = Localiser(only, stage=stage), Matcher(only)
    tracker = NetworkTracker(only) if networked else SurestSequence(stage, only)
    for view in TOWN.views([("A", 5, 30), ("E", 0, 10), ("B", 10, 20)], 7):
        one, other = localiser.update(view), tracker.update(matcher.match(view))
        np.testing.assert_allclose(other.places, one.places, atol=1e-12)
        assert other.lost == pytest.approx(one.lost, abs=1e-9)
        assert other.best == one.best


def test_of_several_sequences_the_path_is_that_of_the_one_the_robot_is_in() -> None:
    walks = [TOWN.learnt([("A", 0, 40)], 1, THESIS), TOWN.learnt([("C", 0, 40)], 2, THESIS)]
    atlas = beside(named_maps(["a", "c"], walks))
    localiser, there = Localiser(atlas), Localiser(Map.of(walks[1]))
    for view in TOWN.views([("C", 5, 15), ("E", 0, 10)], 8):
        belief, own = localiser.update(view), there.update(view).path
        if belief.best >= len(walks[0]):
            assert belief.path == tuple(k if k == LOST else k + len(walks[0]) for k in own)
    assert len(own) == THESIS.chain.window


@pytest.mark.parametrize("profile", PROFILES)
def test_hindsight_tells_the_same_when_it_is_asked_again(profile: Profile) -> None:
    only = Map.of(TOWN.learnt(A, 1, profile))
    hindsight, measurer = Hindsight(only), Measurer(only)
    for view in TOWN.views([("A", 5, 20)], 8):
        measurer.take(view)
        hindsight.take(measurer.after(None))
    assert hindsight.beliefs() == hindsight.beliefs()


@pytest.mark.quick_cases("thesis-uniform", "best-chain")
@pytest.mark.parametrize("stage", list(Stage))
@pytest.mark.parametrize("profile", PROFILES)
def test_a_reset_localiser_begins_anew(profile: Profile, stage: Stage) -> None:
    walks = [TOWN.learnt(A, 1, profile), TOWN.learnt([("C", 0, 30)], 2, profile)]
    localiser, query = Localiser(beside(named_maps(["a", "c"], walks)), stage=stage), TOWN.views([("C", 5, 15)], 8)
    first = [localiser.update(view) for view in query]
    localiser.reset()
    for one, view in zip(first, query, strict=True):
        again = localiser.update(view)
        assert again.places.tobytes() == one.places.tobytes()
        assert again.lost == one.lost


@pytest.mark.quick_cases("profile1-AC-0.85")
@pytest.mark.parametrize(
    ("profile", "names", "least"), [(BEST, "AC", 0.99), (THESIS, "AC", 0.85), (THESIS, "ABCDEF", 0.6)]
)
def test_the_sequence_that_the_robot_is_in_is_the_most_probable(profile: Profile, names: str, least: float) -> None:
    """By Bayes' rule P(s) is sure; by the entropy of trajectories (4.7) it is far above an even share."""
    walks = [TOWN.learnt([(name, 0, 40)], n, profile) for n, name in enumerate(names)]
    atlas, right = beside(named_maps(list(names.lower()), walks)), names.index("C")
    localiser = Localiser(atlas)
    shares = [atlas.sequence_probabilities(localiser.update(view)) for view in TOWN.views([("C", 5, 35)], 9)]
    assert all(share.sum() == pytest.approx(1.0) for share in shares)
    assert np.mean([share[right] for share in shares[3:]]) > least


def test_merged_paths_are_followed_over_the_links_in_both_directions_of_a_fork() -> None:
    walks = [TOWN.learnt(A, 1, BEST), TOWN.learnt(B, 2, BEST)]
    atlas = merge_maps(named_maps(["a", "b"], walks)).map
    ways: list[list[Leg]] = [
        [*A],
        [("C", 5, 25), ("B", 0, 30), ("D", 0, 15)],
        [("A", 10, 30), ("B", 0, 30), ("D", 0, 15)],
    ]
    for way in ways:
        localiser, right = Localiser(atlas), []
        for view in TOWN.views(way, 11):
            belief = localiser.update(view)
            right.append(belief.lost < 0.5 and apart(atlas.poses[belief.best], view.truth) <= 1.5)
        assert np.mean(right) > 0.9


def test_what_is_like_no_place_is_lost_in_all_sequences() -> None:
    atlas = beside(named_maps(["a", "b"], [TOWN.learnt(A, 1, BEST), TOWN.learnt(B, 2, BEST)]))
    tracker = NetworkTracker(atlas)
    for view in range(20):
        known = [np.where(np.arange(len(s)) == view + 3, 5.0, -1.5) for s in atlas.sequences]
        unlike = [np.full(len(s), -1.5) for s in atlas.sequences]
        pairs = zip(unlike if view >= 10 else [known[0], unlike[1]], atlas.sequences, strict=True)
        belief = tracker.update([Measurement(np.ones(len(s)) / len(s), 1.0, Timings(), e) for e, s in pairs])
        if view in (2, 9):
            assert atlas.sequence_probabilities(belief)[0] > 0.99
            assert belief.lost < 0.01
    assert belief.lost > 0.95
    assert belief.last_sure == 12


@pytest.mark.parametrize(("K", "T"), [(30, 1), (30, 5), (200, 5), (4, 8), (1, 3)])
def test_a_path_that_is_sure_has_all_of_sureness_and_one_that_knows_nothing_has_none(K: int, T: int) -> None:
    chain = Chain(np.arange(float(K)), MotionSettings(), ChainSettings())
    at = [min(t + K // 8, K - 1) for t in range(T)]
    sure = [Observation(1.0, np.where(np.arange(K) == place, 0.0, -50.0), -50.0) for place in at]
    unsure = [Observation(1.0, np.full(K, -3.0), -3.0) for _ in range(T)]
    assert sureness_of_path(sure, chain) > 0.99
    assert sureness_of_path(unsure, chain) == pytest.approx(0.0, abs=1e-9)


def test_sureness_by_brute_force() -> None:
    """Every trajectory of three views over three places, one by one, before and after they are seen."""
    chain, rng = Chain(np.arange(3.0), MotionSettings(), ChainSettings()), np.random.default_rng(3)
    seen = [Observation(0.9, rng.normal(size=3), 0.2) for _ in range(3)]
    unseen = [Observation(0.9, np.zeros(3), 0.0) for _ in range(3)]
    left, most = entropy_by_hand(seen, chain), entropy_by_hand(unseen, chain)
    assert sureness_of_path(seen, chain) == pytest.approx(1 - left / most)


def entropy_by_hand(window: list[Observation], chain: Chain) -> float:
    """Entropy [nats] of all sequences of states, each multiplied out."""
    moves = np.array([chain.transitions(0.9).predict(state.reshape(2, 3)).ravel() for state in np.eye(6)])
    start = np.exp(chain.start()).ravel()
    weights = [np.exp(np.append(one.places, [one.lost] * 3)) for one in window]
    p = np.array(
        [
            start[a] * weights[0][a] * moves[a, b] * weights[1][b] * moves[b, c] * weights[2][c]
            for a, b, c in product(range(6), repeat=3)
        ]
    )
    p = p[p > 0] / p.sum()
    return float(-(p * np.log(p)).sum())
