"""Where a robot is on its way: right views keep it right, single wrong ones do not move it, agreeing ones do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from refseq.belief import Belief, belief_from, pose_beside
from refseq.missions.path import MissionPath
from refseq.missions.progress import Estimate, ProgressFilter, ProgressSettings
from tests.refseq.missions.on_a_line import flat, lost, seen_at, way

WAY = way(60.0)
COUNT = len(WAY.along)
TRUST = ProgressSettings()
some = settings(max_examples=50, derandomize=True)
KINDS = ("elsewhere", "lost", "flat", "half lost")


def wrong(kind: str, x: float) -> Belief:
    """A wrong view of a robot at ``x`` [m]."""
    far = x + 20.0 if x < 30.0 else x - 20.0
    return {
        "elsewhere": seen_at(WAY.along, far),
        "lost": lost(COUNT),
        "flat": flat(COUNT),
        "half lost": seen_at(WAY.along, x, lost=0.6),
    }[kind]


def settled(at: float) -> ProgressFilter:
    """A position that views have agreed to."""
    where = ProgressFilter(WAY, TRUST, at)
    for _ in range(20):
        where.update(seen_at(WAY.along, at))
    return where


@some
@given(st.integers(0, 10**6), st.floats(0.0, 0.4))
def test_noise_stays_below_the_spacing(seed: int, noise: float) -> None:
    rng, where = np.random.default_rng(seed), ProgressFilter(WAY, TRUST)
    for number in range(60):
        word = where.update(seen_at(WAY.along, np.clip(number + rng.normal(0, noise), 0, 60)))
        assert word is Estimate.AGREES or noise > 0.3
        assert abs(where.along - number) < 1.0
        where.move(1.0)


@some
@given(st.floats(0.97, 1.03), st.integers(0, 10**6))
def test_an_odometer_that_drifts_by_three_percent_is_put_right(scale: float, seed: int) -> None:
    """What is left is the drift of one step over the share that a view puts right, not 1.8 m after 60."""
    rng, where = np.random.default_rng(seed), ProgressFilter(WAY, TRUST)
    for x in range(61):
        where.update(seen_at(WAY.along, float(np.clip(x + rng.normal(0, 0.1), 0, 60))))
        assert abs(where.along - x) < 0.03 / TRUST.share + 0.45
        where.move(scale)


@some
@given(st.floats(0.6, 1.6), st.integers(0, 10**6))
def test_an_odometer_of_another_scale_counts_in_metres_of_the_map(scale: float, seed: int) -> None:
    """Between two views it goes on by what the belief takes the odometer for, and so one of any scale is as good."""
    rng, where = np.random.default_rng(seed), ProgressFilter(WAY, TRUST)
    for x in range(61):
        told = replace(seen_at(WAY.along, float(np.clip(x + rng.normal(0, 0.1), 0, 60))), odometer_scale=1 / scale)
        where.update(told)
        assert abs(where.along - x) < 0.45
        where.move(scale)


def beside(place: int, along: float, deviation: float, heading: float = 0.0) -> Belief:
    """A belief in a place, with a pose beside it whose ``along`` has a standard ``deviation`` [m]."""
    pose = pose_beside((along, 0.1, heading), np.diag([deviation**2, 1e-4, 1e-4]))
    return replace(seen_at(WAY.along, float(place), width=0.2), pose=pose)


@some
@given(st.floats(-0.6, 0.6), st.floats(0.0, 0.24))
def test_a_pose_beside_the_place_counts_by_its_variance(along: float, deviation: float) -> None:
    """Two measurements of one position, by the odometer and by the scan, weighed by the inverse of their variances."""
    where = settled(30.0)
    assert where.update(beside(30, along, deviation)) is Estimate.AGREES
    weights = np.array([1 / TRUST.odometer**2, 1 / max(deviation, 1e-6) ** 2])
    assert where.along == pytest.approx(float(weights @ [30.0, 30.0 + along]) / weights.sum(), abs=1e-6)
    assert where.beside is not None


@pytest.mark.parametrize(("deviation", "heading", "kept"), [(0.5, 0.0, True), (0.01, 0.5, False)])
def test_a_pose_that_tells_less_than_its_place_or_is_in_a_turn_moves_nothing(
    deviation: float, heading: float, *, kept: bool
) -> None:
    where, without = settled(30.0), settled(30.0)
    where.update(beside(31, -0.6, deviation, heading))
    without.update(replace(beside(31, -0.6, deviation, heading), pose=None))
    assert where.along == without.along
    # Along a bare corridor it still tells how far aside the robot is.
    assert (where.beside is not None) is kept


@some
@given(st.sampled_from(KINDS), st.floats(0.0, 60.0))
def test_a_single_wrong_view_does_not_move_it(kind: str, x: float) -> None:
    where = settled(x)
    before = where.along
    pose = pose_beside((0.5, 0.5, 0.1), np.eye(3) * 1e-4)
    assert where.update(replace(wrong(kind, x), pose=pose)) in (Estimate.DOUBTS, Estimate.LOST)
    assert where.along == before
    assert where.beside is None
    assert not where.lost
    assert where.update(seen_at(WAY.along, x)) is Estimate.AGREES
    assert where.doubts == where.losses == 0


@some
@given(st.lists(st.sampled_from([*KINDS, "right"]), max_size=30), st.integers(0, 10**6))
def test_it_jumps_only_where_views_agree_with_each_other(kinds: list[str], seed: int) -> None:
    """Wrong views in any order, each elsewhere than the one before: never a jump, at most a share of ``near``."""
    rng, where, last = np.random.default_rng(seed), settled(30.0), 0.0
    for kind in kinds:
        at = where.along
        if kind == "elsewhere":
            far = (last + rng.uniform(5.0, 15.0)) % 20.0  # on other places each time, and never near 30 m
            last, belief = far, seen_at(WAY.along, far)
        else:
            belief = seen_at(WAY.along, 30.0) if kind == "right" else wrong(kind, 30.0)
        word = where.update(belief)
        assert word is not Estimate.MOVED
        assert abs(where.along - at) <= TRUST.share * TRUST.near
        assert (where.along == at) or word is Estimate.AGREES
        assert where.lost == (where.losses >= TRUST.lost or where.doubts >= 2 * TRUST.lost)


@some
@given(confirm=st.integers(1, 6), to=st.floats(1.0, 45.0), before=st.integers(0, 4))
def test_a_kidnapping_is_taken_after_as_many_views_as_asked(confirm: int, to: float, before: int) -> None:
    """While it goes on and the odometer counts; a view that says lost in between begins the count again."""
    assume(abs(to - 30.0) > 3.0)
    where = ProgressFilter(WAY, ProgressSettings(confirm=confirm), 30.0)
    where.update(seen_at(WAY.along, 30.0))
    for _ in range(min(before, confirm - 1)):
        assert where.update(seen_at(WAY.along, to)) is Estimate.DOUBTS
    assert where.update(lost(COUNT)) is Estimate.LOST
    words = []
    for number in range(confirm):
        x = to + 2.0 * number
        words.append(where.update(seen_at(WAY.along, x)))
        if number < confirm - 1:
            assert where.along == pytest.approx(30.0 + 2.0 * number)
            where.move(2.0)
    assert words == [Estimate.DOUBTS] * (confirm - 1) + [Estimate.MOVED]
    assert where.along == pytest.approx(x, abs=0.3)
    assert (where.doubts, where.losses, where.agreements) == (0, 0, 1)


def test_a_view_that_agrees_puts_right_a_share() -> None:
    where = ProgressFilter(WAY, TRUST, 30.0)
    assert where.update(seen_at(WAY.along, 31.0, width=0.1)) is Estimate.AGREES
    assert where.along == pytest.approx(30.0 + TRUST.share * 1.0, abs=1e-3)


def test_a_belief_that_says_lost_agrees_to_nothing() -> None:
    where = ProgressFilter(WAY, ProgressSettings(sure=0.1), 30.0)
    assert where.update(seen_at(WAY.along, 30.0, lost=0.6)) is Estimate.LOST
    assert where.update(seen_at(WAY.along, 30.0, lost=0.4)) is Estimate.AGREES


def test_it_is_lost_after_so_many_views_that_say_so() -> None:
    where = settled(30.0)
    for number in range(1, 6):
        assert where.update(lost(COUNT)) is Estimate.LOST
        assert where.losses == number
        assert where.lost == (number >= TRUST.lost)
        assert where.agreements == 0
    where.update(seen_at(WAY.along, 30.0))
    assert not where.lost
    assert where.agreements == 1


def test_a_place_that_is_not_on_the_way_is_none() -> None:
    """The map has places that the way does not lead through: to be there is to be lost."""
    part = way(20.0)
    whole = np.arange(0.0, 60.5, 1.0)
    where = ProgressFilter(part, TRUST, 5.0)
    assert where.update(seen_at(whole, 5.0)) is Estimate.AGREES
    assert where.update(seen_at(whole, 40.0)) is Estimate.LOST
    assert where.update(seen_at(whole, 15.0)) is Estimate.DOUBTS


def test_the_odometer_alone_carries_it_on() -> None:
    where = ProgressFilter(WAY, TRUST, 3.0)
    for _ in range(100):
        where.move(0.1)
    assert where.along == pytest.approx(13.0)


def test_a_position_that_views_told_is_their_mean_at_first() -> None:
    """A place off at the jump, then right ones: half of the error is left after one, a third after two."""
    places = WAY.along.tolist()
    right, off = places[30], places[31]
    where = settled(5.0)
    for _ in range(TRUST.confirm):
        word = where.update(seen_at(WAY.along, off, width=0.05))
    assert word is Estimate.MOVED
    assert where.along == pytest.approx(off, abs=1e-3)
    for number in range(2, 12):
        before = where.along
        where.update(seen_at(WAY.along, right, width=0.05))
        share = max(1 / number, TRUST.share)
        assert where.along == pytest.approx(before + share * (right - before), abs=2e-3)


@some
@given(st.integers(1, 4), st.sampled_from([0.1, 0.3, 0.45, 0.55, 0.8]))
def test_a_place_counts_once_however_many_views_of_the_way_lie_at_it(every: int, share: float) -> None:
    """Where most of a belief is does not depend on where the robot dawdled when the way was learnt."""
    places = np.repeat(np.arange(20), every)
    of = MissionPath(places, 0.8 * places, ("",) * len(places), ())
    where = ProgressFilter(of, TRUST, 8.0)
    belief = belief_from(np.where(np.arange(20) == 10, share, 0.0) + np.where(np.arange(20) == 18, 1.0 - share, 0.0))
    assert where.update(belief) is (Estimate.AGREES if share > TRUST.sure else Estimate.DOUBTS)
    assert where.along == pytest.approx(8.0)


def test_a_belief_in_a_place_speaks_for_the_one_that_a_loop_makes_the_same() -> None:
    """On the stretch that a closed path drives twice, the robot goes on from either pass, and jumps to neither."""
    count = 40
    twins = np.column_stack([np.arange(10), np.arange(30, 40)])
    of = replace(way(count - 1.0), twins=twins)
    assert len(of.places) == count
    for start in (3, 33):
        where = ProgressFilter(of, TRUST, float(start))
        for number in range(5):
            first, second = (seen_at(of.along, start % 30 + number + pass_, width=0.3).places for pass_ in (0.0, 30.0))
            for split in (0.0, 0.3, 1.0):
                assert where.update(belief_from(split * first + (1 - split) * second)) is Estimate.AGREES
            assert where.along == pytest.approx(start + number, abs=0.1)
            where.move(1.0)


@pytest.mark.parametrize("share", [0.2, 0.8])
@pytest.mark.parametrize(("start", "right"), [(30.5, 33.0), (5.5, 3.0)])
def test_of_places_that_a_loop_makes_one_the_nearer_is_meant(start: float, right: float, share: float) -> None:
    """An odometer that is off by more than it may be does not have a closed path driven anew, or its rest left out."""
    twins = np.column_stack([np.arange(10), np.arange(30, 40)])
    of = replace(way(39.0), twins=twins)
    where = ProgressFilter(of, TRUST, start)
    first, second = (seen_at(of.along, at, width=0.3).places for at in (right % 30, right % 30 + 30))
    for _ in range(TRUST.confirm):
        word = where.update(belief_from(share * first + (1 - share) * second))
    assert word is Estimate.MOVED
    assert where.along == pytest.approx(right, abs=0.1)
