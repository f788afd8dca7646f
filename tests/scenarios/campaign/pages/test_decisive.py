from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages import decisive
from refseq_bench.scenarios.campaign.pages.decisive import (
    MOST_SEEDS,
    comparison_rows,
    corrected,
    power_line,
    power_rows,
    undecided,
)
from refseq_bench.scenarios.campaign.pages.index import index_page
from refseq_bench.scenarios.campaign.pages.text_report import report_markdown
from refseq_bench.scenarios.campaign.store.result_file import CaseRecord, RunRecord, SeedRecord, write_result
from refseq_bench.scenarios.scoring.intervals.paired import comparisons_shown, least_p, paired_difference
from tests.scenarios.campaign.pages.test_text_report import campaign, case, method
from tests.scenarios.conftest import Refseq
from tests.scenarios.report.test_document import Page

SEED = SeedRecord(reference="r", query="q", answers={}, learnt_views=100, asked_views=100)


def asked(name: str, verdict: Verdict = Verdict.PASSED, **rights: list[int]) -> CaseRecord:
    """A case in which methods were right at so many of 100 views, an entry a seed; ``a`` is judged."""
    methods = []
    for label, of_seeds in rights.items():
        runs = {seed: RunRecord(right=right, of=100) for seed, right in enumerate(of_seeds, 1)}
        share = method(label, 0).success.model_copy(update={"right": sum(of_seeds), "of": 100 * len(of_seeds)})
        methods.append(method(label, 0).model_copy(update={"success": share, "runs": runs}))
    seeds = dict.fromkeys(range(1, len(next(iter(rights.values()))) + 1), SEED)
    return case(name, verdict, methods=tuple(methods), seeds=seeds)


EASY = asked("easy", a=[100, 99, 100, 100, 98], b=[97, 96, 98, 95, 96])
HOPELESS = asked("hopeless", a=[3, 4, 5, 0, 1], b=[0, 0, 0, 0, 1])
TELLING = asked("telling", a=[91, 93, 90, 92, 91], b=[60, 64, 58, 62, 61], c=[91, 92, 90, 93, 91])


@pytest.mark.parametrize(
    ("record", "reason"),
    [
        (EASY, "decides nothing: all 2 methods are right at 95 % or more"),
        (HOPELESS, "decides nothing: none of 2 methods is right at more than 5 %"),
        (TELLING, ""),
        (asked("alone", a=[100] * 5), ""),
        (
            asked("short", a=[100]).model_copy(update={"views": 1}),
            "decides nothing: it asked about 1 view; shares tell something of 10 or more",
        ),
        (asked("enough", a=[100]).model_copy(update={"views": 10}), ""),
    ],
)
def test_case_that_tells_no_methods_apart_is_flagged(record: CaseRecord, reason: str) -> None:
    assert undecided(record) == reason


def test_off_the_map_rejections_count() -> None:
    """A method that never says lost differs from one that does, though both are right on the map."""
    telling = EASY.methods[0].model_copy(update={"figures": {"accuracy_percent": 60.0}})
    assert undecided(EASY.model_copy(update={"methods": (telling, EASY.methods[1])})) == ""


def test_where_the_seeds_agree_they_can_show_a_view_of_the_shortest_drive() -> None:
    views = {1: 100, 2: 50, 3: 20, 4: 40, 5: 80}
    ours, other = (
        one.model_copy(update={"runs": {seed: RunRecord(right=of // part, of=of) for seed, of in views.items()}})
        for one, part in zip(asked("agreed", a=[0], b=[0]).methods, (1, 2), strict=True)
    )
    (row,) = comparison_rows(case("agreed", Verdict.PASSED, methods=(ours, other)))
    assert (row.difference, row.smallest) == ("+50.0", "5.0")


def test_comparisons_are_corrected_over_all_cases() -> None:
    record = campaign(EASY, TELLING)
    by_name = {(one.case, one.method): one for one in corrected(record)}
    assert set(by_name) == {("easy", "b"), ("telling", "b"), ("telling", "c")}
    assert by_name["telling", "b"].found.difference == pytest.approx(0.304)
    assert by_name["telling", "b"].corrected == pytest.approx(3 * by_name["telling", "b"].found.p)
    assert by_name["telling", "c"].corrected == 1.0


def test_two_seeds_show_nothing_and_say_what_would() -> None:
    record = campaign(asked("few", a=[91, 93], b=[60, 64]))
    found = corrected(record)
    assert power_line(found).endswith("2 seeds can show none of so many, 3 could")
    assert power_rows(record.cases, found)[0].smallest == "n/a"


def test_seeds_are_counted_that_both_methods_have() -> None:
    """At two of five seeds the other method broke: three are too few for the least p-value of five."""
    telling = asked("broken", a=[91, 93, 90, 92, 91], b=[60, 64, 58, 62, 61], c=[81, 83, 80, 82, 81])
    ours, broken, whole = telling.methods
    broken = broken.model_copy(update={"runs": {seed: broken.runs[seed] for seed in (1, 2, 3)}})
    record = telling.model_copy(update={"methods": (ours, broken, whole)})
    found = corrected(campaign(record))
    assert [one.seeds for one in found] == [3, 5]
    assert power_rows([record], found)[0].seeds == "3 to 5"
    assert [row.p for row in comparison_rows(record)] == ["≤ 0.028", "≤ 0.00077"]


def test_seven_seeds_are_the_most_that_are_told_to_show_more() -> None:
    """From there on the resamples that are drawn, and not the seeds, are the bound."""
    assert least_p(MOST_SEEDS - 1) > least_p(MOST_SEEDS) == least_p(MOST_SEEDS + 1)
    apart = {f"b{number}": [90] * 6 for number in range(comparisons_shown(6) + 1)}
    assert power_line(corrected(campaign(asked("many", a=[90] * 6, **apart)))).endswith(
        "6 seeds can show none of so many, 7 could"
    )


@pytest.mark.parametrize("seeds", [5, 9, 10, 12])
def test_enough_seeds_are_not_said_to_show_nothing(seeds: int) -> None:
    record = campaign(asked("many", a=[91 + k % 2 for k in range(seeds)], b=[60 + k % 3 for k in range(seeds)]))
    line = power_line(corrected(record))
    assert line.startswith("1 of 1 comparisons with the judged method show a difference after Holm's correction")
    assert line.endswith(", 1 before it")


def test_index_compares_each_pair_once_and_keeps_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Comparisons are many and each takes 9 ms; the index is written after each case."""
    asked_for: list[object] = []
    monkeypatch.setattr(
        decisive, "paired_difference", lambda *of, **more: asked_for.append(of) or paired_difference(*of, **more)
    )
    index_page(campaign(EASY, TELLING), [])
    assert len(asked_for) == 3
    assert paired_difference.cache_info().maxsize is None


def test_every_page_flags_and_tells(tmp_path: Path, refseq: Refseq) -> None:
    record = campaign(EASY, TELLING)
    page = index_page(record, [])
    assert page.count("decides nothing: all 2 methods") == 1
    assert "What the seeds can show" in page
    assert any(row[0] == "telling" and row[3] == "2" for row in Page(page).rows if len(row) > 3)
    assert "decides nothing: all 2 methods" in report_markdown(record, figures=False)
    write_result(tmp_path, record)
    answer = refseq("scenario", "report", tmp_path, "--figures").out
    assert "easy: decides nothing" in answer
    assert "points on can be shown" in answer
