"""The filters, on a path whose places look as different as we like."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from refseq.planar import Pose, after_motion
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.single import SingleBest
from refseq_bench.scenarios.methods.baselines.topological import TopologicalFilter, TopologicalSettings
from refseq_bench.scenarios.methods.baselines.topometric import Steps, TopometricFilter, TopometricSettings
from tests.scenarios.methods.baselines.looks import Looks

PLACES = 12


def path(count: int = PLACES, spacing: float = 1.0) -> list[View]:
    return [View(float(k), distance=spacing if k else 0.0) for k in range(count)]


def looks(contrast: float = 0.5, count: int = PLACES) -> np.ndarray:
    """Cosines of a path with itself: only the very place looks alike."""
    return np.where(np.eye(count, dtype=bool), 0.9, 0.9 - contrast)


def beliefs(localiser, views):
    return [localiser.update(view) for view in views]


# --- one by one ---


def test_a_single_view_is_the_place_that_looks_most_alike_and_never_lost() -> None:
    found = beliefs(SingleBest(Looks(looks())), path()[::-1])
    assert [belief.best for belief in found] == list(range(PLACES))[::-1]
    assert found[0].lost == pytest.approx(0.05)
    assert all(belief.lost <= 0.5 for belief in beliefs(SingleBest(Looks(-looks())), path()))


@given(st.integers(0, 50), st.integers(-3, 0), st.integers(0, 4))
def test_the_topological_filter_is_bayes_rule_over_its_window(seed: int, least: int, most: int) -> None:
    table = np.random.default_rng(seed).uniform(-0.2, 0.9, (6, PLACES))
    settings = TopologicalSettings(least=least, most=most)
    found = beliefs(TopologicalFilter(Looks(table), settings), path(6))
    transition = np.zeros((PLACES, PLACES))
    for j in range(PLACES):
        reached = [k for k in range(j + least, j + most + 1) if 0 <= k < PLACES]
        transition[j, reached] = 1 / len(reached)
    expected, spreads = np.full(PLACES, 1 / PLACES), []
    for number, belief in enumerate(found):
        distances = np.sqrt(2 - 2 * table[number])
        spreads.append(np.quantile(distances, 0.975) - np.quantile(distances, 0.025))
        if number:
            expected = expected @ transition
        expected = expected * settings.contrast ** (-distances / np.mean(spreads))
        expected /= expected.sum()
        assert belief.places == pytest.approx(expected, abs=1e-9)
        near = expected[max(0, belief.best - 6) : belief.best + 7].sum()
        assert belief.lost == pytest.approx((1 - near) / 2, abs=1e-9)


# --- steps ---


def straight(**settings: float) -> Steps:
    return Steps(path(), replace(TopometricSettings(), **settings))


@given(st.floats(-3, 6), st.floats(-0.5, 0.5))
def test_all_that_may_happen_has_probability_one(distance: float, turn: float) -> None:
    targets, onward, off = straight().probabilities(distance, turn)
    assert targets.min() >= 0
    assert targets.max() < PLACES
    assert onward.sum(axis=1) + off == pytest.approx(np.ones(PLACES))
    assert (onward >= 0).all()


def test_a_motion_that_leads_to_a_place_leads_there() -> None:
    targets, onward, off = straight().probabilities(2.0, 0.0)
    for j in range(PLACES - 2):
        assert targets[j, np.argmax(onward[j])] == j + 2
        assert off[j] == TopometricSettings().off_least


def test_going_back_and_standing_still_are_possible() -> None:
    for distance, step in ((-1.0, -1), (0.0, 0)):
        targets, onward, _ = straight().probabilities(distance, 0.0)
        assert all(targets[j, np.argmax(onward[j])] == j + step for j in range(1, PLACES - 1))


def test_turning_off_a_straight_path_is_leaving_it() -> None:
    _, _, straight_on = straight().probabilities(1.0, 0.0)
    _, _, turned = straight().probabilities(1.0, math.pi / 2)
    assert straight_on[:-1].max() < 0.05
    assert straight_on[-1] > 0.9  # the last place's way on leads off the map
    assert turned.min() > 0.9


def test_a_bend_of_the_path_is_followed() -> None:
    views = [View(float(k), distance=1.0 if k else 0.0, turn=math.pi / 2 if k == 5 else 0.0) for k in range(10)]
    steps = Steps(views, TopometricSettings())
    targets, onward, off = steps.probabilities(1.0, math.pi / 2)
    assert targets[4, np.argmax(onward[4])] == 5
    assert off[4] < 0.05
    assert off[[1, 2, 7]].min() > 0.9


def test_leaving_has_the_chance_of_a_smaller_error() -> None:
    """The distribution of the distance of three normal variables from the origin (Maxwell), integrated by hand."""
    settings = TopometricSettings(slack=0.5, drift=0.0, reach=9.0, turn_slack=1.0)
    turn = 1.2
    end = after_motion(Pose(0.0, 0.0, 0.0), 0.0, turn)
    _, _, off = Steps(path(), settings).probabilities(0.0, turn)
    radius = abs(end.heading) / settings.turn_slack
    below, _ = quad(lambda r: math.sqrt(2 / math.pi) * r * r * math.exp(-r * r / 2), 0, radius)
    assert off[5] == pytest.approx(below, rel=1e-6)


@given(st.floats(0, 2.5), st.floats(-0.4, 0.4), st.integers(0, 30))
def test_the_nearest_point_of_a_stretch_is_found(distance: float, turn: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    views = [View(float(k), distance=1.0 if k else 0.0, turn=float(rng.normal(0, 0.1))) for k in range(6)]
    settings = TopometricSettings(reach=50.0, off_least=0.0)
    targets, onward, off = Steps(views, settings).probabilities(distance, turn)
    poses = [Pose(0.0, 0.0, 0.0)]
    for view in views[1:]:
        poses.append(after_motion(poses[-1], view.distance, view.turn))
    table = np.array([(p.x, p.y, p.heading) for p in poses])
    end = after_motion(poses[2], distance, turn)
    sigma = settings.slack + settings.drift * distance
    scale = np.array([sigma, sigma, settings.turn_slack])
    turned = np.array([[math.cos(poses[2].heading), math.sin(poses[2].heading)]])
    across = np.array([[-math.sin(poses[2].heading), math.cos(poses[2].heading)]])
    squared = {}
    for k in range(1, 6):  # from place 2, one step back is as far as the window goes
        before, behind = table[k] - table[k - 1], (table[k + 1] - table[k] if k < 5 else table[k] - table[k - 1])
        shares = np.linspace(0, 0.5, 10001)[:, None]
        samples = np.concatenate([table[k] - shares * before, table[k] + shares * behind])
        miss = np.array([end.x, end.y, end.heading]) - samples
        local = np.stack([miss[:, :2] @ turned[0], miss[:, :2] @ across[0], miss[:, 2]], axis=1) / scale
        squared[k] = float((local**2).sum(axis=1).min())
    weights = {k: math.exp(-value / 2) for k, value in squared.items()}
    for k, probability in zip(targets[2], onward[2], strict=True):
        if probability > 1e-9:
            expected = weights[int(k)] / sum(weights.values()) * (1 - off[2])
            assert probability == pytest.approx(expected, rel=1e-3, abs=1e-9)


# --- the topometric filter ---


def brute_force(table: np.ndarray, views: list[View], settings: TopometricSettings) -> list[np.ndarray]:
    """The forward recursion with its whole (K + 1, K + 1) transition matrix."""
    K, steps = table.shape[1], Steps(views, settings)
    belief, spreads, found = np.append(np.full(K, (1 - settings.off_first) / K), settings.off_first), [], []
    for number, view in enumerate(views):
        if number:
            targets, onward, off = steps.probabilities(view.distance, view.turn)
            transition = np.zeros((K + 1, K + 1))
            for j in range(K):
                for k, probability in zip(targets[j], onward[j], strict=True):
                    transition[j, k] += probability
            transition[:K, K] = off
            transition[K] = np.append(np.full(K, (1 - settings.off_stays) / K), settings.off_stays)
            assert transition.sum(axis=1) == pytest.approx(np.ones(K + 1))
            belief = belief @ transition
        distances = np.sqrt(2 - 2 * table[number])
        spreads.append(np.quantile(distances, 0.975) - np.quantile(distances, 0.025))
        likelihood = settings.contrast ** (-(distances - distances.min()) / np.mean(spreads))
        belief = belief * np.append(likelihood, np.quantile(likelihood, settings.off_quantile))
        belief /= belief.sum()
        found.append(belief)
    return found


@given(st.integers(0, 50), st.integers(2, 9))
def test_the_topometric_filter_is_the_forward_recursion(seed: int, places: int) -> None:
    rng = np.random.default_rng(seed)
    views = [View(float(k), distance=float(rng.normal(1, 0.3)), turn=float(rng.normal(0, 0.2))) for k in range(places)]
    table = rng.uniform(-0.2, 0.9, (places, places))
    settings = TopometricSettings()
    found = beliefs(TopometricFilter(Looks(table), views, settings), views)
    for belief, expected in zip(found, brute_force(table, views, settings), strict=True):
        assert belief.lost == pytest.approx(expected[-1], abs=1e-9)
        assert belief.places == pytest.approx(expected[:-1] / expected[:-1].sum(), abs=1e-9)


def test_a_drive_is_followed_from_anywhere() -> None:
    for start in (0, 5):
        found = beliefs(TopometricFilter(Looks(looks()), path()), path()[start:])
        assert [belief.best for belief in found] == list(range(start, PLACES))
        assert found[-1].lost < 0.01


def test_views_that_look_like_no_place_in_particular_are_off_the_map() -> None:
    rng = np.random.default_rng(0)
    table = np.concatenate([looks()[:6], rng.uniform(0.35, 0.45, (10, PLACES))])
    views = [*path()[:6], *(View(6.0 + k, distance=1.0) for k in range(10))]
    found = beliefs(TopometricFilter(Looks(table), path()), views)
    assert found[5].lost < 0.01
    assert found[-1].lost > 0.9


def test_a_view_without_images_moves_the_belief_on() -> None:
    for make in (lambda: TopometricFilter(Looks(looks()), path()), lambda: TopologicalFilter(Looks(looks()))):
        views = [*path()[:5], View(-1.0, distance=1.0)]
        found = beliefs(make(), views)
        assert found[5].best == 5
        assert found[5].places.max() < found[4].places.max()
    assert beliefs(SingleBest(Looks(looks())), [View(-1.0)])[0].places == pytest.approx(np.full(PLACES, 1 / PLACES))
