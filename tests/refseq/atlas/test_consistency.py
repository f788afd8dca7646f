"""Joins that agree, against all subsets of few joins, and against paths through a building whose truth is known."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations, pairwise, permutations

import numpy as np
import pytest
from numpy.typing import NDArray

from refseq.atlas.consistency import CandidateJoin, ConsistencySettings, JoinGraph, LaidPairs, Verdict
from refseq.pose_graph import motions_between, moved

Corners = list[tuple[float, float]]
WAYS: list[Corners] = [
    [(0, 0), (20, 0), (20, 15), (0, 15)],
    [(5, 0), (20, 0), (20, 15), (30, 15)],
    [(10, 15), (0, 15), (0, 0), (15, 0)],
]
"""Three ways through a building: the first two share two corridors round a corner, the third one with each."""


def walked(corners: Corners) -> NDArray[np.float64]:
    """True poses of a walk, (V, 3): a view a metre."""
    poses = []
    for (x, y), (to_x, to_y) in pairwise(corners):
        way, heading = np.hypot(to_x - x, to_y - y), np.arctan2(to_y - y, to_x - x)
        at = np.arange(0.0, way)
        poses.append(np.column_stack([x + at * np.cos(heading), y + at * np.sin(heading), np.full(len(at), heading)]))
    return np.concatenate(poses)


def by_odometry(truth: NDArray[np.float64], seed: int, scale: float = 1.0) -> NDArray[np.float64]:
    """A walk by its odometry, from its own origin on."""
    rng = np.random.default_rng(seed)
    steps = motions_between(truth[:-1], truth[1:]) + rng.normal(scale=(0.02, 0.01, 0.01), size=(len(truth) - 1, 3))
    steps[:, :2] *= scale
    poses = [np.zeros(3)]
    for step in steps:
        poses.append(moved(poses[-1], step))
    return np.array(poses)


def shared(one: NDArray[np.float64], other: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """The stretches that two walks truly share, as pairs of views."""
    near = np.hypot(*(one[:, None, :2] - other[None, :, :2]).transpose(2, 0, 1)) < 0.6
    near &= np.abs(np.sin((one[:, None, 2] - other[None, :, 2]) / 2)) < 0.1
    pairs = np.argwhere(near)
    breaks = np.flatnonzero((np.diff(pairs, axis=0) != 1).any(axis=1)) + 1
    return [run for run in np.split(pairs, breaks) if len(run) >= 6]


TRUTH = [walked(way) for way in WAYS]
TRACKS = [by_odometry(truth, seed) for seed, truth in enumerate(TRUTH)]
RIGHT = [
    CandidateJoin(a, b, run, evidence=2.5 * len(run))
    for a, b in combinations(range(3), 2)
    for run in shared(TRUTH[a], TRUTH[b])
]


def wrong(one: int, first: int, other: int, second: int, count: int = 8, evidence: float = 18.0) -> CandidateJoin:
    """A join of stretches that look alike."""
    pairs = np.column_stack([first + np.arange(count), second + np.arange(count)])
    return CandidateJoin(one, other, pairs, evidence=evidence, alone=False)


WRONG = [wrong(0, 2, 1, 28), wrong(0, 38, 2, 2), wrong(1, 2, 2, 12)]


def test_there_are_joins_to_find() -> None:
    assert len(RIGHT) >= 4


def test_right_joins_agree_and_wrong_ones_are_contradicted() -> None:
    verdicts = JoinGraph(TRACKS, [*RIGHT, *WRONG]).verdicts()
    assert verdicts == (Verdict.AGREES,) * len(RIGHT) + (Verdict.CONTRADICTED,) * len(WRONG)


def test_no_set_of_joins_costs_less() -> None:
    """All 2^n sets by brute force."""
    candidates = [*RIGHT[:3], *WRONG]
    graph = JoinGraph(TRACKS, candidates)
    sets = [frozenset(s) for size in range(len(candidates) + 1) for s in combinations(range(len(candidates)), size)]
    assert graph.cost(graph.agreeing()) == pytest.approx(min(map(graph.cost, sets)))


@pytest.mark.parametrize("rival", [0.0, 5.0, 12.0, 18.5, 19.5, 24.0])
def test_a_join_that_another_set_comes_near_to_is_contested(rival: float) -> None:
    """Two wings of one path are alike, and another path fits both: odds of 20 are 6 of the squared errors."""
    track = TRACKS[0]
    there, elsewhere = wrong(0, 2, 1, 28, evidence=25.0), wrong(0, 22, 1, 28, evidence=rival)
    graph = JoinGraph([track, TRACKS[1]], [replace(one, alone=True) for one in (there, elsewhere)])
    expected = Verdict.AGREES if 25.0 - rival > 2 * np.log(20.0) else Verdict.CONTESTED
    assert graph.verdicts() == (expected, Verdict.CONTRADICTED)


@pytest.mark.parametrize("evidence", [18.0, 25.0, 60.0])
def test_what_contests_a_join_is_the_best_of_all_sets_without_it(evidence: float) -> None:
    """All 2^n sets by brute force."""
    candidates = [*RIGHT[:3], *(replace(one, evidence=evidence) for one in WRONG)]
    graph = JoinGraph(TRACKS, candidates)
    sets = [frozenset(s) for size in range(len(candidates) + 1) for s in combinations(range(len(candidates)), size)]
    best = graph.agreeing()
    for n in best:
        behind = min(graph.cost(one) for one in sets if n not in one) - graph.cost(best)
        assert graph.is_contested(n, best) == (behind < min(0.5 * graph.price(n), 2 * np.log(20.0)))


def test_what_a_person_joins_is_not_contested() -> None:
    given = replace(wrong(0, 2, 1, 28, evidence=0.0), held=True, alone=True)
    graph = JoinGraph(TRACKS[:2], [given, replace(wrong(0, 22, 1, 28, evidence=24.0), alone=True)])
    assert graph.verdicts() == (Verdict.AGREES, Verdict.CONTRADICTED)


def test_the_order_of_paths_and_joins_does_not_matter() -> None:
    candidates = [*RIGHT, *WRONG[:1]]
    verdicts = JoinGraph(TRACKS, candidates).verdicts()
    for order in permutations(range(3)):
        new = {old: number for number, old in enumerate(order)}
        renamed = [replace(one, one=new[one.one], other=new[one.other]) for one in reversed(candidates)]
        found = JoinGraph([TRACKS[old] for old in order], renamed).verdicts()
        assert found == tuple(reversed(verdicts))


def test_a_wheel_a_tenth_too_small_contradicts_no_right_join() -> None:
    tracks = [by_odometry(truth, seed, 1.1 if seed == 1 else 1.0) for seed, truth in enumerate(TRUTH)]
    assert set(JoinGraph(tracks, RIGHT).verdicts()) == {Verdict.AGREES}


def test_a_join_that_no_loop_supports_needs_more_evidence() -> None:
    (doubtful,) = [replace(RIGHT[0], alone=False)]
    assert JoinGraph(TRACKS[:2], [doubtful]).verdicts() == (Verdict.UNSUPPORTED,)
    assert JoinGraph(TRACKS[:2], [replace(doubtful, alone=True)]).verdicts() == (Verdict.AGREES,)


def test_joins_at_one_spot_do_not_support_each_other() -> None:
    """Two paths along one corridor, a third back along it: taken for the same way, both joins of it agree."""
    there, again, back = walked([(0, 0), (20, 0)]), walked([(0, 0), (20, 0)]), walked([(20, 0), (0, 0)])
    tracks = [by_odometry(truth, seed) for seed, truth in enumerate((there, again, back))]
    sure = replace(wrong(0, 3, 1, 3, 12, evidence=30), alone=True)
    joins = [sure, wrong(0, 3, 2, 3, 12, evidence=15), wrong(1, 3, 2, 3, 12, evidence=15)]
    assert JoinGraph(tracks, joins).verdicts() == (Verdict.AGREES, Verdict.UNSUPPORTED, Verdict.UNSUPPORTED)


def test_what_is_given_is_not_left_out() -> None:
    given = replace(WRONG[0], held=True, alone=True)
    assert 0 in JoinGraph(TRACKS, [given, *RIGHT]).agreeing()


def test_joined_paths_lie_where_they_are() -> None:
    """In the frame of the first: rigidly laid over the truth, no view is farther off than odometry drifts."""
    graph = JoinGraph(TRACKS, RIGHT, ConsistencySettings())
    layout = graph.layout(range(len(RIGHT)))
    assert set(layout.groups) == {0}
    found, true = (np.concatenate(poses)[:, :2] for poses in (layout.poses, TRUTH))
    centred = found - found.mean(axis=0), true - true.mean(axis=0)
    u, _, v = np.linalg.svd(centred[0].T @ centred[1])
    turn = u @ np.diag([1, np.sign(np.linalg.det(u @ v))]) @ v
    assert np.hypot(*(centred[0] @ turn - centred[1]).T).max() < 1.0


def test_paths_that_no_join_leads_between_have_frames_of_their_own() -> None:
    layout = JoinGraph(TRACKS, RIGHT[:1]).layout([0])
    assert len(set(layout.groups)) == 2
    assert layout.poses[2] is TRACKS[2]


ROUND: Corners = [(0, 0), (20, 0), (20, 15), (0, 15), (0, 0), (20, 0), (20, 15), (0, 15)]
"""Almost twice round a block: 49 m after it was there first the path comes back, for 35 m."""
LAPS = walked(ROUND)
LAPS_TRACK = by_odometry(LAPS, 5)


def loop(first: int, second: int, count: int = 8, evidence: float = 18.0, alone: bool = False) -> CandidateJoin:
    """A path that is at its views from ``first`` on again from ``second`` on, right or wrong."""
    return replace(wrong(0, first, 0, second, count, evidence), alone=alone)


LAP = int(np.argmin(np.hypot(*LAPS[60:, :2].T))) + 60
"""The view at which it is back where it began."""


def test_a_right_loop_closes_the_plan_and_wrong_ones_are_contradicted() -> None:
    """The wrong ones: a place further on, the side across, and the way back, whatever tells for them."""
    right = loop(2, 2 + LAP, 12, 30.0, alone=True)
    wrong_ones = [loop(2, 14 + LAP), loop(3, 40, 8, 40.0, alone=True), loop(22, 22 + LAP + 20, 8, 40.0, alone=True)]
    graph = JoinGraph([LAPS_TRACK], [*wrong_ones, right])
    assert graph.verdicts() == (Verdict.CONTRADICTED,) * len(wrong_ones) + (Verdict.AGREES,)
    assert graph.agreeing() == min(
        (frozenset(some) for n in range(5) for some in combinations(range(4), n)), key=lambda some: graph.cost(some)
    )
    laid = graph.layout([len(wrong_ones)])
    assert laid.groups == (0,)
    assert gap(laid.poses[0]) < gap(LAPS_TRACK) / 2
    np.testing.assert_array_equal(graph.layout([]).poses[0], LAPS_TRACK)


def test_relative_poses_by_scans_take_the_place_of_views_at_one_spot() -> None:
    """A path that is driven a little aside the second time: what scans tell of that leaves the plan as it is."""
    aside = np.array([0.4, 0.5, 0.1])
    lap = moved(LAPS, np.where(np.arange(len(LAPS))[:, None] >= LAP - 5, aside, 0.0))
    views = np.column_stack([[3, 8], [3 + LAP, 8 + LAP]])
    pairs = np.column_stack([np.arange(2, 12), np.arange(2, 12) + LAP])
    blunt = CandidateJoin(0, 0, pairs, evidence=30.0)
    laid = replace(blunt, laid=LaidPairs(views, np.tile(aside, (2, 1))))
    told, assumed = (JoinGraph([lap], [one]).layout([0]).poses[0] for one in (laid, blunt))
    # Without noise what scans tell agrees with the odometry to the last bit; the other is drawn together.
    np.testing.assert_allclose(told, lap, atol=1e-6)
    assert np.hypot(*(assumed - lap)[:, :2].T).max() > 0.3


def gap(poses: NDArray[np.float64]) -> float:
    """Mean distance of views that are at one place in truth [m]."""
    return float(np.hypot(*(poses[:30, :2] - poses[LAP : LAP + 30, :2]).T).mean())


def test_what_joins_a_path_elsewhere_does_not_support_a_doubtful_loop_of_it() -> None:
    """Any join would link the path to itself. What supports a loop is odometry that tells where it comes back."""
    other = by_odometry(walked([(0, 0), (20, 0)]), 6)
    pairs = np.column_stack([np.arange(20), np.arange(20)])
    elsewhere = CandidateJoin(0, 1, pairs, evidence=60.0)
    doubtful = loop(26, 26 + LAP)
    strict, mild = ConsistencySettings(back=0.5), ConsistencySettings(back=50.0)
    for settings, verdict in ((strict, Verdict.UNSUPPORTED), (mild, Verdict.AGREES)):
        found = JoinGraph([LAPS_TRACK, other], [elsewhere, doubtful], settings).verdicts()
        assert found == (Verdict.AGREES, verdict)


def test_a_loop_that_stands_supports_one_a_little_further_on() -> None:
    sure, near, far = loop(0, LAP, 10, 40.0, alone=True), loop(21, 21 + LAP, 4), loop(40, 40 + LAP, 4)
    settings = ConsistencySettings(back=4.0)
    assert JoinGraph([LAPS_TRACK], [near], settings).verdicts() == (Verdict.UNSUPPORTED,)
    assert JoinGraph([LAPS_TRACK], [sure, near], settings).verdicts() == (Verdict.AGREES, Verdict.AGREES)
    # Odometry since tells less and less; the next loop tells it again.
    assert JoinGraph([LAPS_TRACK], [sure, far], settings).verdicts()[1] is Verdict.UNSUPPORTED
    assert JoinGraph([LAPS_TRACK], [sure, near, far], settings).verdicts() == (Verdict.AGREES,) * 3


def test_a_join_costs_twice_its_new_evidence() -> None:
    """Of 30 nats·m there are 15 nats, news each 2 m, or 10, each 3 m; squared errors are twice a log-likelihood."""
    join = wrong(0, 0, 1, 0, evidence=30.0)
    assert JoinGraph(TRACKS, [join]).price(0) == 30.0
    assert JoinGraph(TRACKS, [join], ConsistencySettings(news=3.0)).price(0) == 20.0


STRAIGHT = walked([(0, 0), (41, 0)])
"""A view a metre, 40 m."""
VARIANCE = 2 * 0.8**2 + 2 * 0.1**2 * 30 + 2 * (0.05 * 30) ** 2
"""Variance of a loop of two joins, 30 m apart on two straight paths [m²]: of the joins, of slip and of scale."""


def at_odds(
    off: float, spots: Sequence[int] = (30,), aside: float = 0.0, track: NDArray[np.float64] = STRAIGHT, **how: float
) -> JoinGraph:
    """Two paths that begin at one place, and a doubtful join that has one ``off`` [m] further on by then, or aside."""
    begin = LaidPairs(np.array([[0, 0]]), np.zeros((1, 3)))
    later = LaidPairs(np.column_stack([spots, spots]), np.tile([off, aside, 0.0], (len(spots), 1)))
    sure = CandidateJoin(0, 1, begin.views, evidence=99.0, laid=begin)
    doubtful = CandidateJoin(0, 1, later.views, evidence=8.0, alone=False, laid=later)
    return JoinGraph([track, track], [sure, doubtful], ConsistencySettings(**how))


def test_strain_is_the_error_of_a_loop_over_its_variance_and_price() -> None:
    for off in (0.5, 1.0):
        assert at_odds(off).strain(1, [0, 1]) == pytest.approx(off**2 / VARIANCE / 8.0, rel=0.02)


@pytest.mark.parametrize("looks", [0, 2])
def test_heading_that_drifts_on_the_way_and_in_turns_lets_a_path_come_out_aside(looks: int) -> None:
    """Errors of a loop that ends aside, with its covariance written out; it looks round on the spot at 5 m."""
    look = np.tile([[5.0, 0, 1.5], [5.0, 0, 0]], (looks, 1))
    track = np.concatenate([STRAIGHT[:6], look, STRAIGHT[6:]])
    joint, slip = np.square((0.8, 0.15)), 0.1**2 * 30
    heading = 0.02**2 * 30 + 0.05**2 * 3 * looks
    aside = slip + heading * 30**2 / 3
    # A heading that is off by so much where the paths begin is 30 m further on off by 30 times as many metres.
    covariance = np.array(
        [[2 * joint[0] + 30**2 * joint[1] + 2 * aside, 30 * joint[1]], [30 * joint[1], 2 * joint[1] + 2 * heading]]
    )
    errors = 0.5**2 * np.linalg.inv(covariance)[0, 0]
    graph = at_odds(0.0, (30 + 2 * looks,), aside=0.5, track=track)
    assert graph.strain(1, [0, 1]) * graph.price(1) == pytest.approx(errors, rel=0.01)


@pytest.mark.parametrize(("doubt", "verdict"), [(0.5, Verdict.CONTRADICTED), (0.9, Verdict.AGREES)])
def test_a_doubtful_join_may_be_strained_by_a_share_of_its_price(doubt: float, verdict: Verdict) -> None:
    """A loop fails by 6 m: squared errors of about 5.6, of a price of 8."""
    graph = at_odds(6.0, doubt=doubt)
    assert graph.strain(1, [0, 1]) == pytest.approx(0.7, abs=0.1)
    assert graph.verdicts() == (Verdict.AGREES, verdict)


def test_a_join_of_more_relative_poses_may_add_more_errors() -> None:
    """Errors of about 11, where one relative pose may add 7.8."""
    assert at_odds(8.5).is_strained(1, [0, 1])
    assert not at_odds(8.5, (28, 32)).is_strained(1, [0, 1])
    assert not at_odds(8.5, likely=15.0).is_strained(1, [0, 1])
    assert at_odds(8.5, (28, 32), likely=4.0).is_strained(1, [0, 1])


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_uncertainty_is_the_spread_of_many_walks(turn: float) -> None:
    """Walks of 40 m whose odometer drifts at each metre: where they end, and half-way where the end is known."""
    settings, rng = ConsistencySettings(), np.random.default_rng(3)
    drift = np.hypot(settings.drift, settings.turning * np.sqrt(turn))
    turns = np.tile([turn, -turn], 20)
    headings = np.cumsum(turns + rng.normal(scale=drift, size=(4000, 40)), axis=1)
    steps = 1 + rng.normal(scale=settings.slip, size=(4000, 40))
    x, y = np.cumsum(steps * np.cos(headings), axis=1), np.cumsum(steps * np.sin(headings), axis=1)
    end = np.column_stack([x[:, -1], y[:, -1], headings[:, -1], np.ones(4000)])
    middle = np.column_stack([x[:, 19], y[:, 19]])
    unexplained = middle - end @ np.linalg.lstsq(end, middle, rcond=None)[0]

    way = [np.zeros(3)]
    for one in turns:
        way.append(moved(moved(way[-1], (0.0, 0.0, one)), (1.0, 0.0, 0.0)))
    joins = [CandidateJoin(0, 1, np.array([[at, at]]), evidence=30.0) for at in (0, 40)]
    free, held = (JoinGraph([np.array(way)] * 2, some).layout(range(len(some))) for some in (joins[:1], joins))
    assert free.sigmas[0][-1] == pytest.approx(np.hypot(*end[:, :2].std(axis=0)), rel=0.06)
    assert held.sigmas[0][20] == pytest.approx(np.hypot(*unexplained.std(axis=0)), rel=0.06)
    assert held.sigmas[0][[0, -1]] == pytest.approx([0, 0])
