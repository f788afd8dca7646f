"""Several drives learnt together: how answers are scored along them, and what methods answer that have learnt them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from refseq.belief import Stage
from refseq.map.map import Map, beside
from refseq.map.matcher import Matcher
from refseq.map.profile import PROFILES
from refseq.map.tracking.trackers import SureView
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.methods.baselines import BASELINES
from refseq_bench.scenarios.methods.by_name import Learnt
from refseq_bench.scenarios.methods.reference import Reference
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import WIDE, ReferencePath
from refseq_bench.scenarios.scoring.score import Score, score
from tests.refseq.walks import Leg, Town, apart
from tests.scenarios.forks import AHEAD, ASIDE, COUNT, DRIVES, PARTING, RIGHTLY, UP, compared, known, merging, views
from tests.support import certain, corridor_comparison, corridor_drive


def judged(query: Sequence[View], *places: int) -> Score:
    return score(compared(query, {"m": known(*places)}), "m")


# --- the drives ---


def test_drives_stand_one_behind_the_other() -> None:
    drives = Drives(("a", "b", "c"), (3, 1, 2))
    assert drives.stretches == (slice(0, 3), slice(3, 4), slice(4, 6))
    comparison = compared([], {}, {"m": merging(RIGHTLY)})
    assert comparison.stretches == (slice(0, 21), slice(21, 42), slice(42, 47))
    assert replace(comparison, drives=None).stretches == (slice(0, COUNT),)


def test_views_are_at_their_own_places_but_for_methods_that_merged_them() -> None:
    comparison = compared([], {}, {"m": merging(RIGHTLY)})
    assert comparison.held_by("m").tolist() == [*range(21), *range(11), *range(32, 47)]
    assert comparison.held_by("other").tolist() == list(range(47))


def test_answers_are_about_the_views_of_all_drives() -> None:
    with pytest.raises(ScenarioError, match="best place 20 of 21; valid is one of the map's 47 places"):
        compared(AHEAD[:1], {"m": known(20, count=21)})


POSES = st.tuples(st.integers(0, 8), st.integers(0, 3), st.sampled_from([0.0, 0.3, UP, math.pi]))
SOME = st.lists(POSES | st.none(), min_size=1, max_size=7)


@given(st.lists(SOME, min_size=1, max_size=3), POSES, st.integers(0, 20))
def test_along_each_drive_it_is_as_if_there_were_no_other(
    poses: list[list[tuple[float, float, float] | None]], query: tuple[float, float, float], drawn: int
) -> None:
    drives = [views(*one) for one in poses]
    assume(all(any(view.truth for view in drive) for drive in drives))
    path = ReferencePath([view for drive in drives for view in drive], Drives((), tuple(map(len, drives))).stretches)
    place = drawn % path.size
    number, start = path.drive(place), path.beside(place).start
    alone = ReferencePath(drives[number])
    pose = Pose(*query)
    assert drives[number][place - start] == [view for drive in drives for view in drive][place]
    assert path.error(place, pose, astray=False) == pytest.approx(
        alone.error(place - start, pose, astray=False), abs=1e-9, nan_ok=True
    )
    nearest = alone.nearest(pose)
    assert nearest is not None
    assert path.nearest(pose, path.beside(place)) == start + nearest
    assert np.diff(path.along[path.beside(place)]) == pytest.approx(np.diff(alone.along), abs=1e-9, nan_ok=True)


def test_the_way_goes_on_from_drive_to_drive_without_a_gap() -> None:
    path = ReferencePath([*AHEAD, *ASIDE], (slice(0, 21), slice(21, 42)))
    assert path.along.tolist() == [*range(21), *range(20, 41)]


def test_a_drive_without_a_pose_is_nobodys_place() -> None:
    drives = {"known": AHEAD, "unknown": views(None, None)}
    result = score(compared(AHEAD[:2], {"m": known(0, 22, count=23)}, drives=drives), "m")
    assert result.outcomes == (Outcome.RIGHT, Outcome.WRONG)
    assert result.errors.tolist()[0] == 0.0
    assert math.isnan(result.errors[1])
    assert result.places_off.tolist() == [0.0, math.inf]
    unknown = ReferencePath(views(None, None, None), (slice(0, 1), slice(1, 3)))
    assert not unknown.known
    assert unknown.nearest(Pose(0.0, 0.0, 0.0)) is None
    assert np.isnan(unknown.along).all()


# --- answers along them ---


def test_where_drives_are_side_by_side_either_is_right_and_measured_along_itself() -> None:
    query = views((3.2, 0.0, 0.0))
    for place in (3, 24):
        result = judged(query, place)
        assert result.outcomes == (Outcome.RIGHT,)
        assert result.errors == pytest.approx([-0.2])
        assert result.places_off.tolist() == [0]
    assert judged(query, 25).errors == pytest.approx([0.8])
    assert judged(query, 25).places_off.tolist() == [1]


def test_behind_the_fork_each_drive_has_its_own_way() -> None:
    up = views((10.0, 4.0, UP))
    right, ahead = judged(up, 36), judged(up, 32)
    assert (right.outcomes, ahead.outcomes) == ((Outcome.RIGHT,), (Outcome.WRONG,))
    assert right.errors == pytest.approx([1.0])  # the fork is at 10 m, (10, 4) at 14 m, view 36 at 15 m
    assert ahead.errors == pytest.approx([-3.0])
    assert ahead.places_off.tolist() == [-3]


def test_an_answer_on_a_drive_that_does_not_come_by_is_as_far_off_as_it_lies() -> None:
    up = views((10.0, 4.0, UP))
    result = judged([*up, *up], 13, 44)
    assert result.outcomes == (Outcome.WRONG, Outcome.WRONG)
    assert result.errors == pytest.approx([5.0, math.hypot(8.0, 46.0)])
    assert result.places_off.tolist() == [math.inf, math.inf]
    assert result.within_places(5).successes == 0


def test_what_is_off_all_drives_is_off_the_map() -> None:
    query = [*views((15.0, 0.0, 0.0)), *views((15.0, 0.0, UP)), *views((2.0, 49.0, 0.0))]
    result = judged(query, 15, 15, 44)
    assert result.outcomes == (Outcome.RIGHT, Outcome.FALSE_FIX, Outcome.RIGHT)
    assert result.false_fixes[1] == 0.0


# --- one drive is scored as it always was ---


def assert_same_score(one: Score, other: Score) -> None:
    for each in fields(Score):
        mine, its = getattr(one, each.name), getattr(other, each.name)
        if isinstance(mine, np.ndarray):
            assert np.array_equal(mine, its, equal_nan=mine.dtype.kind == "f"), each.name
        else:
            assert mine == its, each.name


@pytest.mark.parametrize("tolerance", [WIDE, replace(WIDE, distance=0.5)])
def test_one_drive_is_scored_as_if_there_had_never_been_several(tolerance: object) -> None:
    comparison = corridor_comparison(3, count=60, size=24)
    named = replace(comparison, drives=Drives(("only",), (60,)))
    path = ReferencePath(comparison.reference_views)
    for method, beliefs in comparison.beliefs.items():
        result = score(comparison, method, tolerance)  # type: ignore[arg-type]
        assert_same_score(result, score(named, method, tolerance))  # type: ignore[arg-type]
        wrong = 0
        for t, (view, belief) in enumerate(zip(comparison.query_views, beliefs, strict=True)):
            assert view.truth is not None
            nearest = path.nearest(view.truth)
            if result.outcomes[t] in (Outcome.RIGHT, Outcome.WRONG):
                assert nearest is not None
                assert result.errors[t] == path.along[belief.best] - path.project(view.truth)
                assert result.places_off[t] == belief.best - nearest
                wrong += result.outcomes[t] is Outcome.WRONG
        assert wrong, "nothing would tell an answer astray"


def test_on_one_drive_nobody_is_astray_however_far_off() -> None:
    """The way back of one drive is along it, and not as the crow flies."""
    there_and_back = [*AHEAD, *views(*((float(x), 2.0, math.pi) for x in range(20, -1, -1)))]
    one = Comparison("one", there_and_back, {}, views((5.0, 0.0, 0.0)), {}, {"m": [certain(42, 36)]})
    found = score(one, "m")
    assert found.errors == pytest.approx([20 + 2 + 15 - 5])
    assert found.places_off.tolist() == [31]
    two = replace(one, drives=Drives(("there", "back"), (21, 21)))
    assert score(two, "m").errors == pytest.approx([2.0])
    assert score(two, "m").places_off.tolist() == [math.inf]


# --- methods that learn several ---

TOWN = Town()
WALKS: Mapping[str, list[Leg]] = {
    "one": [("A", 0, 20), ("B", 0, 25)],
    "other": [("C", 0, 20), ("B", 0, 30), ("D", 0, 15)],
}
ASKED: list[Leg] = [("A", 8, 20), ("B", 0, 30), ("D", 0, 12)]
OURS = ("best/chain", "best/uniform", "thesis/chain")


def reference(legs: Sequence[Leg], seed: int) -> Reference:
    """A walk's views, and its maps by their features, which no extractor has to be asked for."""

    def shelf(profile: str, _learnt: object) -> Map:
        return Map.of(TOWN.learnt(legs, seed, PROFILES[profile]))

    return Reference(TOWN.views(legs, seed), shelf)


@pytest.fixture(scope="module")
def walks() -> dict[str, Reference]:
    return {name: reference(legs, seed) for seed, (name, legs) in enumerate(WALKS.items())}


@pytest.fixture(scope="module")
def asked() -> list[View]:
    return TOWN.views(ASKED, 9)


@pytest.fixture(scope="module")
def together(walks: dict[str, Reference]) -> Learnt:
    return Learnt(OURS, walks)


def everything(walks: Mapping[str, Reference]) -> list[View]:
    return [view for walk in walks.values() for view in walk.views]


def test_an_atlas_answers_by_the_views_that_were_learnt(
    together: Learnt, walks: dict[str, Reference], asked: list[View]
) -> None:
    found = together.answers([replace(view, truth=None) for view in asked])
    assert tuple(found) == OURS
    learnt = everything(walks)
    lengths = tuple(len(walk.views) for walk in walks.values())
    comparison = Comparison("walks", learnt, {}, asked, {}, found, Drives(tuple(walks), lengths), together.mergings)
    for method, beliefs in found.items():
        held = set(comparison.held_by(method).tolist())
        assert len(held) < len(learnt) - 15
        for belief in beliefs:
            assert set(np.flatnonzero(belief.places)) <= held
            assert belief.places.sum() == pytest.approx(1.0)
            assert belief.best in held
    assert score(comparison, "best/chain").success.value > 0.95
    truths = zip(asked, found["best/chain"], strict=True)
    assert np.mean([apart(view.truth, learnt[belief.best].truth) <= 1.5 for view, belief in truths]) > 0.95


def test_the_stages_of_a_profile_share_an_atlas_and_profiles_do_not(together: Learnt) -> None:
    assert together.mergings["best/chain"] is together.mergings["best/uniform"]
    assert together.mergings["best/chain"] is not together.mergings["thesis/chain"]
    assert set(together.mergings) == set(OURS)
    assert {name: len(one.maps) for name, one in together.ours.items()} == {"best": 2, "thesis": 2}
    for profile in ("best", "thesis"):
        held = together.mergings[f"{profile}/chain"].held_by
        places = sum(map(len, together.ours[profile].map.sequences))
        assert places == len(set(held.tolist())) < sum(together.mergings[f"{profile}/chain"].lengths)


def test_without_merging_each_drive_keeps_all_its_places(walks: dict[str, Reference], asked: list[View]) -> None:
    learnt = Learnt(("best/chain",), walks, merging=False)
    found = learnt.mergings["best/chain"]
    assert found.decisions == ()
    assert found.held_by.tolist() == list(range(110))
    assert [len(one) for one in learnt.ours["best"].map.sequences] == list(found.lengths) == [45, 65]
    maps = learnt.ours["best"].maps
    assert found.size == (sum(len(one.to_bytes()) for one in maps), len(beside(maps).to_bytes()))
    (beliefs,) = learnt.answers(asked).values()
    assert {len(belief.places) for belief in beliefs} == {110}


def test_baselines_learn_all_drives_one_behind_the_other() -> None:
    rng = np.random.default_rng(0)
    drive = corridor_drive(rng, 12, size=48)
    drives = {"first": Reference(drive[:5]), "second": Reference(drive[5:])}
    query = corridor_drive(rng, 6, brightness=0.7, size=48)
    learnt = Learnt(("fabmap", "hamming", "seqslam"), drives)
    assert (learnt.mergings, learnt.ours) == ({}, {})
    found = learnt.answers(query)
    for name in ("fabmap", "hamming", "seqslam"):
        localiser = BASELINES[name](Reference(drive))
        assert found[name] == [localiser.update(view) for view in query]
        assert len(found[name][0].places) == 12


def test_the_fork_is_as_it_is_written_down() -> None:
    assert sum(map(len, DRIVES.values())) == COUNT
    assert all(view.distance == (1.0 if k else 0.0) for drive in DRIVES.values() for k, view in enumerate(drive))
    assert len(PARTING) == 19


@pytest.mark.parametrize("count", [5, 12, 13, 20])
def test_a_sequence_in_which_a_view_shows_nothing_has_no_share_less_than_none(count: int) -> None:
    """Rounding makes the entropy of some numbers of equal places more than it can be; there was no belief then."""
    legs: Mapping[str, list[Leg]] = {"short": [("A", 0, count)], "long": [("B", 0, 17)]}
    drives = {name: reference(way, seed) for seed, (name, way) in enumerate(legs.items())}
    learnt = Learnt(("thesis/uniform",), drives, merging=False)
    blank, seen = TOWN.views([("B", 3, 5)], 9)
    blank = replace(blank, images={name: np.zeros_like(image) for name, image in blank.images.items()})
    for belief in learnt.answers([blank, seen])["thesis/uniform"]:
        assert (belief.places >= 0).all()
        assert belief.places.sum() == pytest.approx(1.0)
    short = learnt.ours["thesis"].map.sequences[0]
    (matched,) = Matcher(Map.of(short)).match(blank)
    belief, sure = SureView(Stage.UNIFORM, short).update(matched)
    assert np.ptp(belief.places) == 0.0
    assert 0.0 <= sure < 1e-12


@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_a_sequence_of_one_place_does_not_take_the_views_of_others(profile: str) -> None:
    """Its entropy is 0 whatever is seen, so that it looked like the surest of all."""
    legs: Mapping[str, list[Leg]] = {"one": [("A", 0, 1)], "long": [("B", 0, 17)]}
    drives = {name: reference(way, seed) for seed, (name, way) in enumerate(legs.items())}
    learnt = Learnt((f"{profile}/uniform",), drives, merging=False)
    for belief in learnt.answers(TOWN.views([("B", 3, 9)], 9))[f"{profile}/uniform"]:
        assert belief.places[0] < 0.1
        assert belief.places.argmax() != 0
