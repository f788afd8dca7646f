from dataclasses import replace

import numpy as np

from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.report.sections.frames import failure_frames, same_places
from refseq_bench.scenarios.scoring.comparison import Comparison, Drives
from refseq_bench.scenarios.scoring.outcome import Outcome
from refseq_bench.scenarios.scoring.path_geometry import WIDE, path_of
from refseq_bench.scenarios.scoring.score import score
from refseq_bench.scenarios.scoring.tables.worst_failures import EACH, KINDS, worst_failures
from tests.support import certain

PLACES = 40


def run(answers: list[int], lost: list[float], off_map: set[int] = frozenset()) -> Comparison:  # type: ignore[assignment]
    """A drive along places 1 m apart with an answer each; views off the map are 9 m beside the path."""
    reference = [View(float(k), truth=Pose(float(k), 0.0, 0.0)) for k in range(PLACES)]
    query = [View(float(t), truth=Pose(float(t), 9.0 if t in off_map else 0.0, 0.0)) for t in range(len(answers))]
    beliefs = [certain(PLACES, place, doubt) for place, doubt in zip(answers, lost, strict=True)]
    return Comparison("made", reference, {}, query, {}, {"mine": beliefs})


def found(*runs: Comparison, each: int = EACH) -> list[tuple[int, int, Outcome]]:
    scores = [score(one, "mine", WIDE) for one in runs]
    return [(one.run, one.view, one.outcome) for one in worst_failures(runs, scores, "mine", each)]


def test_the_farthest_are_found_over_all_runs() -> None:
    first = run([0, 1, 9, 3, 4, 30, 6], [0.0] * 7)  # 7 m and 25 m off
    second = run([0, 1, 2, 38, 4, 5], [0.0] * 6)  # 35 m off
    assert found(first, second) == [(1, 3, Outcome.WRONG), (0, 5, Outcome.WRONG)]
    assert found(first, second, each=3)[-1] == (0, 2, Outcome.WRONG)


def test_of_views_in_a_row_only_the_worst_is_shown() -> None:
    one = run([0, 20, 39, 20, 4, 5, 15, 7], [0.0] * 8)
    scores = [score(one, "mine", WIDE)]
    worst = worst_failures([one], scores, "mine")
    assert [(failure.view, failure.views) for failure in worst] == [(2, 3), (6, 1)]
    assert [failure.apart for failure in worst] == [37.0, 9.0]


def test_each_kind_has_its_own() -> None:
    one = run([0, 30, 2, 3, 4, 5, 12, 7, 8], [0, 0, 0, 0.6, 0, 0.9, 0, 0, 0], off_map={7})
    assert found(one, each=1) == [(0, 1, Outcome.WRONG), (0, 7, Outcome.FALSE_FIX), (0, 5, Outcome.MISSED)]


def test_what_lies_nobody_knows_how_far_off_comes_first() -> None:
    one = run([0, 39, 2, 20, 4, 20, 6], [0.0] * 7, off_map={5})
    views = list(one.reference_views)
    views[20] = replace(views[20], truth=None)
    unknown = replace(one, reference_views=views)
    assert found(unknown, each=1) == [(0, 3, Outcome.WRONG), (0, 5, Outcome.FALSE_FIX)]
    (worst, *_) = worst_failures([unknown], [score(unknown, "mine", WIDE)], "mine")
    told = "query view 3: wrong, at a place without a true pose, P(lost) 0.00."
    assert failure_frames(worst, [unknown], {}).caption == told


def test_a_place_that_is_near_and_wrong_is_told_by_its_heading() -> None:
    one = run([0, 1, 2, 3], [0.0] * 4)
    views = list(one.query_views)
    views[2] = replace(views[2], truth=Pose(2.0, 0.3, np.radians(-40)))
    turned = replace(one, query_views=views)
    (worst,) = worst_failures([turned], [score(turned, "mine", WIDE)], "mine")
    told = "query view 2: false fix, 0.3 m away in a straight line, facing 40° another way, P(lost) 0.00."
    assert failure_frames(worst, [turned], {}).caption == told


def test_worst_of_random_answers_is_worst_of_all() -> None:
    rng = np.random.default_rng(0)
    runs = [run(list(rng.integers(PLACES, size=PLACES)), list(rng.random(PLACES) ** 3)) for _ in range(3)]
    scores = [score(one, "mine", WIDE) for one in runs]
    shown = worst_failures(runs, scores, "mine")
    for kind in KINDS:
        failed = [
            (abs(one.beliefs["mine"][t].best - t), one.beliefs["mine"][t].lost)
            for one, judged in zip(runs, scores, strict=True)
            for t, outcome in enumerate(judged.outcomes)
            if outcome is kind
        ]
        of_kind = [failure for failure in shown if failure.outcome is kind]
        if kind is Outcome.MISSED:
            assert of_kind[0].lost == max(lost for _, lost in failed)
        elif failed:
            assert of_kind[0].apart == max(apart for apart, _ in failed)
    assert {failure.right - failure.view for failure in shown} == {0}


def test_a_faultless_drive_shows_nothing() -> None:
    good = run(list(range(10)), [0.0] * 10)
    assert found(good, replace(good)) == []


def test_of_several_drives_a_place_is_named_by_its_number_in_its_own() -> None:
    one = run([0, 30, 2, 39], [0.0] * 4)
    (worst, _) = worst_failures([one], [score(one, "mine", WIDE)], "mine")
    assert failure_frames(worst, [one], {}).columns == ("query view 3", "answered: place 39", "right place: 3")
    several = replace(one, drives=Drives(("path-a", "path-b"), (3, PLACES - 3)))
    assert failure_frames(worst, [several], {}).columns == (
        "query view 3",
        "answered: place 36 of path-b",
        "right place: 0 of path-b",
    )
    assert [several.named(place) for place in (0, 2, 3, 39)] == [
        "0 of path-a",
        "2 of path-a",
        "0 of path-b",
        "36 of path-b",
    ]
    path = path_of(several)
    first = same_places([several], 0, path, WIDE, "mine")[0]
    assert first.caption == "query view 0, reference place 0 of path-a, 0.00 m apart"
