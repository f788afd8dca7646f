"""Joins, forks and jumps on drives whose poses are written down: counted by hand, or by the plainest of means."""

import math
from collections.abc import Sequence
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq.planar import Pose
from refseq.view import ASSUMED, View
from refseq_bench.scenarios.campaign.declare.figures import FIGURES
from refseq_bench.scenarios.scoring.atlas import (
    AtlasScore,
    JoinScore,
    atlas_score,
    join_score,
    p_right,
    passing,
    pool_atlas,
)
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import Figures, figures, figures_record
from refseq_bench.scenarios.scoring.merging import Merging
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath, Tolerance, path_of
from refseq_bench.scenarios.scoring.proportion import Proportion
from refseq_bench.scenarios.scoring.tables.score_tables import join_cells
from tests.scenarios.forks import (
    AHEAD,
    ASIDE,
    COUNT,
    DRIVES,
    FALSE,
    PARTING,
    RIGHTLY,
    SHARED,
    UP,
    compared,
    known,
    merging,
    split,
    views,
)
from tests.support import certain

PATH = path_of(compared([], {}))
TRUE_PLACES = [*range(11), *range(32, 40)]
"""Where the parting query is: in the merged corridor, then on the second drive."""


def joined(found: Merging, tolerance: Tolerance = WIDE) -> JoinScore:
    return join_score(PATH, found, tolerance)


# --- joins ---


def test_what_is_joined_where_it_belongs_is_all_right() -> None:
    found = joined(merging(RIGHTLY, SHARED))
    assert found.precision == Proportion(11, 11)
    assert found.recall == Proportion(22, 22)  # each of the eleven counts for either drive
    assert (found.duplicates, found.places, found.views) == (0, COUNT - 11, COUNT)
    assert (found.joins, found.false_joins, found.overlooked) == (1, 0, 0)
    assert (found.bytes_before, found.bytes_after, found.seconds) == (4700, 3600, 0.25)


def test_what_is_not_joined_is_there_twice() -> None:
    found = joined(merging({}, replace(SHARED, joined=False)))
    assert found.precision == Proportion(0, 0)
    assert found.recall == Proportion(0, 22)
    assert (found.duplicates, found.places) == (22, COUNT)
    assert (found.joins, found.false_joins, found.overlooked) == (0, 0, 1)


def test_a_place_may_be_as_far_off_as_an_answer_may() -> None:
    one_off = {21 + k: k + 1 for k in range(11)}
    two_off = {21 + k: k + 2 for k in range(11)}
    assert joined(merging(one_off)).precision == Proportion(11, 11)
    assert joined(merging(two_off)).precision == Proportion(0, 11)
    assert joined(merging(two_off), Tolerance(2.0)).precision == Proportion(11, 11)
    assert joined(merging(one_off), Tolerance(0.5)).precision == Proportion(0, 11)


def test_a_view_in_another_direction_is_another_place() -> None:
    # (10, 1) looking up is a metre from (10, 0), which looks along x.
    assert joined(merging({32: 10})).precision == Proportion(0, 1)
    assert join_score(PATH, merging({32: 10}), Tolerance(1.5, UP)).precision == Proportion(1, 1)


def test_a_false_join_takes_places_out_and_finds_nothing_shared() -> None:
    found = joined(merging({**RIGHTLY, **{21 + k: k for k in range(12, 17)}}, SHARED, FALSE))
    assert found.precision == Proportion(11, 16)
    assert found.recall == Proportion(22, 22)
    assert (found.joins, found.false_joins, found.overlooked, found.places) == (2, 1, 0, COUNT - 16)


@pytest.mark.parametrize(("first", "last", "false"), [(4, 7, 1), (3, 7, 0), (3, 8, 1), (0, 5, 0), (6, 10, 1)])
def test_a_join_is_right_if_most_of_its_views_are(first: int, last: int, false: int) -> None:
    """Of the second drive's views 0 to 5 are beside views 0 to 4 of the first, and none behind them."""
    decision = replace(SHARED, first=(0, 4), second=(first, last))
    assert joined(merging({}, decision)).false_joins == false
    assert joined(merging({}, replace(decision, joined=False))).overlooked == 1 - false


def test_drives_that_join_a_third_share_with_it_and_not_with_who_stayed_apart() -> None:
    corridor = {name: views(*((float(x), 0.0, 0.0) for x in range(5))) for name in "abc"}
    path = path_of(compared([], {}, drives=corridor))
    found = join_score(path, merging({5 + k: k for k in range(5)}, drives=corridor), WIDE)
    assert found.recall == Proportion(10, 30)
    assert found.duplicates == 10  # the first one's and the third one's
    all_ = join_score(path, merging({k: k % 5 for k in range(5, 15)}, drives=corridor), WIDE)
    assert (all_.recall, all_.duplicates, all_.places) == (Proportion(30, 30), 0, 5)


POSES = st.tuples(st.integers(0, 6), st.integers(0, 1), st.sampled_from([0.0, math.pi])) | st.none()


@st.composite
def merged(draw: st.DrawFn) -> tuple[list[list[View]], Merging]:
    """A few drives over a grid of a metre, some poses unknown, and any views of theirs held by others."""
    drives = [views(*draw(st.lists(POSES, min_size=1, max_size=6))) for _ in range(draw(st.integers(1, 3)))]
    drives[0] = views((0.0, 0.0, 0.0)) + drives[0]
    count = sum(map(len, drives))
    holders = sorted(draw(st.sets(st.integers(0, count - 1), min_size=1)))
    held_by = [k if k in holders else draw(st.sampled_from(holders)) for k in range(count)]
    names = tuple("abc"[: len(drives)])
    found = merging(dict(enumerate(held_by)), drives=dict(zip(names, drives, strict=True)))
    return drives, found


def near(one: View, other: View, within: float) -> bool:
    if one.truth is None or other.truth is None:
        return False
    apart = math.dist((one.truth.x, one.truth.y), (other.truth.x, other.truth.y))
    return apart <= within and one.truth.heading == other.truth.heading


@given(merged(), st.sampled_from([1.0, 1.5, 2.0, 3.0]))
def test_joins_are_those_of_a_plain_count(drives_and_merging: tuple[list[list[View]], Merging], within: float) -> None:
    drives, found = drives_and_merging
    everything = [view for drive in drives for view in drive]
    drive = [number for number, one in enumerate(drives) for _ in one]
    held = found.held_by.tolist()
    taken = [k for k in range(len(held)) if held[k] != k]
    right = [k for k in taken if near(everything[k], everything[held[k]], within)]
    shared, met = 0, 0
    for k, view in enumerate(everything):
        for other in set(drive) - {drive[k]}:
            beside = [j for j, its in enumerate(everything) if drive[j] == other and near(view, its, within / 2)]
            shared += bool(beside)
            met += any(drive[held[j]] == drive[held[k]] for j in beside)
    twice = [
        k
        for k in set(held)
        if any(drive[j] != drive[k] and near(everything[k], everything[j], within / 2) for j in set(held))
    ]
    path = path_of(compared([], {}, drives=dict(zip(found.names, drives, strict=True))))
    score = join_score(path, found, Tolerance(within))
    assert score.precision == Proportion(len(right), len(taken))
    assert score.recall == Proportion(met, shared)
    assert (score.duplicates, score.places, score.views) == (len(twice), len(set(held)), len(everything))


# --- which drives pass, and how probable the right ones are ---


@given(st.lists(st.lists(st.booleans(), min_size=COUNT, max_size=COUNT), min_size=1, max_size=4))
def test_a_drive_passes_where_one_of_its_views_is_near(rows: list[list[bool]]) -> None:
    found = passing(PATH, np.array(rows))
    ends = (0, 21, 42, COUNT)
    assert found.tolist() == [[any(row[ends[d] : ends[d + 1]]) for d in range(3)] for row in rows]


def test_what_is_right_is_all_that_is_near_and_nothing_of_what_is_lost() -> None:
    beliefs = [split({0: 0.5, 1: 0.25, 21: 0.25}), split({0: 0.5, 1: 0.25, 21: 0.25}, lost=0.5), split({3: 1.0})]
    right = np.zeros((3, COUNT), bool)
    right[:, [0, 21]] = True
    assert p_right(beliefs, right) == pytest.approx([0.75, 0.375, 0.0])


# --- forks ---


def forks(query: Sequence[View], sure: Sequence[float]) -> tuple[float | None, ...]:
    """The ways after forks, where so much of each belief is right."""
    near = [np.flatnonzero(PATH.within(view.truth, WIDE)).tolist() for view in query]
    beliefs = [split({(places or [46])[0]: p, 44: 1 - p}) for places, p in zip(near, sure, strict=True)]
    return atlas_score(compared(query, {"m": beliefs}), "m", WIDE).forks


def test_the_way_after_a_fork_ends_where_the_right_places_are_probable() -> None:
    before = [1.0] * 11
    assert forks(PARTING, [*before, *[0.95] * 8]) == (0.0,)
    assert forks(PARTING, [*before, 0.1, 0.5, 0.85, 0.95, *[0.1] * 4]) == (3.0,)
    assert forks(PARTING, [*before, *[0.89] * 8]) == (None,)
    nine_tenths = [certain(COUNT, place, 0.1) for place in TRUE_PLACES]
    assert atlas_score(compared(PARTING, {"m": nine_tenths}), "m", WIDE).forks == (None,)
    assert forks(PARTING, [*[0.0] * 11, 0.91, *[0.0] * 7]) == (0.0,)


def test_a_fork_needs_a_drive_that_is_left_and_another_that_is_not() -> None:
    assert forks(AHEAD, [1.0] * 21) == (0.0,)  # the second drive leaves at 10 m
    alone = {"ahead": AHEAD}
    found = atlas_score(compared(AHEAD, {"m": known(*range(21), count=21)}, drives=alone), "m", WIDE)
    assert found.forks == ()
    both = views((30.0, 0.0, 0.0), *((float(x), 0.0, 0.0) for x in range(3)), (30.0, 0.0, 0.0))
    assert forks(both, [1.0] * 5) == ()  # leaving the map is not choosing between drives


def test_a_drive_that_is_missed_for_a_view_or_two_is_not_left() -> None:
    gap = {"ahead": AHEAD, "aside": [v for k, v in enumerate(AHEAD) if k not in range(8, 12)], "e": AHEAD[:1]}
    query = AHEAD[:17]
    path = path_of(compared([], {}, drives=gap))
    near = np.array([path.within(view.truth, WIDE) for view in query])
    assert passing(path, near)[:, 1].tolist() == [True] * 9 + [False] * 2 + [True] * 6
    count = path.size
    found = atlas_score(compared(query, {"m": [certain(count, k) for k in range(17)]}, drives=gap), "m", WIDE)
    assert found.forks == (0.0,)  # the third is left after its only place; the second never


def test_what_is_known_after_leaving_the_map_comes_too_late() -> None:
    off = [replace(view, truth=Pose(90.0, 0.0, 0.0)) for view in PARTING[14:16]]
    query = [*PARTING[:14], *off, *PARTING[16:]]
    sure = [*[1.0] * 11, 0.1, 0.1, 0.1, 1.0, 1.0, 1.0, 1.0, 1.0]
    assert forks(query, sure) == (None,)
    assert forks(PARTING, sure) == (3.0,)


# --- jumps ---


def jumps(query: Sequence[View], places: Sequence[int], lost: Sequence[int] = ()) -> int | None:
    beliefs = [certain(COUNT, place, 0.6 if t in lost else 0.0) for t, place in enumerate(places)]
    return atlas_score(compared(query, {"m": beliefs}), "m", WIDE).jumps


def test_an_answer_that_no_drive_can_have_led_to_is_a_jump() -> None:
    query = AHEAD[:6]
    assert type(jumps(query, [0, 1, 2, 3, 4, 5])) is int
    assert jumps(query, [0, 1, 2, 3, 4, 5]) == 0
    assert jumps(query, [0, 1, 22, 23, 4, 5]) == 0  # the same spot, by the other drive
    assert jumps(query, [0, 1, 5, 3, 4, 5]) == 0  # 4 m in 1 m and 2 m back: within twice the tolerance
    assert jumps(query, [0, 1, 6, 3, 4, 5]) == 1  # 5 m in 1 m; back it is 3 m
    assert jumps(query, [0, 1, 42, 3, 4, 5]) == 2  # there and back
    assert jumps(query, [0, 1, 42, 43, 44, 45]) == 1


def test_who_says_lost_between_has_had_the_time() -> None:
    query = AHEAD[:8]
    assert jumps(query, [0, 1, 1, 1, 1, 1, 8, 9]) == 1  # 7 m in 1 m
    assert jumps(query, [0, 1, 1, 1, 1, 1, 8, 9], lost=range(2, 6)) == 0  # 7 m in 5 m
    assert jumps(query, [0, 1, 42, 3, 4, 5, 6, 7], lost=[2]) == 0


def test_answers_off_the_map_are_no_jumps_and_what_is_behind_is_measured_from_the_last_one_on_it() -> None:
    off = replace(AHEAD[2], truth=Pose(90.0, 0.0, 0.0))
    assert jumps([*AHEAD[:2], off, *AHEAD[3:6]], [0, 1, 42, 3, 4, 5]) == 0
    assert jumps([*AHEAD[:2], off, *AHEAD[3:6]], [0, 1, 42, 43, 44, 45]) == 1
    unknown = replace(AHEAD[2], truth=None)
    assert jumps([*AHEAD[:2], unknown, *AHEAD[3:6]], [0, 1, 42, 3, 4, 5]) == 0


def test_backing_is_a_way_too() -> None:
    query = [*AHEAD[:5], replace(AHEAD[4], distance=-4.0)]
    assert jumps(query, [0, 1, 2, 3, 7, 0]) == 0  # 7 m back in 4 m
    assert jumps(AHEAD[:6], [0, 1, 2, 3, 7, 0]) == 1


@pytest.mark.parametrize("assumed", [True, False])
def test_without_odometry_nobody_knows_of_jumps_and_forks_are_measured_by_the_truth(assumed: bool) -> None:
    """An odometer that stood still made a jump of each right answer, and settled every fork at once."""
    query = [replace(view, distance=0.1 if assumed else 0.0) for view in PARTING]
    sure = [*[1.0] * 11, 0.1, 0.1, 0.1, *[1.0] * 5]
    beliefs = [split({place: p, 44: 1 - p}) for place, p in zip(TRUE_PLACES, sure, strict=True)]
    run = compared(query, {"m": beliefs})
    run = replace(run, query_metadata={"odometry": f"{ASSUMED} 0.1 m a picture"} if assumed else {})
    found = atlas_score(run, "m", WIDE)
    assert found.jumps is None
    assert found.forks == (3.0,)
    assert math.isnan(taken(figures([run])[0], "jumps"))
    assert atlas_score(replace(run, query_views=PARTING, query_metadata={}), "m", WIDE).jumps is not None


# --- P(s) ---


def test_the_share_of_the_driven_sequence_before_on_and_behind_a_fork() -> None:
    """The robot begins on the corridor of two drives and leaves it along the second; another is on the first alone."""
    beliefs = [*(split({0: 0.5, 21: 0.3, 42: 0.2}),) * 11, *(split({12: 0.25, 33: 0.75}),) * 8]
    shares = atlas_score(compared(PARTING, {"m": beliefs}), "m", WIDE).shares
    # View 11 is 1 m behind the fork: the first drive is within the tolerance still.
    assert shares.before == ()
    assert shares.on == pytest.approx((0.3,) * 11 + (0.75,) * (len(shares.on) - 11))
    assert len(shares.on) + len(shares.behind) == len(PARTING)
    assert set(shares.behind) == {0.75}
    beyond = views(*((float(x), 0.0, 0.0) for x in range(12, 21)))
    alone = atlas_score(compared(beyond, {"m": [split({15: 0.9, 30: 0.1})] * 9}), "m", WIDE).shares
    assert alone.before == pytest.approx((0.9,) * 9)
    assert alone[1:] == ((), ())


def test_a_shared_stretch_that_the_robot_never_leaves_has_no_share() -> None:
    corridor = views(*((float(x), 0.0, 0.0) for x in range(9)))
    shares = atlas_score(compared(corridor, {"m": known(*range(9))}), "m", WIDE).shares
    assert shares == ((), (), ())


# --- several runs, and the figures ---


@pytest.fixture(scope="module")
def run() -> Comparison:
    """A merged and an unmerged method, and one that has no atlas."""
    beliefs = [*known(*range(11)), split({15: 0.6, 32: 0.4}), split({33: 0.9, 14: 0.1}), *known(*range(34, 40))]
    methods = {"whole": beliefs, "apart": known(*TRUE_PLACES), "other": known(*[42] * 19)}
    false = merging({**RIGHTLY, 33: 12}, SHARED, replace(FALSE, second=(12, 12), first=(12, 12)))
    return compared(PARTING, methods, {"whole": false, "apart": merging({}, replace(SHARED, joined=False))})


def taken(found: Figures, name: str) -> float:
    return FIGURES[name].take(found)


def test_figures_to_expect_are_those_of_the_atlas(run: Comparison) -> None:
    whole, apart, other = figures([run])
    assert [taken(whole, name) for name in ("join_precision", "join_recall")] == [11 / 12, 1.0]
    assert [taken(apart, name) for name in ("join_recall", "places_left", "duplicates")] == [0.0, 1.0, 22]
    assert [taken(whole, name) for name in ("false_joins", "duplicates")] == [1, 0]
    assert [taken(apart, name) for name in ("false_joins", "duplicates")] == [0, 22]
    assert taken(whole, "places_left") == 35 / 47
    assert taken(whole, "bytes_left") == 3600 / 4700
    # The neighbour a metre on is within the tolerance: what is at 33 counts as right at view 12, 0.9 is not above 0.9.
    assert [taken(one, "to_settle") for one in (whole, apart, other)] == [2.0, 0.0, math.inf]
    assert [taken(one, "jumps") for one in (whole, apart, other)] == [2, 0, 0]
    for name in ("join_precision", "join_recall", "false_joins", "duplicates", "places_left", "bytes_left"):
        assert math.isnan(taken(other, name))
    assert math.isnan(taken(apart, "join_precision"))


def test_one_drive_has_no_figures_of_an_atlas() -> None:
    alone = compared(AHEAD, {"m": known(*range(21), count=21)}, drives={"ahead": AHEAD})
    for comparison in (alone, replace(alone, drives=None)):
        (found,) = figures([comparison])
        assert found.atlas is None
        assert all(math.isnan(taken(found, name)) for name in ("to_settle", "jumps", "join_recall", "places_left"))
        assert "jumps_views" not in figures_record(found)


def test_runs_are_added_up(run: Comparison) -> None:
    whole, _, other = figures([run, run])
    assert whole.atlas is not None
    assert other.atlas is not None
    once = atlas_score(run, "whole", WIDE)
    assert once.joined is not None
    assert whole.atlas.joined is not None
    assert whole.atlas.forks == once.forks * 2
    assert whole.atlas.jumps == 2 * once.jumps
    plain = astuple(once.joined)[2:]
    assert astuple(whole.atlas.joined)[2:] == tuple(2 * one for one in plain)
    assert whole.atlas.joined.precision == Proportion(22, 24)
    assert whole.atlas.joined.recall == Proportion(44, 44)
    assert other.atlas.joined is None
    assert pool_atlas([once, AtlasScore((None,), 3, None)]) == AtlasScore(
        (*once.forks, None), once.jumps + 3, once.joined, once.shares
    )


def test_the_record_and_the_table_tell_the_same(run: Comparison) -> None:
    found = figures([run])
    whole, apart, other = map(figures_record, found)
    told = {
        "fork_median_m": 2.0,
        "fork_times": 1,
        "fork_never_times": 0,
        "sequence_before_mean": None,
        "sequence_on_mean": 0.0,
        "jumps_views": 2,
        "joins_precision_right_views": 11,
        "joins_precision_of_views": 12,
        "joins_recall_joined_views": 22,
        "joins_recall_of_views": 22,
        "duplicate_places": 0,
        "joins": 2,
        "false_joins": 1,
        "overlooked_joins": 0,
        "atlas_places": 35,
        "learnt_views": 47,
        "maps_bytes": 4700,
        "atlas_bytes": 3600,
        "merging_s": 0.25,
    }
    assert {name: whole[name] for name in told} == told
    assert (apart["joins"], apart["overlooked_joins"]) == (0, 1)
    assert other["fork_never_times"] == 1
    assert "joins" not in other
    assert found[0].atlas is not None
    assert join_cells(found[0].atlas.joined) == [
        "2 (1)",
        f"91.7 [{100 * Proportion(11, 12).interval[0]:.0f}, {100 * Proportion(11, 12).interval[1]:.0f}]",
        "100.0 [85, 100]",
        "35 of 47",
        "0",
        "4 of 5",
    ]
    assert set(join_cells(None)) == {"n/a"}


def test_a_path_of_drives_is_that_of_the_comparison(run: Comparison) -> None:
    assert path_of(run).stretches == PATH.stretches == (slice(0, 21), slice(21, 42), slice(42, 47))
    assert ReferencePath([*AHEAD, *ASIDE]).stretches == (slice(0, 42),)
    assert list(DRIVES) == ["ahead", "aside", "elsewhere"]
