import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.scoring.outcome import OFF_MAP, ON_MAP, Outcome
from refseq_bench.scenarios.scoring.recovery import Recovery, first_fix, recovery_of

R, W, M = Outcome.RIGHT, Outcome.WRONG, Outcome.MISSED
F, X = Outcome.FALSE_FIX, Outcome.REJECTED


def along(*xs: float) -> list[View]:
    """Views at these places of a straight line, to which the odometer's distances fit."""
    steps = [0.0, *(later - earlier for earlier, later in itertools.pairwise(xs))]
    return [View(0.0, distance=step, truth=Pose(x, 0.0, 0.0)) for x, step in zip(xs, steps, strict=True)]


def test_ways_are_counted_from_the_first_view_of_an_episode() -> None:
    views = along(0, 1, 3, 6, 10, 15, 21)
    found = recovery_of(views, [R, F, F, X, W, W, R])
    assert found == Recovery(to_lost=(5.0,), to_recover=(11.0,))


def test_what_is_never_noticed_has_no_way() -> None:
    assert recovery_of(along(0, 1, 2, 3, 4), [R, F, F, W, M]) == ((None,), (None,))


def test_to_notice_at_once_takes_no_way() -> None:
    assert recovery_of(along(0, 1, 2), [R, X, R]) == ((0.0,), (0.0,))


def test_where_a_drive_begins_nothing_was_left_or_entered() -> None:
    assert recovery_of(along(0, 1, 2), [X, F, X]) == ((), ())
    assert recovery_of(along(0, 1, 2), [W, R, R]) == ((), ())
    assert recovery_of(along(0, 1, 2), [X, W, R]) == ((), (1.0,))


def test_being_carried_to_another_place_is_an_episode_and_no_way() -> None:
    views = along(0, 1, 2, 3, 4)
    carried = [*views[:2], *(replace(view, truth=Pose(view.truth.x + 40, 0, 0)) for view in views[2:])]
    assert recovery_of(carried, [R, R, W, W, R]) == ((), (2.0,))
    assert recovery_of(views, [R, R, W, W, R]) == ((), ())
    assert first_fix(carried, [W, W, W, W, R]) == pytest.approx(3.0)


def test_a_short_way_on_a_person_s_arms_shows_however_far_the_robot_had_come() -> None:
    """Ten metres by itself, then 4 m where its odometer has 1 m; and 1 m by itself to the right answer."""
    carried = [View(0.0, distance=1.0, truth=Pose(x, 0.0, 0.0)) for x in (14.0, 15.0)]
    assert recovery_of([*along(*range(11)), *carried], [*[R] * 11, W, R]) == ((), (1.0,))


def test_a_robot_that_reverses_is_not_carried() -> None:
    back = along(9, 4, -1)
    assert recovery_of(back, [R, R, W]) == ((), ())
    assert first_fix(back, [W, R, R]) == 5.0


@pytest.mark.parametrize(
    ("outcomes", "to_lost"),
    [([R, F, F, X, X, X], (2.0,)), ([R, F, F, F, F, X], (3.0,)), ([R, F, F, F, F, F], (None,)), ([X] * 6, ())],
)
def test_being_carried_while_off_the_map_is_no_leaving(outcomes: list[Outcome], to_lost: tuple[float | None]) -> None:
    """The robot leaves the map once; nor does being carried there end the way to saying lost."""
    views = along(0, 1, 2, 3, 4, 5)
    carried = [*views[:4], *(replace(view, truth=Pose(view.truth.x + 200, 0, 0)) for view in views[4:] if view.truth)]
    assert recovery_of(carried, outcomes) == (to_lost, ())


def test_without_odometry_nobody_is_taken_to_be_carried() -> None:
    views = [replace(view, distance=0.0) for view in along(0, 9, 18)]
    assert recovery_of(views, [R, W, R]) == ((), ())
    assert first_fix(views, [W, W, R]) == 18.0


def test_views_without_a_pose_are_passed_over_but_their_motion_counts() -> None:
    views = along(0, 1, 2, 3, 4)
    blind = [views[0], *(replace(view, truth=None) for view in views[1:4]), views[4]]
    assert recovery_of(blind, [R, *[Outcome.UNSCORED] * 3, W]) == ((), ())
    assert first_fix(blind, [W, *[Outcome.UNSCORED] * 3, R]) == 4.0


@given(st.lists(st.sampled_from([R, W, M, F, X]), min_size=1, max_size=15))
def test_every_change_is_one_episode(outcomes: list[Outcome]) -> None:
    found = recovery_of(along(*range(len(outcomes))), outcomes)
    pairs = list(itertools.pairwise(outcomes))
    assert len(found.to_lost) == sum(a in ON_MAP and b in OFF_MAP for a, b in pairs)
    assert len(found.to_recover) == sum(a in OFF_MAP and b in ON_MAP for a, b in pairs)
    ways = [way for way in (*found.to_lost, *found.to_recover) if way is not None]
    assert all(0 <= way <= len(outcomes) for way in ways)
    assert (X in outcomes[1:] and R in outcomes[:1]) <= bool(found.to_lost)
