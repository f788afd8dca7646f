"""The odometer's scale against drives whose scale is known, and its slope against NumPy's least squares."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.belief import Belief, Stage, belief_from
from refseq.map.learning import learn
from refseq.map.localiser import Localiser, localise
from refseq.map.map import Map, beside
from refseq.map.matcher import Measurement
from refseq.map.tracking.odometer_scale import CLEAR, PLAY, RESIDUAL, OdometerScale
from refseq.view import View
from tests.support import corridor_drive

COUNT, STEP = 40, 0.85
SPREAD = 0.1


def drive(seed: int, count: int = COUNT) -> list[View]:
    return corridor_drive(np.random.default_rng(seed), count=count, size=96)


def scaled(views: Sequence[View], scale: float) -> list[View]:
    """A drive whose odometer tells ``scale`` times its way."""
    return [replace(view, distance=scale * view.distance) for view in views]


@pytest.fixture(scope="module")
def map_() -> Map:
    return learn(drive(1), profile="best")


@pytest.fixture(scope="module")
def plain() -> Map:
    return learn(drive(1), profile="best+motion.odometer_scale=0")


def chain(map_: Map, views: Sequence[View]) -> list[Belief]:
    return localise(map_, views, stages=[Stage.CHAIN])[Stage.CHAIN]


@pytest.fixture(scope="module")
def answers(map_: Map) -> Callable[[float], list[Belief]]:
    """Beliefs of a drive by an odometer of some scale, each worked out once."""
    return cache(lambda scale: chain(map_, scaled(drive(7), scale)))


def measured(distance: float, count: int = COUNT, *, again: bool = False) -> list[Measurement]:
    weights = np.arange(1.0, count + 1)
    return [Measurement(weights / weights.sum(), distance, 0.0, again=again)]


def at(along: float, count: int = COUNT, lost: float = 0.0) -> Belief:
    """A belief whose mean lies ``along`` [m] of a path of equal steps, shared out between two places."""
    weights = np.zeros(count)
    k = min(int(along / STEP), count - 2)
    weights[k : k + 2] = 1 - (share := along / STEP - k), share
    return belief_from(weights, lost)


def told(estimator: OdometerScale, ways: Sequence[float], places: Sequence[float]) -> None:
    """Tell of views at these ways by the odometer and at these places [m]."""
    for distance, along in zip(np.diff(ways, prepend=0.0), places, strict=True):
        estimator.remember(measured(float(distance)), at(along))


@given(st.floats(0.7, 1.4), st.integers(0, 1000))
def test_the_slope_is_that_of_least_squares_under_a_normal_prior(map_: Map, slope: float, seed: int) -> None:
    """Within one piece of way: the prior is one more equation, slope / σ = 1 / σ."""
    rng = np.random.default_rng(seed)
    ways = np.linspace(0.0, 14.0, 15)
    places = 2.0 + slope * ways + rng.normal(0, 0.1, 15)
    estimator = OdometerScale(map_)
    told(estimator, ways.tolist(), places.tolist())
    equations = np.column_stack([ways / RESIDUAL, np.full(15, 1 / RESIDUAL)])
    expected = np.linalg.lstsq(
        np.vstack([equations, [1 / SPREAD, 0.0]]), np.append(places / RESIDUAL, 1 / SPREAD), rcond=None
    )[0][0]
    spread = (SPREAD**-2 + ((ways - ways.mean()) ** 2).sum() / RESIDUAL**2) ** -0.5
    clear = abs(expected - 1) > max(PLAY, CLEAR * spread)
    assert estimator.scale == pytest.approx(expected if clear else 1.0, abs=1e-9)


@pytest.mark.parametrize(("metres", "scale"), [(4, 1.0), (14, 1.378)])
def test_a_slope_is_a_scale_once_it_is_clear(map_: Map, metres: int, scale: float) -> None:
    """Places 1.4 times as far apart as the odometer has it, each metre, known to 0.4 m; before the drive 1 ± 0.1.

    Over 4 m ways have a sum of squares of 10 m²: a slope of 1 + 0.4 · 62.5 / 162.5 = 1.15, give or take
    1 / √162.5 = 0.08: that may be chance. Over 14 m of 280 m²: 1.378, give or take 0.02.
    """
    estimator, ways = OdometerScale(map_), np.arange(metres + 1.0)
    told(estimator, ways.tolist(), (2.0 + 1.4 * ways).tolist())
    assert estimator.scale == pytest.approx(scale, abs=0.001)


def test_a_robot_that_backs_has_the_scale_of_one_that_goes_ahead(map_: Map) -> None:
    ways = np.arange(0.0, 20.0, STEP)
    ahead, back = OdometerScale(map_), OdometerScale(map_)
    told(ahead, ways.tolist(), (2.0 + 1.2 * ways).tolist())
    told(back, (-ways).tolist(), (30.0 - 1.2 * ways).tolist())
    assert ahead.scale > 1.1
    assert back.scale == pytest.approx(ahead.scale)


@pytest.mark.quick_cases("1.3")
@pytest.mark.parametrize("scale", [0.75, 0.9, 1.1, 1.3])
def test_a_drive_tells_its_scale(answers: Callable[[float], list[Belief]], scale: float) -> None:
    found = answers(scale)[-1].odometer_scale
    assert scale * found == pytest.approx(1.0, abs=0.04)


@pytest.mark.quick_cases("1.3")
@pytest.mark.parametrize("scale", [0.75, 1.3])
def test_a_drive_of_another_scale_is_found_better_by_it(
    map_: Map, plain: Map, answers: Callable[[float], list[Belief]], scale: float
) -> None:
    """Past the first metres the mean of the belief lies nearer to the robot."""
    along = map_.sequences[0].along
    late = slice(COUNT // 2, COUNT - 3)
    errors = [
        np.abs([along @ belief.places - at for belief, at in zip(beliefs, along, strict=True)])[late].mean()
        for beliefs in (chain(plain, scaled(drive(7), scale)), answers(scale))
    ]
    assert errors[1] < 0.75 * errors[0]


@pytest.mark.quick_cases("7")
@pytest.mark.parametrize("seed", [7, 8])
def test_an_odometer_that_is_right_is_believed_and_changes_no_bit(map_: Map, plain: Map, seed: int) -> None:
    for one, other in zip(chain(map_, drive(seed)), chain(plain, drive(seed)), strict=True):
        np.testing.assert_array_equal(one.places, other.places)
        assert one.odometer_scale == other.odometer_scale == 1.0


@pytest.mark.slow
def test_single_views_and_the_prior_believe_the_odometer(map_: Map, plain: Map) -> None:
    views = scaled(drive(7), 1.3)
    for stage in (Stage.UNIFORM, Stage.PRIOR):
        ours, theirs = (localise(one, views, stages=[stage])[stage] for one in (map_, plain))
        for one, other in zip(ours, theirs, strict=True):
            np.testing.assert_array_equal(one.places, other.places)


def test_the_thesis_believes_its_odometer() -> None:
    beliefs = chain(learn(drive(1), profile="thesis"), scaled(drive(7), 1.3))
    assert {belief.odometer_scale for belief in beliefs} == {1.0}


def test_a_robot_that_is_carried_off_has_no_other_scale(map_: Map) -> None:
    """Seven metres on at once, on the way and at a stand."""
    estimator = OdometerScale(map_)
    ways = np.arange(0.0, 24.0, STEP)
    told(estimator, ways.tolist(), np.minimum(2.0 + ways + 7.0 * (ways > 12.0), 32.0).tolist())
    assert estimator.scale == 1.0


def test_the_ends_of_a_path_tell_no_scale(map_: Map) -> None:
    """The robot goes on behind its path's end, and the last place stays the best."""
    estimator = OdometerScale(map_)
    ways = np.arange(0.0, 60.0, STEP)
    for distance, along in zip(np.diff(ways, prepend=0.0), ways, strict=True):
        estimator.remember(measured(float(distance)), at(min(along, (COUNT - 1) * STEP)))
    assert estimator.scale == 1.0


def test_lost_or_unsure_views_tell_nothing(map_: Map) -> None:
    for belief in (lambda along: at(along, lost=0.3), lambda along: belief_from(np.ones(COUNT))):
        estimator = OdometerScale(map_)
        for along in np.arange(2.0, 30.0, STEP):
            estimator.remember(measured(1.3 * STEP), belief(along))
        assert estimator.scale == 1.0


def test_the_views_of_a_stand_are_one(map_: Map) -> None:
    moving, standing = OdometerScale(map_), OdometerScale(map_)
    for along in np.arange(2.0, 30.0, STEP):
        for estimator in (moving, standing):
            estimator.remember(measured(1.3 * STEP), at(along))
        for _ in range(5):
            standing.remember(measured(1.3 * STEP, again=True), at(along))
    assert standing.scale == moving.scale != 1.0


def test_a_way_that_nobody_measured_begins_anew(map_: Map) -> None:
    estimator = OdometerScale(map_)
    for number, along in enumerate(np.arange(2.0, 30.0, STEP)):
        estimator.remember(measured(math.nan if number % 9 == 4 else 1.3 * STEP), at(along))
    assert estimator.scale == pytest.approx(1 / 1.3, abs=0.04)
    assert not math.isnan(estimator.corrected(measured(1.0))[0].distance)


def test_ways_are_along_the_sequence_that_the_robot_is_on(map_: Map) -> None:
    """Its places begin anew where another sequence begins: no line is drawn across."""
    other = learn(drive(3), profile="best", name="other")
    both = beside([map_.named("one"), other])
    estimator = OdometerScale(both)
    for number, along in enumerate(np.arange(2.0, 30.0, STEP)):
        weights = np.zeros(2 * COUNT)
        weights[(number % 2) * COUNT :][:COUNT] = at(along).places
        estimator.remember(measured(STEP, 2 * COUNT), belief_from(weights))
    assert estimator.scale == 1.0


@pytest.mark.parametrize("slope", [0.2, 4.0, -1.0])
def test_what_is_no_scale_any_more_is_not_taken_for_one(map_: Map, slope: float) -> None:
    """Steps so short that none of them is a jump; a path that is driven backwards among them."""
    estimator = OdometerScale(map_)
    ways = np.arange(0.0, 30.0 / max(1.0, slope), 0.2)
    told(estimator, ways.tolist(), (2.0 + slope * ways if slope > 0 else 32.0 - ways).tolist())
    assert estimator.scale == 1.0


@pytest.mark.quick_cases("0.2")
@pytest.mark.parametrize("step", [0.05, 0.2, 0.5])
def test_views_close_to_each_other_are_no_more_sure_together(map_: Map, step: float) -> None:
    """Beliefs of a right odometer that err alike over metres: of twenty drives hardly one tells another scale."""
    wrong = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        ways = np.arange(0.0, 28.0, step)
        errors = np.interp(ways, np.arange(0.0, 31.0, 3.0), rng.normal(0, 0.3, 11))
        estimator = OdometerScale(map_)
        told(estimator, ways.tolist(), (2.0 + ways + errors).tolist())
        wrong += estimator.scale != 1.0
    assert wrong <= 2


def test_a_robot_that_stops_on_its_way_believes_a_right_odometer(map_: Map) -> None:
    """Forty views at each of three places: they are no points of a line."""
    views = drive(7)
    for at_view in (25, 16, 8):
        views[at_view:at_view] = [replace(views[at_view - 1], distance=0.0, turn=0.0)] * 40
    assert {belief.odometer_scale for belief in chain(map_, views)} == {1.0}


def test_a_robot_that_goes_to_and_fro_for_hours_keeps_few_points(map_: Map) -> None:
    estimator = OdometerScale(map_)
    for number in range(4000):
        back = number // 10 % 2
        along = 5.0 + (number % 10 if not back else 10 - number % 10)
        estimator.remember(measured(-1.0 if back else 1.0), at(along))
    assert len(estimator._points) < 30
    assert estimator.scale == 1.0


def test_after_a_reset_the_odometer_is_believed_again(map_: Map) -> None:
    localiser = Localiser(map_)
    for view in scaled(drive(7), 1.3):
        before = localiser.update(view)
    localiser.reset()
    assert before.odometer_scale != 1.0
    assert localiser.update(drive(7)[0]).odometer_scale == 1.0


def test_what_the_odometer_alone_moves_confirms_no_scale(map_: Map) -> None:
    estimator = OdometerScale(map_)
    told(estimator, (1.25 * np.arange(20.0)).tolist(), np.arange(1.0, 21.0).tolist())
    scale, blind = estimator.scale, Measurement(np.full(COUNT, 1 / COUNT), 1.25, 0.0)
    assert scale == pytest.approx(0.8, abs=0.02)
    for along in np.arange(21.0, 32.0) + 1.25 * np.arange(11):
        estimator.remember([blind], at(float(min(along, 30.0))))
    assert estimator.scale == scale
