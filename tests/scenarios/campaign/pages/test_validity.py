"""Validity of a campaign: sets and twins are paired, methods are ordered, and what is missing is told."""

from collections.abc import Mapping

import numpy as np
import pytest

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages.validity import page_with, panels, report_of, validities
from refseq_bench.scenarios.campaign.store.result_file import (
    CampaignRecord,
    CaseRecord,
    MachineRecord,
    MethodRecord,
    RunRecord,
    ShareRecord,
    cases_by_scenario,
)
from refseq_bench.scenarios.errors import ScenarioError

GOOD = {"a": (9, 8), "b": (5, 6), "c": (2, 1)}
"""Right views of ten, by method and seed."""


def method(name: str, right: tuple[int, ...], auc: float | None = 0.5) -> MethodRecord:
    share = ShareRecord(right=sum(right), of=10 * len(right), low=0.0, high=1.0)
    runs = {seed: RunRecord(right=count, of=10, auc=auc) for seed, count in enumerate(right)}
    return MethodRecord(
        method=name, plotted=True, within_m=1.5, narrow_m=0.5, success=share, success_narrow=share, figures={},
        costs={}, digests={}, runs=runs,
    )  # fmt: skip


def case(name: str, right: Mapping[str, tuple[int, ...]], reasons: tuple[str, ...] = ()) -> CaseRecord:
    verdict = Verdict.PASSED if right else Verdict.SKIPPED
    return CaseRecord(
        name=f"laser/{name}", scenario="laser", title="A laser alone", blocking=False, judged="a", verdict=verdict,
        reasons=reasons, methods=tuple(method(one, counts) for one, counts in right.items()),
    )  # fmt: skip


def campaign(*cases: CaseRecord) -> CampaignRecord:
    machine = MachineRecord(system="", processor="", cores=1, memory_gb=None, device=None)
    return CampaignRecord(started="", seconds=1.0, complete=True, versions={}, machine=machine, cases=cases)


def test_a_set_is_compared_with_its_twin_by_the_means_of_its_seeds() -> None:
    (found,) = validities(
        [campaign(case("twin/x", {"c": (3,), "b": (6,), "a": (8,)}), case("real/x", GOOD))], "success"
    )
    assert set(found.methods) == {"a", "b", "c"}
    (panel,) = panels(found)
    real = dict(zip(found.methods, panel.real, strict=True))
    assert real == pytest.approx({"a": 0.85, "b": 0.55, "c": 0.15})
    assert dict(zip(found.methods, panel.twin, strict=True)) == pytest.approx({"a": 0.8, "b": 0.6, "c": 0.3})
    assert "| x | 1.00 [" in report_of([campaign(case("twin/x", GOOD), case("real/x", GOOD))])


def test_only_methods_that_answered_everywhere_are_ordered_and_others_are_named() -> None:
    (found,) = validities([campaign(case("twin/x", GOOD), case("real/x", {**GOOD, "d": (1, 1)}))], "success")
    assert found.methods == ("a", "b", "c")
    assert found.left_out == ("d: has no success in all cases",)


def test_an_absent_set_is_one_line_and_the_rest_is_compared() -> None:
    absent = case("real/y", {}, ("/data/y.log: is not there",))
    record = campaign(case("real/x", GOOD), absent, case("twin/x", GOOD), case("twin/y", GOOD))
    (found,) = validities([record], "success")
    assert [pair.name for pair in found.pairs] == ["x"]
    assert found.left_out == ("y: laser/real/y has no answers: /data/y.log: is not there",)
    assert "left out: y: laser/real/y has no answers" in report_of([record])


def test_a_later_campaign_counts_and_pairs_may_come_from_two() -> None:
    first, second = campaign(case("real/x", dict.fromkeys(GOOD, (0,))), case("twin/x", GOOD)), case("real/x", GOOD)
    (found,) = validities([first, campaign(second)], "success")
    np.testing.assert_array_equal(found.pairs[0].real, found.pairs[0].twin)


def test_a_later_campaign_that_was_ended_before_a_case_hides_no_answers_of_it() -> None:
    whole, opened = case("real/x", GOOD), case("real/x", {}).model_copy(update={"verdict": None})
    pages = [campaign(whole, case("twin/x", GOOD)), campaign(opened)]
    (found,) = validities(pages, "success")
    assert [pair.name for pair in found.pairs] == ["x"]
    assert cases_by_scenario([campaign(opened), campaign(opened)]) == {"laser": [opened]}
    assert cases_by_scenario([campaign(opened), campaign(whole)]) == {"laser": [whole]}


def test_pairs_that_change_places_are_told() -> None:
    twisted = {"a": (9, 8), "b": (1, 2), "c": (5, 6)}
    text = report_of([campaign(case("real/x", GOOD), case("twin/x", twisted))])
    assert "* `b` is 40 points better than `c` on real sets, 40 worse on the twins" in text
    assert "| x | 0.50 [" in text


@pytest.mark.parametrize("names", [(), ("noon",), ("real/x",), ("real/x", "twin/y")])
def test_a_campaign_without_a_pair_is_told_in_one_line(names: tuple[str, ...]) -> None:
    with pytest.raises(ScenarioError, match="no real set and its twin were both answered; valid is") as error:
        validities([campaign(*(case(name, GOOD) for name in names))], "success")
    assert "\n" not in str(error.value)


def test_a_page_is_filled_between_its_comments_and_one_without_them_is_refused() -> None:
    page = "# Before\n<!-- validity -->\nold\n<!-- end validity -->\nafter\n"
    filled = page_with(page, r"\new" + "\n", "p.md")
    assert filled == "# Before\n<!-- validity -->\n\\new\n<!-- end validity -->\nafter\n"
    with pytest.raises(ScenarioError, match=r"p\.md: has no place"):
        page_with("# Before\n", "new", "p.md")


def test_what_a_page_tells_of_scenarios_that_did_not_run_stays() -> None:
    page = "<!-- validity -->\n\n### A camera\n\nold\n\n### A laser alone\n\nold\n<!-- end validity -->\n"
    filled = page_with(page, report_of([campaign(case("twin/x", GOOD), case("real/x", GOOD))]), "p.md")
    assert filled.startswith("<!-- validity -->\n\n### A camera\n\nold\n\n### A laser alone\n\n| real and twin")
    assert filled.count("### A laser alone") == 1
    both = page_with(
        page.replace("A laser alone", "Another"),
        report_of([campaign(case("twin/x", GOOD), case("real/x", GOOD))]),
        "p.md",
    )
    assert [line for line in both.splitlines() if line.startswith("###")] == [
        "### A camera", "### Another", "### A laser alone"
    ]  # fmt: skip
