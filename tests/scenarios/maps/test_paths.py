from dataclasses import replace

import numpy as np
import pytest

from refseq.map.learning import learn
from refseq.map.profile import BEST, THESIS, Profile
from refseq_bench.scenarios.maps.paths import best_paths, course
from refseq_bench.scenarios.scoring.proportion import Proportion
from tests.refseq.health.drives import drive
from tests.refseq.rooms import bits_drive, bits_map


@pytest.mark.parametrize(
    ("states", "told"),
    [
        ((0, 1, 2, 5, 5, 6), "0-2, 5, 5-6"),
        ((10, 10, 0, 14, 9), "lost 0 × 2, 0, lost 4, 9"),
        ((3, 13, 4, 14, 15), "3, lost 3, 4, lost 4, lost 5"),
    ],
)
def test_courses_in_words(states: tuple[int, ...], told: str) -> None:
    assert course(states, 10) == told


@pytest.mark.parametrize("profile", [THESIS, BEST])
def test_a_drive_that_sees_what_was_learnt_is_told_from_all_others(profile: Profile) -> None:
    """Nine views, each of its own place: the right path comes first, and little of it is left unknown."""
    views = bits_drive({"camera": np.random.default_rng(1).random((12, 80)) < 0.3})
    found = best_paths(bits_map(views, profile), views[2:11], 20)
    assert found.paths[0].states == tuple(range(2, 11))
    assert list(found.shares) == sorted(found.shares, reverse=True)
    assert 0 < sum(found.shares) <= 1
    assert 0.8 * found.unknown < found.told <= found.unknown
    terms = best_paths(bits_map(views, profile), views[2:11], 20, durations=1.0, second_order=1.0)
    assert terms.paths[0].states == found.paths[0].states
    assert {one.states for one in terms.paths} == {one.states for one in found.paths}


def test_a_path_is_right_where_its_places_are_near_the_truth() -> None:
    """Places and views 0.85 m apart: paths that are right throughout, somewhere a place ahead, or lost."""
    learnt, asked = drive(24, seed=1), drive(24, seed=2)[:12]
    map_ = learn(learnt)
    found = best_paths(map_, asked, 200)
    assert found.right[0] == found.right_narrow[0] == Proportion(12, 12)
    for path, right, narrow in zip(found.paths, found.right, found.right_narrow, strict=True):
        off = [abs(state - number) if state < 24 else 24 for number, state in enumerate(path.states)]
        assert narrow == Proportion(off.count(0), 12)
        assert right == Proportion(sum(one <= 1 for one in off), 12)
    unknown = best_paths(map_, [replace(view, truth=None) for view in asked], 2)
    assert unknown.right == unknown.right_narrow == [Proportion(0, 0)] * 2


@pytest.mark.quick_cases("thesis")
@pytest.mark.parametrize("profile", ["thesis", "best"])
def test_a_robot_that_stands_is_no_surer_of_its_path(profile: str) -> None:
    """Of a map that counts a stand once, a view seen three times more tells nothing new."""
    map_ = learn(drive(24, seed=1), profile=f"{profile}+motion.stands_once=true")
    views = drive(24, seed=2)[:12]
    more = [replace(views[5], distance=0.0, turn=0.0, time=views[5].time + 0.1 * k) for k in (1, 2, 3)]
    driven, stood = (best_paths(map_, one, 5) for one in (views, [*views[:6], *more, *views[6:]]))
    assert stood.paths[0].states == (
        *driven.paths[0].states[:6],
        *[driven.paths[0].states[5]] * 3,
        *driven.paths[0].states[6:],
    )
    assert stood.unknown == pytest.approx(driven.unknown)
    assert stood.told == pytest.approx(driven.told, rel=1e-3)  # the mixture draws anew at each view
    assert stood.shares == pytest.approx(driven.shares, rel=0.05)
