"""Judging a case by what its tasks left: verdicts, tolerances, costs, digests. Tasks are real, drives made by rule."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from refseq.logs import RecordingWriter, read_recording
from refseq.planar import Pose
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.judge.drives import Judged, judged, tolerances
from refseq_bench.scenarios.campaign.judge.records import case_record
from refseq_bench.scenarios.campaign.pages.junit import junit
from refseq_bench.scenarios.campaign.pages.verdicts import index_row
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, answers_of, perform
from refseq_bench.scenarios.campaign.store.answers import beliefs_digest
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, JudgementRecord, MachineRecord
from tests.scenarios.campaign.made import carried_out, made_cases, write_logs


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("judging")
    write_logs(path)
    return path


@pytest.fixture(autouse=True)
def recordings(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(DATA, str(folder))


def test_tolerances_are_those_declared(folder: Path) -> None:
    (case,) = made_cases(folder, rest="[score]\nwithin = 2.0\nnarrow = 0.25\nheading = 45")
    assert [(one.distance, one.heading) for one in tolerances(case)] == [(2.0, math.pi / 4), (0.25, math.pi / 4)]


@pytest.mark.slow
def test_what_a_method_cost_is_what_its_own_task_took(folder: Path) -> None:
    (case,) = made_cases(folder, methods='["thesis/chain", "vlad"]')
    store = Store(folder / "store")
    result = carried_out(case, store)
    for number, of_seed in enumerate(answer_tasks(case).values()):
        for task in of_seed:
            kept = answers_of(task, store)
            assert [result.costs[name][number] for name in kept.beliefs] == [kept.cost]
            digests = [beliefs_digest(beliefs) for beliefs in kept.beliefs.values()]
            assert [result.digests[name][number] for name in kept.beliefs] == digests
    assert result.costs["vlad"] != result.costs["thesis/chain"]


def spoilt(folder: Path, expect: str, *ends: Verdict) -> Judged:
    """A case of two methods, of whose four tasks some end otherwise than well."""
    (case,) = made_cases(folder, methods='["vlad", "thesis/chain"]', expect=expect)
    tasks, store = answer_tasks(case), Store(folder / "store")
    asked: list[AnswerTask] = [task for of_seed in tasks.values() for task in of_seed]
    outcomes = {task.key: perform(task, store) for task in asked}
    outcomes |= {task.key: TaskOutcome(end, f"it {end}") for task, end in zip(asked, ends, strict=False)}
    return judged(case, tasks, outcomes, store)


MET, MISSED, OPEN = '"success >= 0"', '"success > 1"', '"success of vlad >= 0"'
PASSED, FAILED, ERROR, SKIPPED = Verdict.PASSED, Verdict.FAILED, Verdict.ERROR, Verdict.SKIPPED


@pytest.mark.parametrize(
    ("expect", "ends", "verdict"),
    [
        (MET, (), PASSED),
        (MISSED, (), FAILED),
        (MET, (FAILED,), FAILED),
        (MET, (SKIPPED,), SKIPPED),
        (MISSED, (SKIPPED,), FAILED),
        (MISSED, (ERROR,), ERROR),
        (MET, (FAILED, PASSED, ERROR), ERROR),
        (f"{MET}, {OPEN}", (FAILED,), FAILED),
        ("", (), PASSED),
        ("", (ERROR,), ERROR),
    ],
)
def test_the_worst_that_happened_is_the_verdict(
    folder: Path, expect: str, ends: tuple[Verdict, ...], verdict: Verdict
) -> None:
    assert spoilt(folder, expect, *ends).verdict is verdict


def test_who_did_not_answer_every_seed_has_no_figures_and_the_others_keep_theirs(folder: Path) -> None:
    result = spoilt(folder, f"{MET}, {OPEN}", FAILED)  # vlad, for the first of two seeds
    assert [one.method for one in result.figures] == ["thesis/chain"]
    assert [one.met for one in result.judgements] == [True, None]
    assert result.judgements[1] == JudgementRecord(
        text="success of vlad >= 0", met=None, reason="vlad does not answer for every seed"
    )
    assert result.reasons == (
        "it failed (seed 1)",
        "not judged: success of vlad >= 0 (vlad does not answer for every seed)",
    )
    assert [len(tasks) for tasks in result.answered.values()] == [1, 2]


@pytest.fixture(scope="module")
def blind(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same logs without a true pose, the reference's odometry as it is."""
    path = tmp_path_factory.mktemp("blind")
    write_logs(path)
    for name in ("reference", "query"):
        views = read_recording(path / f"{name}.mcap").views
        with RecordingWriter(path / f"{name}.mcap", {"light": name}) as writer:
            for number, view in enumerate(views):
                writer.write(replace(view, truth=None), Pose(0.85 * number, 0.0, 0.0))
    return path


def test_without_truth_a_case_passes_unscored_and_a_score_cannot_be_expected(
    blind: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DATA, str(blind))
    store, missing = Store(blind / "store"), "neither what was learnt nor the query has true poses"
    expected = {
        "nothing": ("", Verdict.PASSED),
        "consistent": ('"odometry_jumps <= 50 %", "agreement >= 0 %", "milliseconds <= 1e9"', Verdict.PASSED),
        "jumpy": ('"odometry_slope >= 99"', Verdict.FAILED),
        "scored": ('"says_lost <= 100 %", "ece of vlad <= 0.5"', Verdict.ERROR),
    }
    for name, (expect, verdict) in expected.items():
        (case,) = made_cases(blind, name, expect=expect, methods='["thesis/chain", "vlad"]', top="blocking = true")
        result = carried_out(case, store)
        assert (result.verdict, result.unscored) == (verdict, missing), result.reasons
        record = case_record(result, "report.html")
        assert record.method("vlad").success.of == 0  # type: ignore[union-attr]
        campaign = CampaignRecord(
            started="2026-01-01T00:00:00+00:00", seconds=1.0, complete=True, versions={}, cases=(record,),
            machine=MachineRecord(system="", processor="", cores=1, memory_gb=None, device=None),
        )  # fmt: skip
        row, told = index_row(record), junit(campaign).tostring().decode()
        assert (row.success, row.failures) == ("n/a", "n/a")
        assert told.count(f"not scored: {missing}") == 1
        if name == "scored":
            reason = f"ece needs true poses, and {missing}; valid without are places_left, bytes_left, says_lost"
            assert result.reasons[0].startswith(f"cannot be judged: ece of vlad <= 0.5 ({reason}")
            assert told.count("<error") == 1
            assert [one.met for one in result.judgements] == [True, None]
        elif verdict is Verdict.PASSED:
            assert row.reason == f"not scored: {missing}"
