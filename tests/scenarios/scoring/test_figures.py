import csv
import io
import math
from collections import Counter
from dataclasses import replace

import pytest
from rich.console import Console

from refseq.belief import Timings
from refseq.planar import Pose
from refseq.view import View
from refseq_bench.scenarios.campaign.declare.figures import FIGURES
from refseq_bench.scenarios.drives.benchmark import ALL, by_experiment
from refseq_bench.scenarios.report.sections.headline import headline
from refseq_bench.scenarios.report.words import distances
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.figures import figures, figures_csv, figures_record, step_times, success_over_seeds
from refseq_bench.scenarios.scoring.path_geometry import NARROW, ReferencePath, Tolerance
from refseq_bench.scenarios.scoring.score import harm, pool, score
from refseq_bench.scenarios.scoring.tables.score_tables import figures_table, lost_table, ways_text
from refseq_bench.scenarios.tables import print_whole
from tests.scenarios.report.test_several_drives import assert_same_score
from tests.support import certain, corridor_comparison


@pytest.fixture(scope="module")
def seeds() -> list[Comparison]:
    found = [corridor_comparison(seed, count=30, size=24) for seed in range(2)]
    return [replace(one, beliefs={**one.beliefs, "other": one.beliefs["chain"]}) for one in found]


def away(name: str = "away") -> Comparison:
    """Two views on the map and one off it, where the one method says lost and the other does not."""
    reference = [View(0.0, truth=Pose(float(x), 0.0, 0.0)) for x in range(5)]
    query = [View(0.0, truth=Pose(float(x), y, 0.0)) for x, y in ((1, 0), (1, 9), (2, 0))]
    timings = Timings(features=0.5, matching=0.001, chain=0.002)
    wary = [replace(certain(5, k, lost), timings=timings) for k, lost in ((1, 0.0), (1, 0.8), (2, 0.1))]
    bold = [certain(5, 1), certain(5, 1), certain(5, 4)]
    return Comparison(name, reference, {}, query, {}, {"wary": wary, "bold": bold})


def gap() -> Comparison:
    """Four views on the map and two off it, answered partly by place 2, whose true pose nobody knows."""
    reference = [View(0.0, truth=None if x == 4 else Pose(float(x), 0.0, 0.0)) for x in range(0, 10, 2)]
    query = [View(0.0, truth=Pose(float(x), y, 0.0)) for x, y in ((0, 0), (2, 0), (6, 0), (8, 0), (0, 9), (8, 9))]
    answers = [certain(5, place) for place in (0, 1, 2, 2, 0, 2)]
    return Comparison("gap", reference, {}, query, {}, {"mine": answers})


def printed(table: object, width: int = 40) -> str:
    console = Console(file=io.StringIO(), width=width)
    print_whole(console, table)  # type: ignore[arg-type]
    return console.file.getvalue()  # type: ignore[attr-defined, no-any-return]


def test_figures_are_the_scorer_s_over_all_comparisons(seeds: list[Comparison]) -> None:
    found = figures(seeds)
    assert [one.method for one in found] == ["uniform", "prior", "chain", "other"]
    for one in found:
        assert one.wide.success == pool([score(run, one.method) for run in seeds]).success
        assert one.narrow.success == pool([score(run, one.method, NARROW) for run in seeds]).success
    assert found[2].wide.success == found[3].wide.success


def test_geometry_is_worked_out_once_for_all_methods_and_tells_each_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    one = corridor_comparison(3, count=30, size=24)
    beliefs = one.beliefs["chain"]
    asked: list[str] = []
    for name in ("within", "nearest", "project"):
        plain = getattr(ReferencePath, name)
        monkeypatch.setattr(ReferencePath, name, lambda *of, name=name, plain=plain: asked.append(name) or plain(*of))
    (alone,) = figures([replace(one, beliefs={"a": beliefs})])
    for_one = Counter(asked)
    asked.clear()
    for found in figures([replace(one, beliefs=dict.fromkeys("abc", beliefs))]):
        assert_same_score(found.wide, alone.wide)
    assert for_one.total() > 0
    assert Counter(asked) == for_one
    assert_same_score(alone.narrow, score(one, "chain", NARROW))


def test_cost_leaves_features_out() -> None:
    wary, _ = figures([away()])
    assert wary.cost == pytest.approx(3.0)


def test_times_are_told_by_step() -> None:
    wary, _ = figures([away()])
    spread = {step: (times.median, times.p95) for step, times in wary.times.items()}
    assert spread == {
        "features": pytest.approx((500, 500)),
        "matching": pytest.approx((1, 1)),
        "mixture": (0, 0),
        "chain": pytest.approx((2, 2)),
        "total": pytest.approx((503, 503)),
    }


def test_harm_is_told_of_what_uses_the_order_of_views(seeds: list[Comparison]) -> None:
    found = {one.method: one for one in figures(seeds)}
    assert found["uniform"].harm is None
    assert found["other"].harm is None
    uniform, chain = (pool([score(run, method) for run in seeds]) for method in ("uniform", "chain"))
    assert found["chain"].harm == harm(chain, uniform)


def test_the_record_has_the_scorer_s_figures_whatever_there_is(seeds: list[Comparison]) -> None:
    wary, bold = (figures_record(one) for one in figures([away()]))
    chain = figures(seeds)[2]
    assert list(wary) == list(bold) == list(figures_record(chain))
    assert (wary["to_lost_median_m"], wary["to_lost_times"], wary["to_lost_never_times"]) == (0.0, 1, 0)
    assert (bold["to_lost_median_m"], bold["to_lost_times"], bold["to_lost_never_times"]) == (None, 1, 1)
    assert (wary["without_truth_views"], wary["harm_views"], wary["within_1_places_right_views"]) == (0, None, 2)
    assert (wary["features_median_ms"], wary["chain_p95_ms"]) == (500.0, 2.0)
    assert wary["within_1.5_m_seeds_low_percent"] is None  # a single drive tells nothing of others
    low, high = success_over_seeds(chain.wide_runs) or (0, 0)
    record = figures_record(chain)
    assert record["within_1.5_m_seeds_low_percent"] == pytest.approx(100 * low, abs=1e-3)
    narrow = success_over_seeds(chain.narrow_runs) or (0, 0)
    assert narrow != (low, high)
    told = [record[f"within_0.5_m_seeds_{end}_percent"] for end in ("low", "high")]
    assert told == pytest.approx([100 * end for end in narrow], abs=1e-3)
    assert sorted(100 * run.success.value for run in chain.wide_runs) == pytest.approx([100 * low, 100 * high])


def test_a_way_back_is_no_way_out() -> None:
    slow = [certain(5, 1), certain(5, 1, 0.9), certain(5, 2, 0.9)]
    (found,) = figures([replace(away(), beliefs={"slow": slow})])
    record = figures_record(found)
    assert (record["to_lost_median_m"], record["to_lost_never_times"]) == (0.0, 0)
    assert (record["to_recover_median_m"], record["to_recover_never_times"]) == (None, 1)


def test_a_spread_is_the_median_and_what_one_in_twenty_exceeds() -> None:
    times = step_times([Timings(chain=k / 1000) for k in range(101)])
    assert (times["chain"].median, times["chain"].p95) == pytest.approx((50, 95))


def test_a_table_is_whole_however_narrow_the_window(seeds: list[Comparison]) -> None:
    text = printed(figures_table("title", figures(seeds)))
    assert "…" not in text
    row = next(line for line in text.splitlines() if line.split()[:1] == ["other"]).split()
    chain = figures(seeds)[2]
    assert row[1] == f"{100 * chain.wide.success.value:.1f}"
    assert str(chain.wide.failures) in row
    assert f"{chain.wide.error_quantile(0.5):.2f}/{chain.wide.error_quantile(0.95):.2f}" in row
    assert "n/a" in row  # nothing was off the map


def test_what_happened_off_the_map_has_a_table_of_its_own(seeds: list[Comparison]) -> None:
    assert lost_table("none", figures(seeds)) is None
    lines = printed(lost_table("away", figures([away()]))).splitlines()
    wary, bold = (next(line for line in lines if line.split()[:1] == [name]).split() for name in ("wary", "bold"))
    assert wary == ["wary", "0", "of", "1", "0.00", "0.100", "0.00", "0.00", "0.00"]
    assert bold == [
        "bold",
        "1",
        "of",
        "1",
        "9.00",
        "0.333",
        "never",
        "(1",
        "of",
        "1)",
        "never",
        "(1",
        "of",
        "1)",
        "0.00",
    ]


def test_answers_at_places_without_a_true_pose_are_counted_and_their_errors_told_as_unknown() -> None:
    found = figures([gap()])
    record = figures_record(found[0])
    assert (record["failures_views"], record["error_unknown_views"], record["error_p95_m"]) == (2, 2, 0.0)
    assert (record["false_fixes_views"], record["false_fixes_unknown_views"], record["worst_false_fix_m"]) == (
        2,
        1,
        9.0,
    )
    assert "0.00/0.00 (2 unknown)" in printed(figures_table("gap", found))
    assert "Of 3 answers the error is not known" in headline(found[0], "").more
    told = printed(lost_table("gap", found)).splitlines()
    assert next(line for line in told if "mine" in line).split()[1:6] == ["2", "of", "2", "9.00", "(1"]


def test_ways_tell_the_median_and_those_never_gone() -> None:
    assert ways_text([1.0, None, 4.0, 2.0]) == "3.00 (1 of 4)"
    assert ways_text([None]) == "never (1 of 1)"
    assert ways_text([]) == "n/a"
    assert [distances(ways) for ways in ([1.0, None, 3.0], [2.0, None], [])] == [
        "3.00 m (1 never)",
        "never (1 of 2)",
        "n/a",
    ]


def test_a_way_has_one_median_whoever_tells_it() -> None:
    """Right again once in three times, at once: the median of the three is never."""
    views = [(x, y) for place in range(3) for x, y in ((place, 0), (place, 9))] + [(4, 0)]
    reference = [View(0.0, truth=Pose(float(x), 0.0, 0.0)) for x in range(5)]
    query = [View(0.0, truth=Pose(float(x), float(y), 0.0)) for x, y in views]
    answers = [certain(5, place) for place in (0, 0, 1, 0, 0, 0, 0)]
    (found,) = figures([Comparison("ways", reference, {}, query, {}, {"mine": answers})])
    assert found.wide.recovery.to_recover == (0.0, None, None)
    record = figures_record(found)
    assert (record["to_recover_median_m"], record["to_recover_never_times"]) == (None, 2)
    assert math.isinf(FIGURES["to_recover"].take(found))
    assert "never (2 of 3)" in printed(lost_table("ways", [found]))


def test_all_drives_together_are_told_where_there_are_several_experiments(seeds: list[Comparison]) -> None:
    assert [name for name, _ in by_experiment(seeds)] == [seeds[0].name]
    found = by_experiment([away("here"), away("there")])
    assert [name for name, _ in found] == ["here", "there", ALL]
    assert found[2][1][0].wide.success.trials == 4


def test_csv_has_a_row_a_method_and_nothing_where_there_is_no_figure(seeds: list[Comparison]) -> None:
    rows = list(csv.DictReader(io.StringIO(figures_csv([("a, b", figures([away()])), ("c", figures(seeds))]))))
    assert [(row["experiment"], row["method"]) for row in rows[:3]] == [
        ("a, b", "wary"),
        ("a, b", "bold"),
        ("c", "uniform"),
    ]
    assert rows[0]["lost_auroc"] == "1.0"
    assert rows[0]["lost_ece"] == "0.1"
    assert rows[0]["without_features_ms"] == "3.0"
    assert rows[2]["lost_auroc"] == ""
    assert rows[1]["worst_false_fix_m"] == "9.0"
    assert rows[1]["within_1.5_m_right_views"] == "1"


def test_figures_of_other_tolerances_have_columns_of_their_own() -> None:
    found = [("a", figures([away()])), ("b", figures([away()], wide=Tolerance(3.0)))]
    rows = list(csv.DictReader(io.StringIO(figures_csv(found))))
    assert [row["within_1.5_m_on_map_views"] for row in rows] == ["2", "2", "", ""]
    assert [row["within_3_m_on_map_views"] for row in rows] == ["", "", "2", "2"]
    assert figures_csv([]) == ""
