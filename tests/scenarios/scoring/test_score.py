import math
from dataclasses import fields, replace
from random import Random

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.metrics import auroc, false_positive_rate, reliability, retrieval
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import NARROW, WIDE, ReferencePath, Tolerance, path_of
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.score import Score, harm, pool, score
from tests.support import certain, corridor_comparison

PLACES = 11


def at(x: float, y: float = 0.0, heading: float = 0.0) -> View:
    return View(0.0, truth=Pose(x, y, heading))


def line(*truths: View, beliefs: list[Belief], name: str = "test") -> Comparison:
    """Queries against a map with one place every metre along x, from 0 to 10 m."""
    reference = [at(float(k)) for k in range(PLACES)]
    return Comparison(name, reference, {}, list(truths), {}, {Stage.CHAIN: beliefs})


def judged(*truths: View, beliefs: list[Belief], tolerance: Tolerance = WIDE) -> Score:
    return score(line(*truths, beliefs=beliefs), Stage.CHAIN, tolerance)


def test_each_outcome_has_its_case() -> None:
    lost = certain(PLACES, 5, lost=0.9)
    sure = certain(PLACES, 5)
    views = [at(4.0), at(3.4), at(5.0), at(5.0, 9.0), at(5.0, 9.0), View(0.0)]
    result = judged(*views, beliefs=[sure, sure, lost, lost, sure, sure])
    assert result.outcomes == (
        Outcome.RIGHT,
        Outcome.WRONG,
        Outcome.MISSED,
        Outcome.REJECTED,
        Outcome.FALSE_FIX,
        Outcome.UNSCORED,
    )
    assert result.success == Proportion(1, 3)
    assert result.accuracy == Proportion(2, 5), "right on the map, rejected off it"
    assert result.failures == 2


def test_tolerances_are_inclusive_and_turn_with_the_circle() -> None:
    sure = certain(PLACES, 5)
    views = [
        at(3.5),
        at(3.499),
        at(5.5),
        at(5.501),
        at(5.0, 0.0, math.radians(389.99)),
        at(5.0, 0.0, math.radians(-30.01)),
    ]
    wide = judged(*views, beliefs=[sure] * 6).outcomes
    assert wide == (Outcome.RIGHT, Outcome.WRONG, *[Outcome.RIGHT] * 3, Outcome.FALSE_FIX)
    narrow = judged(*views, beliefs=[sure] * 6, tolerance=NARROW).outcomes
    assert narrow == (Outcome.WRONG, Outcome.WRONG, Outcome.RIGHT, Outcome.WRONG, Outcome.RIGHT, Outcome.FALSE_FIX)


def test_a_heading_on_the_edge_counts_as_within() -> None:
    edge = [at(5.0, 0.0, heading) for heading in (0.6, -0.6)]
    assert judged(*edge, beliefs=[certain(PLACES, 5)] * 2, tolerance=Tolerance(1.0, 0.6)).failures == 0
    assert judged(*edge, beliefs=[certain(PLACES, 5)] * 2, tolerance=Tolerance(1.0, 0.6)).success.trials == 2


def test_a_place_seen_from_behind_is_not_on_the_map() -> None:
    result = judged(at(5.0, 0.0, math.pi), beliefs=[certain(PLACES, 5)])
    assert result.outcomes == (Outcome.FALSE_FIX,)
    assert result.success.trials == 0


def test_lost_needs_more_than_the_threshold() -> None:
    beliefs = [certain(PLACES, 5, lost=LOST_ABOVE), certain(PLACES, 5, lost=np.nextafter(LOST_ABOVE, 1.0))]
    assert judged(at(5.0), at(5.0), beliefs=beliefs).outcomes == (Outcome.RIGHT, Outcome.MISSED)


def test_along_path_error_follows_the_bends_of_the_path() -> None:
    corner = [at(0.0), at(10.0), View(0.0), at(10.0, 10.0, math.pi / 2)]
    query = [at(9.0, -0.3), at(10.4, 2.0, math.pi / 2)]
    comparison = Comparison("corner", corner, {}, query, {}, {Stage.CHAIN: [certain(4, 3), certain(4, 1)]})
    result = score(comparison, Stage.CHAIN, Tolerance(3.0, math.radians(95)))
    assert result.errors == pytest.approx([20 - 9, 10 - 12])
    assert result.error_quantile(0.5) == pytest.approx(6.5)


def test_way_out_and_way_back_are_told_apart_by_heading() -> None:
    out = [at(float(x)) for x in range(11)]
    back = [at(float(x), 0.0, math.pi) for x in range(10, -1, -1)]
    path = ReferencePath(out + back)
    assert path.project(Pose(3.0, 0.0, 0.1)) == pytest.approx(3.0)
    assert path.project(Pose(3.0, 0.0, math.pi)) == pytest.approx(17.0)
    assert path.nearest(Pose(3.0, 0.0, math.pi)) == 18


@given(
    st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=2, max_size=8, unique=True),
    st.tuples(st.floats(-20, 20), st.floats(-20, 20)),
)
def test_projection_is_the_nearest_of_finely_sampled_points(
    corners: list[tuple[float, float]], point: tuple[float, float]
) -> None:
    path = ReferencePath([at(*corner) for corner in corners])
    along = np.linspace(0, path.along[-1], 4001)
    samples = np.stack([np.interp(along, path.along, path.points[:, axis]) for axis in (0, 1)], axis=1)
    misses = np.linalg.norm(samples - point, axis=1)
    found = path.project(Pose(*point, 0.0))
    miss = math.hypot(*(np.interp(found, path.along, path.points[:, axis]) - point[axis] for axis in (0, 1)))
    assert miss == pytest.approx(misses.min(), abs=along[1] + 1e-9)


@given(
    st.lists(st.tuples(st.floats(-3, 13), st.floats(-3, 3), st.floats(-7, 7)), min_size=1, max_size=12),
    st.randoms(use_true_random=False),
    st.floats(0.1, 3),
)
def test_outcomes_agree_with_a_plain_reading_of_the_rules(
    poses: list[tuple[float, float, float]],
    random: Random,
    reach: float,
) -> None:
    beliefs = [certain(PLACES, random.randrange(PLACES), random.random()) for _ in poses]
    tolerance = Tolerance(reach, 0.6)
    result = judged(*[at(*pose) for pose in poses], beliefs=beliefs, tolerance=tolerance)
    for (x, y, heading), belief, outcome in zip(poses, beliefs, result.outcomes, strict=True):
        angle = math.acos(max(-1.0, min(1.0, math.cos(heading))))
        edges = [abs(angle - 0.6), *(abs(math.dist((x, y), (k, 0)) - reach) for k in range(PLACES))]
        assume(min(edges) > 1e-6)  # on the very edge, rounding decides
        same_way = angle <= 0.6
        good = [same_way and math.dist((x, y), (k, 0)) <= reach for k in range(PLACES)]
        expected = (
            (Outcome.MISSED if any(good) else Outcome.REJECTED)
            if belief.lost > 0.5
            else (Outcome.RIGHT if good[belief.best] else Outcome.WRONG if any(good) else Outcome.FALSE_FIX)
        )
        assert outcome is expected


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [
        (81, 263, 0.2553, 0.3662),  # the three rows: Newcombe 1998, Table I, method 3
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (20, 20, 0.8389, 1.0000),  # the mirror image of 0 out of 20
    ],
)
def test_wilson_interval_has_the_published_values(successes: int, trials: int, low: float, high: float) -> None:
    assert Proportion(successes, trials).interval == pytest.approx((low, high), abs=5e-5)


@given(st.integers(0, 300), st.integers(1, 300))
def test_wilson_bounds_solve_the_score_equation(successes: int, trials: int) -> None:
    successes = min(successes, trials)
    share = successes / trials
    for bound in Proportion(successes, trials).interval:
        assert (share - bound) ** 2 == pytest.approx(1.959964**2 * bound * (1 - bound) / trials, abs=1e-6)


def test_nothing_tried_means_nothing_known() -> None:
    assert math.isnan(Proportion(0, 0).value)
    assert Proportion(0, 0).interval == (0.0, 1.0)


@given(st.lists(st.integers(0, 4), max_size=12), st.lists(st.integers(0, 4), max_size=12))
def test_auroc_counts_pairs(positives: list[int], negatives: list[int]) -> None:
    found = auroc(np.array(positives, dtype=float), np.array(negatives, dtype=float))
    if not (positives and negatives):
        assert found is None
        return
    wins = sum((p > n) + 0.5 * (p == n) for p in positives for n in negatives)
    assert found == pytest.approx(wins / (len(positives) * len(negatives)))


@given(
    st.lists(st.integers(0, 6), min_size=1, max_size=30),
    st.lists(st.integers(0, 6), min_size=1, max_size=12),
    st.sampled_from([0.5, 0.95, 1.0]),
)
def test_false_alarms_are_the_fewest_that_catch_enough(positives: list[int], negatives: list[int], rate: float) -> None:
    found = false_positive_rate(np.array(positives, dtype=float), np.array(negatives, dtype=float), rate)
    catching = [t for t in positives if sum(p >= t for p in positives) >= rate * len(positives) - 1e-9]
    assert found == pytest.approx(min(sum(n >= t for n in negatives) / len(negatives) for t in catching))


def test_false_alarms_by_hand() -> None:
    off_map = np.array([0.9, 0.8, 0.7, *[0.95] * 16, 0.2])  # 19 of 20 are at or above 0.7
    on_map = np.array([0.1, 0.7, 0.69, 0.75])
    assert false_positive_rate(off_map, on_map, 0.95) == pytest.approx(2 / 4)
    assert false_positive_rate(off_map, on_map, 1.0) == pytest.approx(3 / 4)
    assert false_positive_rate(off_map, np.zeros(0), 0.95) is None


def test_recall_looks_at_the_most_probable_places_lost_or_not() -> None:
    places = np.array([0.30, 0.02, 0.20, 0.02, 0.10, 0.02, 0.15, 0.02, 0.12, 0.03, 0.02])
    belief = Belief(places, 0.9, 0, (0,), 0.0)
    # In falling order: places 0, 2, 6, 8, 4, 9, and then those at 0.02 in the order of the path.
    result = judged(*[at(float(x)) for x in (0, 2, 4, 9, 1)], beliefs=[belief] * 5, tolerance=NARROW)
    assert result.ranks.tolist() == [1, 2, 5, 6, 7]
    assert [result.recall(n).successes for n in (1, 2, 5, 10)] == [1, 2, 3, 5]
    assert result.recall(5) == Proportion(3, 5)


def test_recall_leaves_out_views_off_the_map() -> None:
    result = judged(at(5.0), at(5.0, 9.0), beliefs=[certain(PLACES, 5)] * 2)
    assert result.recall(1) == Proportion(1, 1)
    assert math.isinf(result.ranks[1])


def test_the_answer_comes_first_among_equals() -> None:
    belief = Belief(np.full(PLACES, 1 / PLACES), 0.0, 7, (7,), math.log(PLACES))
    result = judged(at(7.0), at(0.0), beliefs=[belief] * 2, tolerance=NARROW)
    assert result.ranks.tolist() == [1, 2]
    assert result.outcomes == (Outcome.RIGHT, Outcome.WRONG)


def test_the_worst_false_fix_is_the_farthest_answer_off_the_map() -> None:
    views = [at(5.0), at(4.0, 3.0), at(0.0, 9.0), at(5.0, 99.0)]
    beliefs = [certain(PLACES, 9), certain(PLACES, 8), certain(PLACES, 0), certain(PLACES, 5, lost=0.9)]
    result = judged(*views, beliefs=beliefs)
    assert result.false_fixes == pytest.approx([math.nan, 5.0, 9.0, math.nan], nan_ok=True)
    assert result.worst_false_fix == 9.0
    assert math.isnan(judged(at(5.0), beliefs=[certain(PLACES, 9)]).worst_false_fix)
    assert judged(at(5.0, 99.0), beliefs=[certain(PLACES, 9, lost=0.9)]).worst_false_fix == 0.0


def test_the_place_where_it_was_last_sure_is_held_against_where_it_left_the_map() -> None:
    """Off the map and lost alone; which of the Lost_Places it is, is told by more than half of P(lost)."""
    views = [at(0.0, 9.0), at(3.0), at(5.2), at(5.0, 9.0), at(5.0, 20.0), at(5.0, 30.0), at(5.0, 40.0), at(4.0)]
    told = [(0.9, 2, 0.8), (0.1, 2, 0.1), (0.1, 2, 0.1), (0.9, 7, 0.5), (0.9, 5, 0.8), (0.9, 6, 0.4), (0.3, 6, 0.3)]
    beliefs = [replace(certain(PLACES, 5, p), lost_after=share * np.eye(PLACES)[k]) for p, k, share in told]
    result = judged(*views, beliefs=[*beliefs, certain(PLACES, 4, 0.9)])
    assert result.last_sure == pytest.approx([*[math.nan] * 3, 1.8, 0.2, *[math.nan] * 3], nan_ok=True)
    assert result.last_sure_median == pytest.approx(1.0)
    assert math.isnan(judged(at(5.0), beliefs=[certain(PLACES, 9)]).last_sure_median)


def test_reliability_of_lost_asks_for_views_off_the_map() -> None:
    views = [at(5.0), at(5.0), at(5.0, 9.0), View(0.0)]
    result = judged(*views, beliefs=[certain(PLACES, 5, lost=p) for p in (0.1, 0.6, 0.7, 0.9)])
    assert result.lost_reliability.count.sum() == 3
    assert result.lost_reliability.error == pytest.approx((0.1 + 0.6 + 0.3) / 3)


def believed(**probabilities: float) -> Belief:
    """A belief by places: ``k5=0.4`` gives the sixth a probability of 0.4."""
    places = np.zeros(PLACES)
    for name, probability in probabilities.items():
        places[int(name[1:])] = probability
    return replace(certain(PLACES, int(places.argmax())), places=places)


def test_what_is_believed_around_the_top_place_is_held_against_its_being_right() -> None:
    unsure = believed(k4=0.1, k5=0.45, k6=0.2, k9=0.25)
    views = [at(4.0), at(9.0), at(5.0, 9.0)]
    wide = judged(*views, beliefs=[unsure] * 3)
    assert wide.outcomes[:2] == (Outcome.RIGHT, Outcome.WRONG)
    assert wide.mass == pytest.approx([0.75] * 3)
    assert wide.mass_reliability.count.tolist() == [*[0] * 7, 2, 0, 0], "a view off the map says nothing of it"
    assert wide.mass_reliability.error == pytest.approx(0.25)
    assert judged(*views, beliefs=[unsure] * 3, tolerance=NARROW).mass == pytest.approx([0.45] * 3)


def test_a_top_place_without_a_pose_is_believed_for_itself() -> None:
    reference = [at(0.0), View(0.0), at(2.0)]
    belief = replace(certain(3, 1), places=np.array([0.3, 0.4, 0.3]))
    found = score(Comparison("test", reference, {}, [at(0.0)], {}, {Stage.CHAIN: [belief]}), Stage.CHAIN)
    assert found.mass == pytest.approx([0.4])
    assert found.outcomes == (Outcome.WRONG,)


def test_beliefs_that_come_true_as_often_as_they_say_have_no_calibration_error() -> None:
    """The truth is drawn from each belief: the top place alone is then right far more often than it was likely."""
    rng = np.random.default_rng(0)
    places = rng.dirichlet(np.full(PLACES, 0.5), size=3000)
    beliefs = [replace(certain(PLACES, int(one.argmax())), places=one) for one in places]
    found = judged(*(at(float(rng.choice(PLACES, p=one))) for one in places), beliefs=beliefs)
    assert found.mass_reliability.error < 0.02
    assert reliability(found.top, found.ranks == 1).error > 0.1


@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), min_size=1, max_size=20), st.integers(0, 5))
def test_retrieval_agrees_with_brute_force(answers: list[tuple[int, bool]], never: int) -> None:
    relevant = max(sum(right for _, right in answers) + never, 1)
    curve = retrieval(np.array([s for s, _ in answers], float), np.array([r for _, r in answers]), relevant)
    distinct = sorted({s for s, _ in answers}, reverse=True)
    assert curve.thresholds.tolist() == distinct
    area, last = 0.0, 0.0
    for threshold, precision, recall in zip(distinct, curve.precision, curve.recall, strict=True):
        taken = [right for s, right in answers if s >= threshold]
        assert precision == pytest.approx(sum(taken) / len(taken))
        assert recall == pytest.approx(sum(taken) / relevant)
        area += precision * (recall - last)
        last = recall
    assert curve.auc == pytest.approx(area)
    sure = [r for p, r in zip(curve.precision, curve.recall, strict=True) if p == 1]
    assert curve.recall_at(1.0) == pytest.approx(max(sure, default=0.0))


def test_false_fixes_cost_precision_but_not_recall() -> None:
    views, beliefs = [at(5.0), at(5.0, 9.0)], [certain(PLACES, 5, lost=0.1), certain(PLACES, 5)]
    curve = judged(*views, beliefs=beliefs).retrieval
    assert curve is not None
    assert curve.precision.tolist() == [0.0, 0.5]
    assert curve.recall.tolist() == [0.0, 1.0]


def test_distance_to_the_first_right_answer_is_what_was_travelled() -> None:
    views = [at(0.0), at(2.0), View(0.0), at(2.0, 1.0), at(3.0, 1.0)]
    beliefs = [certain(PLACES, place) for place in (9, 9, 9, 2, 3)]
    assert judged(*views, beliefs=beliefs).first_fixes == (3.0,)
    assert judged(at(0.0), beliefs=[certain(PLACES, 9)]).first_fixes == (None,)


def test_harm_counts_what_the_sequence_spoilt() -> None:
    truths = [at(5.0)] * 4
    single = judged(*truths, beliefs=[certain(PLACES, k) for k in (5, 5, 9, 5)])
    sequence = judged(*truths, beliefs=[certain(PLACES, 5), certain(PLACES, 9), *[certain(PLACES, 9, 0.9)] * 2])
    assert harm(sequence, single) == Proportion(1, 3)


def test_pooled_runs_add_up() -> None:
    runs = [score(corridor_comparison(seed, count=40, size=24), Stage.UNIFORM) for seed in range(5)]
    whole = pool(runs)
    assert whole.success == Proportion(sum(r.success.successes for r in runs), sum(r.success.trials for r in runs))
    assert whole.success.trials == 200
    assert whole.failures == sum(run.failures for run in runs)
    assert whole.error_quantile(0.5) == pytest.approx(
        np.median(np.abs(np.concatenate([r.errors[np.isfinite(r.errors)] for r in runs])))
    )
    assert len(whole.first_fixes) == 5
    assert whole.recall(5).successes == sum(run.recall(5).successes for run in runs)
    assert whole.mass_reliability.count.tolist() == sum(run.mass_reliability.count for run in runs).tolist()


def test_pooled_runs_keep_each_view_s_own() -> None:
    runs = [score(corridor_comparison(seed, count=12, size=24), Stage.UNIFORM) for seed in range(2)]
    whole = pool(runs)
    arrays = [field.name for field in fields(Score) if isinstance(getattr(whole, field.name), np.ndarray)]
    assert len(arrays) == 11
    for name in arrays:
        parts = [getattr(run, name) for run in runs]
        np.testing.assert_array_equal(getattr(whole, name), np.concatenate(parts), err_msg=name)


def test_pooled_runs_keep_the_recovery_distances_of_all() -> None:
    away = judged(at(5.0), at(5.0, 9.0), at(5.0), beliefs=[certain(PLACES, 5, lost=p) for p in (0, 0.9, 0)])
    never = judged(at(5.0), at(5.0, 9.0), beliefs=[certain(PLACES, 5)] * 2)
    assert pool([away, never]).recovery == ((0.0, None), (0.0,))
    assert pool([away, never]).worst_false_fix == 9.0


def test_runs_of_different_tolerances_are_not_pooled() -> None:
    one = judged(at(5.0), beliefs=[certain(PLACES, 5)])
    with pytest.raises(ScenarioError, match="2 runs judged at 2 tolerances; valid is one"):
        pool([one, replace(one, tolerance=NARROW)])


def test_auroc_of_lost_needs_views_of_both_kinds() -> None:
    on = judged(at(5.0), at(5.0), beliefs=[certain(PLACES, 5, lost=p) for p in (0.1, 0.6)])
    assert on.auroc is None
    both = judged(*[at(5.0)] * 2, at(5.0, 9.0), beliefs=[certain(PLACES, 5, lost=p) for p in (0.1, 0.6, 0.3)])
    assert both.auroc == pytest.approx(0.5)


def test_answers_that_do_not_fit_the_views_are_refused() -> None:
    with pytest.raises(ScenarioError, match="2 answers; valid is one a query view, 1"):
        line(at(5.0), beliefs=[certain(PLACES, 5)] * 2)
    with pytest.raises(ScenarioError, match=r"view 0: best place 3 of 4; .* the map's 11 places"):
        line(at(5.0), beliefs=[certain(4, 3)])


def test_a_missing_stage_is_refused_and_missing_truth_leaves_all_unscored() -> None:
    comparison = line(at(5.0), beliefs=[certain(PLACES, 5)])
    with pytest.raises(ScenarioError, match="no answers of 'prior'; valid are chain"):
        score(comparison, Stage.PRIOR)
    blind = Comparison("blind", [View(0.0)], {}, [at(5.0)], {}, {Stage.CHAIN: [certain(1, 0)]})
    found = score(blind, Stage.CHAIN)
    assert found.outcomes == (Outcome.UNSCORED,)
    assert (found.scored, found.success, found.first_fixes) == (0, Proportion(0, 0), ())
    assert math.isnan(found.success.value)
    assert math.isnan(found.error_quantile(0.5))
    assert found.retrieval is None


def test_no_views_score_as_nothing() -> None:
    result = judged(beliefs=[])
    assert result.success == Proportion(0, 0)
    assert math.isnan(result.error_quantile(0.5))
    assert result.retrieval is None


def test_places_are_a_unit_of_their_own() -> None:
    views = [at(4.0), at(4.4), at(4.6), at(4.0), at(4.0, 9.0), View(0.0)]
    beliefs = [certain(PLACES, 4), certain(PLACES, 6), certain(PLACES, 4), certain(PLACES, 4, lost=0.9)]
    result = judged(*views, beliefs=[*beliefs, certain(PLACES, 1), certain(PLACES, 1)])
    np.testing.assert_array_equal(result.places_off, [0, 2, -1, math.nan, math.nan, math.nan])
    assert [result.within_places(count) for count in (0, 1, 2, 5)] == [
        Proportion(1, 4),
        Proportion(2, 4),
        Proportion(3, 4),
        Proportion(3, 4),
    ]


def test_entropy_is_weighed_against_being_wrong() -> None:
    def answer(place: int, entropy: float, lost: float = 0.0) -> Belief:
        return replace(certain(PLACES, place, lost), entropy=entropy)

    beliefs = [answer(4, 1.0), answer(4, 3.0), answer(9, 2.0), answer(9, 4.0), answer(9, 0.0, lost=0.9)]
    result = judged(*[at(4.0)] * 5, beliefs=beliefs)
    assert result.entropy_auroc == 0.75  # of four pairs of a wrong and a right one, in three the wrong one doubts more
    assert judged(at(4.0), beliefs=[answer(4, 1.0)]).entropy_auroc is None
    assert judged(beliefs=[]).entropy_auroc is None


def test_information_is_what_posteriors_claim_and_true_places_prove() -> None:
    comparison = corridor_comparison(3, count=20, size=16)
    result = score(comparison, "chain")
    posteriors = [belief.places for belief in comparison.beliefs["chain"]]
    entropies = [-np.sum(p[p > 0] * np.log2(p[p > 0])) for p in posteriors]
    assert result.information == pytest.approx(math.log2(20) - np.mean(entropies), abs=1e-9)
    path = path_of(comparison)
    nearest = [path.nearest(view.truth) for view in comparison.query_views]
    there = [p[k] for p, k in zip(posteriors, nearest, strict=True)]
    assert result.proven_information == pytest.approx(math.log2(20) + np.mean(np.log2(there)), abs=1e-9)


def test_information_is_proven_on_the_map_only() -> None:
    result = judged(at(5.0), at(5.0, 9.0), View(0.0), beliefs=[certain(PLACES, 5)] * 3)
    assert result.proven_information == pytest.approx(math.log2(PLACES), abs=1e-12)
    assert result.information == pytest.approx(math.log2(PLACES), abs=1e-12)
    assert math.isnan(judged(at(5.0, 9.0), beliefs=[certain(PLACES, 5)]).proven_information)
    assert math.isnan(judged(beliefs=[]).information)


def test_of_a_place_that_another_holds_its_holder_is_proven() -> None:
    """Two drives of six places along one line: the second's fourth was merged into the first's."""
    views = [at(float(k), y) for y in (0.0, 0.3) for k in range(6)]
    held_by = np.array([*range(9), 3, 10, 11])
    merged = Comparison(
        "merged",
        views,
        {},
        [at(3.0, 0.3)],
        {},
        {Stage.CHAIN: [certain(12, 3)]},
        drives=Drives(("a", "b"), (6, 6)),
        mergings={Stage.CHAIN: Merging(("a", "b"), (6, 6), held_by, (), (1, 1), 0.0)},
    )
    assert score(merged, Stage.CHAIN).proven_information == pytest.approx(math.log2(12))
    assert score(replace(merged, mergings={}), Stage.CHAIN).proven_information == -math.inf
