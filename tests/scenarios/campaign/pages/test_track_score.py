from statistics import fmean

import pytest

from refseq_bench.scenarios.campaign.declare.outcomes import Verdict
from refseq_bench.scenarios.campaign.pages.tables import CampaignRuns, blocks, filled
from refseq_bench.scenarios.campaign.store.result_file import CaseRecord, RunRecord, SeedRecord
from refseq_bench.scenarios.errors import ScenarioError
from tests.scenarios.campaign.pages.test_text_report import campaign, case, method

SEED = SeedRecord(reference="r", query="q", answers={}, learnt_views=10, asked_views=10)
PAGE = """<!-- table track
case = "track/*"
[columns]
"score".show = "{score:.3f} ({score_low:.3f} to {score_high:.3f}) in {cases}, {seeds}"
[rows]
"ours".method = "a"
"b".method = "b"
-->
<!-- end table -->
"""


def of_track(name: str, training: tuple[int, ...] = (), **areas: list[float]) -> CaseRecord:
    """A case in which methods had such areas, an entry a seed."""
    methods = [
        method(label, 5).model_copy(
            update={"runs": {seed: RunRecord(right=5, of=10, auc=area) for seed, area in enumerate(of_seeds, 101)}}
        )
        for label, of_seeds in areas.items()
    ]
    seeds = {101 + k: SEED for k in range(len(next(iter(areas.values()))))}
    resolved = {"seeds": list(seeds), "training_seeds": list(training)}
    return case(f"track/{name}", Verdict.PASSED, methods=tuple(methods), seeds=seeds, resolved=resolved)


def test_score_is_the_mean_over_cases_with_an_interval_over_seeds() -> None:
    first = of_track("one", a=[0.8, 0.9, 0.7], b=[0.1, 0.2, 0.3])
    record = campaign(first, of_track("two", a=[0.4, 0.5, 0.6]))
    text = filled(blocks(PAGE, "page")[0], CampaignRuns([record]))
    by_seed = [0.6, 0.7, 0.65]
    assert f"| ours | {fmean(by_seed):.3f} (0.600 to 0.700) in 2, 3 |" in text
    assert f"| b | {0.2 / 2:.3f} (" in text, "a case without an answer has none right"


def test_counts_are_those_of_all_cases_by_both_tolerances() -> None:
    page = PAGE.replace("{score:.3f} ({score_low:.3f} to {score_high:.3f}) in {cases}, {seeds}",
        "{right} and {right_narrow} of {of}, {failures_narrow} wrong")  # fmt: skip
    none = method("a", 0).success
    answered = [of_track(name, a=[0.5]) for name in ("one", "two")]
    answered[1] = answered[1].model_copy(
        update={"methods": (answered[1].methods[0].model_copy(update={"success_narrow": none}),)}
    )
    text = filled(blocks(page.replace('"b".method = "b"\n', ""), "page")[0], CampaignRuns([campaign(*answered)]))
    assert "| ours | 10 and 5 of 20, 15 wrong |" in text


def test_cases_that_all_answered_have_a_score_of_their_own() -> None:
    page = PAGE.replace("{score:.3f} ({score_low:.3f} to {score_high:.3f})", "{score_shared:.3f}").replace(
        "in {cases}, {seeds}", "in {cases_shared} of {cases}"
    )
    first = of_track("one", a=[0.8, 0.9, 0.7], b=[0.1, 0.2, 0.3])
    record = campaign(first, of_track("two", a=[0.4, 0.5, 0.6]))
    text = filled(blocks(page, "page")[0], CampaignRuns([record]))
    assert "| ours | 0.800 in 1 of 2 |" in text
    assert "| b | 0.200 in 1 of 2 |" in text


def test_cases_of_other_seeds_are_not_scored_together() -> None:
    record = campaign(of_track("one", a=[0.5, 0.5], b=[0.5, 0.5]), of_track("two", a=[0.5], b=[0.5]))
    told = r"cases of track have other seeds, \[101, 102\] and \[101\]; valid is track/\* of cases with the same ones$"
    with pytest.raises(ScenarioError, match=told):
        filled(blocks(PAGE, "page")[0], CampaignRuns([record]))


def test_a_seed_that_nobody_answered_has_no_right_answer() -> None:
    lost = of_track("one", a=[0.8, 0.6], b=[0.8, 0.6])
    record = lost.model_copy(update={"resolved": {"seeds": [101, 102, 103]}})
    text = filled(blocks(PAGE, "page")[0], CampaignRuns([campaign(record, record.model_copy(update={"name": "two"}))]))
    assert f"| ours | {1.4 / 3:.3f} (" in text


def test_training_seeds_never_reach_a_page() -> None:
    record = campaign(of_track("one", (101,), a=[0.5], b=[0.5]), of_track("two", (101,), a=[0.5], b=[0.5]))
    with pytest.raises(ScenarioError, match=r"was run on its training seeds \[101\]; valid are the seeds of the test"):
        filled(blocks(PAGE, "page")[0], CampaignRuns([record]))
