import html
from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.declare.outcomes import VERDICTS, Verdict
from refseq_bench.scenarios.campaign.pages.index import index_page
from refseq_bench.scenarios.campaign.pages.sweep_plot import sweep_plot_of
from refseq_bench.scenarios.campaign.pages.text_report import report_markdown
from refseq_bench.scenarios.campaign.pages.verdicts import verdict_line
from refseq_bench.scenarios.campaign.store.result_file import (
    CampaignRecord,
    CaseRecord,
    JudgementRecord,
    MachineRecord,
    MethodRecord,
    ShareRecord,
    write_result,
)
from refseq_bench.scenarios.scoring.proportion import Proportion
from tests.pages import ROOT
from tests.scenarios.conftest import Refseq
from tests.scenarios.report.test_document import Page


def method(name: str, right: int, *, drawn: bool = True) -> MethodRecord:
    """A method with so many right answers of ten."""
    low, high = Proportion(right, 10).interval
    share = ShareRecord(right=right, of=10, low=low, high=high)
    return MethodRecord(
        method=name, plotted=drawn, within_m=1.5, narrow_m=0.5, success=share, success_narrow=share,
        figures={"auc": 0.5}, costs={}, digests={},
    )  # fmt: skip


def case(name: str, verdict: Verdict | None, *, blocking: bool = True, **more: object) -> CaseRecord:
    return CaseRecord(
        name=name, scenario=name.split("/")[0], title="", blocking=blocking, judged="a", verdict=verdict, **more
    )  # type: ignore[arg-type]  # fmt: skip


def campaign(*cases: CaseRecord) -> CampaignRecord:
    machine = MachineRecord(system="s", processor="p", cores=2, memory_gb=1.0, device=None)
    complete = all(one.verdict is not None for one in cases)
    return CampaignRecord(
        started="then", seconds=61.0, complete=complete, versions={}, machine=machine, cases=cases
    )  # fmt: skip


MISSED = JudgementRecord(text="success >= 1", met=False, value=0.9, bound=1.0, reason="")
MIXED = campaign(
    case("calm", Verdict.FAILED, blocking=False, reasons=("too slow | <b>",)),
    case("good/a,b", Verdict.PASSED, methods=(method("a", 9), method("b", 3)), judgements=(), seeds={}),
    case("bad", Verdict.FAILED, reasons=("missed: success >= 1", "and more"), judgements=(MISSED,)),
    case("late", None),
)


def test_verdicts_are_counted_apart() -> None:
    assert verdict_line(MIXED) == "1 passed, 1 failed, 1 not judged; 1 failed (not blocking)"
    assert verdict_line(campaign()) == "no case"


def test_markdown_is_one_table_that_no_text_can_break() -> None:
    lines = report_markdown(MIXED, figures=False).splitlines()
    rows = [line for line in lines if line.startswith("|")]
    assert all(row.replace("\\|", "").count("|") == 7 for row in rows)
    assert len(rows) == 2 + len(MIXED.cases)
    assert rows[-1].startswith("| failed (not blocking) | calm |")
    assert "&lt;b>" in rows[-1]


def test_markdown_holds_all_methods_where_they_are_asked_for() -> None:
    text = report_markdown(MIXED, figures=True)
    assert text.startswith(report_markdown(MIXED, figures=False))
    assert "| b | 30.0 % [11, 60] of 10 |" in text


def test_one_figure_of_all_methods_over_all_cases(tmp_path: Path, refseq: Refseq) -> None:
    write_result(tmp_path, campaign(*dial_cases(["noon", "18:00"]), case("alone", None)))
    answer = refseq("scenario", "report", tmp_path, "--across", "failures", "--across", "auc", "--markdown")
    failed, auc = answer.out.strip().split("\n\n")
    assert failed.splitlines()[:1] + failed.splitlines()[2:] == [
        "| failures | dial/0 | dial/1 |", "| a | 1 of 10 | 2 of 10 |", "| b | 9 of 10 | 9 of 10 |",
    ]  # fmt: skip
    assert auc.splitlines()[2:] == ["| a | 0.500 | 0.500 |", "| b | 0.500 | 0.500 |"]
    drawn = refseq("scenario", "report", tmp_path, "--across", "success", "--case", "dial/1")
    assert "80.0 % [49, 94]" in drawn.out
    assert "90.0" not in drawn.out


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (["--across", "recal"], "--across 'recal' is no figure of this campaign; valid are success, success_narrow,"),
        (
            ["--across", "auc", "--case", "dail"],
            "--case 'dail' is not in this campaign; valid are dial, dial/0, dial/1",
        ),
        (["--case", "dial"], "--case goes with --across; valid is to name a figure as well"),
        (["--figures", "--json"], "--figures and --json exclude each other; valid is one of them"),
        (["--figures", "--across", "auc"], "--figures and --across exclude each other; valid is one of them"),
    ],
)
def test_a_table_of_what_is_not_there_is_one_line(asked: list[str], told: str, tmp_path: Path, refseq: Refseq) -> None:
    write_result(tmp_path, campaign(*dial_cases(["noon", "18:00"])))
    answer = refseq("scenario", "report", tmp_path, *asked)
    assert (answer.code, answer.err.count("\n")) == (2, 1)
    assert told in answer.err


def test_report_tells_of_a_campaign_from_its_folder_alone(tmp_path: Path, refseq: Refseq) -> None:
    write_result(tmp_path, MIXED)
    answer = refseq("scenario", "report", tmp_path, "--figures")
    assert answer.code == 0
    said = " ".join(answer.out.split())
    for words in (
        "1 passed, 1 failed, 1 not judged; 1 failed (not blocking); 1 min 01 s",
        "not complete",
        "good/a,b a 90.0 % [60, 98] in 1.5 m",
        "bad: missed: success >= 1",
        "calm: too slow | <b>",
        "b 30.0 % [11, 60] of 10",
    ):
        assert words in said
    assert said.index("bad: and more") < said.index("calm: too slow")


def test_a_case_without_answers_has_no_share_within_anything(tmp_path: Path, refseq: Refseq) -> None:
    write_result(tmp_path, campaign(case("bad", Verdict.FAILED)))
    assert "n/a in" not in refseq("scenario", "report", tmp_path).out
    assert "n/a in" not in report_markdown(campaign(case("bad", Verdict.FAILED)), figures=True)


@pytest.mark.parametrize(
    ("judgement", "told"),
    [
        (MISSED, "it is 0.9; the bound is 1"),
        (MISSED.model_copy(update={"unit": "%"}), "it is 90 %; the bound is 100 %"),
        (MISSED.model_copy(update={"unit": "m"}), "it is 0.9 m; the bound is 1 m"),
        (MISSED.model_copy(update={"value": None}), "it is without end; the bound is 1"),
        (MISSED.model_copy(update={"reason": "1 of 5 seeds were run"}), "1 of 5 seeds were run"),
    ],
)
def test_a_judgement_tells_what_decided(judgement: JudgementRecord, told: str) -> None:
    assert judgement.explanation == told


def test_what_is_varied_is_told_in_words() -> None:
    fault = {"kind": "kidnap", "at": 30.0}
    varied = {"query.light": "noon", "localise.sensors": ["laser", "camera-1"], "query.faults": [fault]}
    assert case("x", None, varied=varied).varied_words == {
        "query.light": "noon",
        "localise.sensors": "laser + camera-1",
        "query.faults": "kind kidnap, at 30.0",
    }


def test_index_leads_to_each_case_and_tells_why_it_did_not_pass() -> None:
    page = Page(text := index_page(MIXED, []))
    assert page.open == []
    rows = [row for row in page.rows if row[0] != "verdict"]
    order = ["good/a,b", "bad", "late", "calm"]  # those that decide first
    assert [row[1] for row in rows if len(row) == 8 and row[1] in order] == order
    assert ["", ""] in rows
    assert "<p>missed: success &gt;= 1 (and 1 more)</p>" in text
    assert next(row for row in rows if row[1] == "good/a,b")[5] == "1 of 10"
    assert "too slow | &lt;b&gt;" in text
    assert "n/a in" not in text
    assert "within n/a" not in text


def test_report_of_no_campaign_is_one_line(tmp_path: Path, refseq: Refseq) -> None:
    answer = refseq("scenario", "report", tmp_path)
    assert answer.code == 2
    assert answer.err.count("\n") == 1
    assert "valid is the folder of a campaign" in answer.err


def dial_cases(values: list[object], key: str = "query.light") -> list[CaseRecord]:
    return [
        case(f"dial/{i}", Verdict.PASSED, varied={key: value}, methods=(method("a", 9 - i), method("b", 1)))
        for i, value in enumerate(values)
    ]


def test_dial_shows_success_over_the_one_key_that_is_varied() -> None:
    dial = sweep_plot_of(dial_cases(["noon", "18:00", "morning"]))
    assert dial is not None
    # In the order of the hours, not of the cases.
    assert dial.values == ("morning", "noon", "18:00")
    assert dial.rows == (
        ("a", ("70.0 % [40, 89]", "90.0 % [60, 98]", "80.0 % [49, 94]")),
        ("b", ("10.0 % [2, 40]",) * 3),
    )
    svg = dial.plot.svg
    assert all(f">{light}<" in svg for light in ("noon", "18:00", "morning"))
    places = {
        light: float(svg[: svg.index(f">{light}<")].rpartition('x="')[2].partition('"')[0]) for light in dial.values
    }
    # From 09:00 to 13:00 (of summer time) are four hours, from there to 18:00 five.
    steps = places["noon"] - places["morning"], places["18:00"] - places["noon"]
    assert steps[0] > 0
    assert steps[1] == pytest.approx(5 / 4 * steps[0], rel=1e-3)


def test_labels_of_the_dial_that_would_run_into_each_other_stand_on_two_lines() -> None:
    dial = sweep_plot_of(dial_cases(["09:00", "18:00", "18:30", "23:00"]))
    assert dial is not None
    svg = dial.plot.svg
    heights = {label: float(svg[: svg.index(f')">{label}<')].rpartition(" ")[2]) for label in dial.values}
    assert heights.pop("18:30") > heights["18:00"] + 8
    assert len(set(heights.values())) == 1


@pytest.mark.parametrize("values", [[1.0, 2.0], [["laser"], ["camera-1", "laser"]], ["noon", "13:00"]])
def test_dial_takes_numbers_lists_and_lights_of_one_hour(values: list[object]) -> None:
    dial = sweep_plot_of(dial_cases(values))
    assert dial is not None
    assert len(dial.values) == 2


def test_what_has_no_axis_stays_in_the_order_of_the_cases() -> None:
    dial = sweep_plot_of(dial_cases([["laser"], ["camera-1", "laser"], []], "localise.sensors"))
    assert dial is not None
    assert dial.values == ("laser", "camera-1 + laser", "none")


def test_there_is_no_dial_without_one_key() -> None:
    assert sweep_plot_of(dial_cases(["noon"])) is None
    assert sweep_plot_of([case("x/1", Verdict.PASSED), case("x/2", Verdict.PASSED)]) is None
    two_keys = [one.model_copy(update={"varied": {"p": 1, "q": 2}}) for one in dial_cases([1, 2])]
    assert sweep_plot_of(two_keys) is None


def test_a_method_without_answers_leaves_a_gap() -> None:
    first, second = dial_cases([1, 2])
    dial = sweep_plot_of([first, second.model_copy(update={"methods": (method("a", 5),)})])
    assert dial is not None
    assert dial.rows[1] == ("b", ("10.0 % [2, 40]", "n/a"))


@pytest.mark.parametrize("page", ["scenarios", "ci"])
def test_failure_and_error_mean_the_same_on_all_pages(page: str) -> None:
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    assert VERDICTS in " ".join(text.replace("*", "").split())
    assert VERDICTS in html.unescape(index_page(MIXED, []))
