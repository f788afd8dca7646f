import errno
import fcntl
import html
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from junitparser import JUnitXml

from refseq.logs import read_recording
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import DATA
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.results import Results, slugs
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.campaign.store.result_file import CampaignRecord, JudgementRecord, read_result
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.report.images import picture
from refseq_bench.scenarios.scoring.figures import figures_record
from refseq_bench.scenarios.scoring.path_geometry import WIDE
from refseq_bench.scenarios.scoring.score import score
from refseq_bench.scenarios.scoring.tables.worst_failures import worst_failures
from tests.scenarios.campaign.made import carried_out, made_cases, write_logs
from tests.scenarios.report.test_document import Page


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    write_logs(folder)
    return folder


@pytest.fixture(scope="module")
def done(home: Path) -> Judged:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(DATA, str(home))
        return carried_out(made_cases(home)[0], Store(home / "store"))


@pytest.fixture(scope="module")
def filled(home: Path, done: Judged) -> Path:
    """The folder of a campaign of one case."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(DATA, str(home))
        results = Results(home / "out", [done.case], Store(home / "store"))
        results.add(done)
    return home / "out"


def strict(text: str) -> object:
    """JSON as every reader understands it."""

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def test_made_campaign_has_what_the_tests_are_about(done: Judged) -> None:
    assert not done.mishaps
    assert {one.met for one in done.judgements} == {True, False}
    assert done.figures[0].wide.off_map.any()


def test_result_file_tells_what_was_judged(done: Judged, filled: Path) -> None:
    strict((filled / "result.json").read_text())
    record = read_result(filled)
    (case,) = record.cases
    assert record.complete
    assert (case.verdict, case.reasons) == (done.verdict, done.reasons)
    assert [(one.text, one.met) for one in case.judgements] == [(one.text, one.met) for one in done.judgements]
    assert case.judgements[0].value == done.judgements[0].value
    for one in done.figures:
        kept = case.method(one.method)
        assert kept is not None
        assert kept.figures == figures_record(one)
        assert (kept.success.right, kept.success.of) == (one.wide.success.successes, one.wide.success.trials)
        assert (kept.success.low, kept.success.high) == one.wide.success.interval
        assert tuple(kept.digests.values()) == done.digests[one.method]
        assert [cost.bytes_kept for cost in kept.costs.values()] == [cost.bytes_kept for cost in done.costs[one.method]]
    assert set(case.seeds) == {1, 2}
    for seed, run in zip(case.seeds.values(), done.comparisons, strict=True):
        assert (seed.learnt_views, seed.asked_views) == (len(run.reference_views), len(run.query_views))
    assert case.seeds[1].reference != case.seeds[2].reference  # another noise is another drive
    assert case.resolved["localise"]["sensors"] == ["forward", "laser"]
    assert "numpy" in record.versions


def test_result_file_is_read_back_as_it_was_written(filled: Path) -> None:
    record = read_result(filled)
    assert CampaignRecord.model_validate_json(record.model_dump_json()) == record


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, "cannot be read"),
        ("{}", "is no result of a campaign: started: Field required"),
        ("no JSON", "is no result of a campaign: Invalid JSON"),
    ],
)
def test_what_is_no_result_is_told_in_one_line(tmp_path: Path, text: str | None, told: str) -> None:
    if text is not None:
        (tmp_path / "result.json").write_text(text)
    with pytest.raises(ScenarioError, match=told) as caught:
        read_result(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_way_that_never_ended_is_null() -> None:
    record = JudgementRecord(text="to_lost <= 5 m", met=False, value=math.inf, bound=5.0, reason="")
    assert (record.value, record.explanation) == (None, "it is without end; the bound is 5")
    strict(record.model_dump_json())


def test_result_of_another_form_is_refused(tmp_path: Path, filled: Path) -> None:
    content = json.loads((filled / "result.json").read_text())
    del content["seconds"]  # its keys are others too
    (tmp_path / "result.json").write_text(json.dumps({**content, "format": 99}))
    with pytest.raises(ScenarioError, match="has format 99; this bench reads 2"):
        read_result(tmp_path)


def test_page_holds_every_figure_and_every_expectation(done: Judged, filled: Path) -> None:
    page = Page((filled / "made" / "report.html").read_text())
    records = [figures_record(one) for one in done.figures]
    for name in records[0]:
        assert page.row(name)[1:] == ["n/a" if record[name] is None else str(record[name]) for record in records]
    for judgement in done.judgements:
        row = next(row for row in page.rows if judgement.text in row)
        assert row[1:] != ["", ""]


def test_pages_need_nothing_from_elsewhere(filled: Path) -> None:
    pages = list(filled.rglob("*.html"))
    assert filled / "made" / "report.html" in pages
    for path in pages:
        text = path.read_text()
        page = Page(text)
        assert page.open == []
        assert text.count("<script") == 1
        assert not re.search(r"<link|<iframe|<object|@import|url\((?!#)", text)
        for source in page.fetched:
            if not source.startswith(("data:", "#")):
                assert (path.parent / source).resolve().is_relative_to(filled)
                assert (path.parent / source).is_file()


def test_frames_of_the_worst_failures_are_read_from_the_store(home: Path, done: Judged, filled: Path) -> None:
    assert not any(view.images for run in done.comparisons for view in run.query_views)
    page = Page((filled / "made" / "report.html").read_text())
    shown = [alt for alt, _ in page.pictures if re.fullmatch(r"forward, query view \d+", alt)]
    scores = [score(one, "thesis/chain", WIDE) for one in done.comparisons]
    worst = worst_failures(done.comparisons, scores, "thesis/chain")
    assert shown == [f"forward, query view {failure.view}" for failure in worst]
    assert worst
    # Query view, place answered, right place: each of its own drive.
    reference, query = (read_recording(home / f"{name}.mcap").views for name in ("reference", "query"))
    triples = [(query[one.view], reference[one.answer], reference[one.right]) for one in worst]
    at_failures = [source for alt, source in page.pictures if not re.search("reference place", alt)]
    assert at_failures == [picture(view.images["forward"]) for triple in triples for view in triple]


def test_resolved_text_from_outside_is_escaped(filled: Path) -> None:
    for path in filled.rglob("*.html"):
        assert "<by>" not in path.read_text()
    assert '"title": "Made <by> rule & kept"' in html.unescape((filled / "made" / "report.html").read_text())


# --- JUnit ---


def outcomes(suite_file: Path) -> dict[str, str]:
    """What became of each test, by an XML reader that knows nothing of JUnit."""
    found = {}
    for test in ElementTree.parse(suite_file).getroot().iter("testcase"):
        kinds = [child.tag for child in test if child.tag in ("failure", "error", "skipped")]
        assert len(kinds) <= 1
        found[f"{test.get('classname')}: {test.get('name')}"] = kinds[0] if kinds else "passed"
    return found


def counts(path: Path) -> tuple[int, int, int, int]:
    root = ElementTree.parse(path).getroot()
    suites = list(root.iter("testsuite"))
    return tuple(
        sum(int(suite.get(key, "0")) for suite in suites) for key in ("tests", "failures", "errors", "skipped")
    )  # type: ignore[return-value]


def test_junit_has_a_test_an_expectation_and_one_for_running(done: Judged, filled: Path) -> None:
    kinds = {True: "passed", False: "failure", None: "skipped"}
    expected = {f"made: {one.text}": kinds[one.met] for one in done.judgements}
    assert outcomes(filled / "junit.xml") == {"made: ran": "passed", **expected}


def test_junit_is_what_servers_fold_and_link(
    home: Path, done: Judged, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Jenkins takes a class's name to its last dot for a package; a file is given as seen from the checkout."""
    monkeypatch.setenv(DATA, str(home))
    case = replace(done.case, name="fig-2.11-2.13-sensors/camera-1+laser", file=tmp_path / "my" / "fig.toml")
    for here, file in ((tmp_path, "my/fig.toml"), (tmp_path / "my", "fig.toml"), (home, None)):
        here.mkdir(exist_ok=True)
        monkeypatch.chdir(here)
        Results(tmp_path / "out", [case], Store(home / "store"))
        root = ElementTree.parse(tmp_path / "out" / "junit.xml").getroot()
        (test,) = root.iter("testcase")
        assert (test.get("classname"), test.get("file")) == ("fig-2_11-2_13-sensors.camera-1+laser", file)
        (suite,) = root.iter("testsuite")
        assert datetime.fromisoformat(suite.get("timestamp", "")).tzinfo is None


def results_of(
    home: Path, out: Path, case: Case, *changed: Judged, monkeypatch: pytest.MonkeyPatch
) -> Path:  # fmt: skip
    monkeypatch.setenv(DATA, str(home))
    results = Results(out, [case], Store(home / "store"))
    for one in changed:
        results.add(one)
    return out / "junit.xml"


def bare(done: Judged, verdict: Verdict, *mishaps: TaskOutcome) -> Judged:
    """A case of which nothing could be answered."""
    nothing = replace(
        done, verdict=verdict, judgements=(), figures=(), comparisons=(), costs={}, digests={}, answered={}
    )
    return replace(nothing, mishaps=mishaps, reasons=tuple(one.reason for one in mishaps) or ("in judging",))


@pytest.mark.parametrize(
    ("verdict", "mishaps", "expected"),
    [
        (Verdict.ERROR, (TaskOutcome(Verdict.ERROR, "broke\x1b[31m", "trace\x00"),), "error"),
        (Verdict.ERROR, (), "error"),
        (Verdict.FAILED, (TaskOutcome(Verdict.FAILED, "stuck at 3 m"),), "failure"),
        (Verdict.ERROR, (TaskOutcome(Verdict.FAILED, "stuck"), TaskOutcome(Verdict.ERROR, "broke")), "error"),
        (Verdict.SKIPPED, (TaskOutcome(Verdict.SKIPPED, "no such log"),), "skipped"),
    ],
)
@pytest.mark.parametrize("blocking", [True, False])
def test_failures_errors_and_what_is_skipped_are_told_apart(
    home: Path,
    done: Judged,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    verdict: Verdict,
    mishaps: tuple[TaskOutcome, ...],
    expected: str,
    blocking: bool,
) -> None:
    case = replace(done.case, scenario=done.case.scenario.model_copy(update={"blocking": blocking}))
    result = replace(bare(done, verdict, *mishaps), case=case)
    path = results_of(home, tmp_path, case, result, monkeypatch=monkeypatch)
    assert outcomes(path) == {"made: ran": expected if blocking else "skipped"}
    (suite,) = JUnitXml.fromfile(str(path))
    (test,) = suite
    if not blocking and verdict is not Verdict.SKIPPED:
        assert str(test.result[0].message).startswith(f"not blocking, {expected}: ")
    assert (suite.failures, suite.errors, suite.skipped) == counts(path)[1:]


def test_a_campaign_is_complete_when_all_cases_are_judged(
    home: Path, done: Judged, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DATA, str(home))
    other = replace(done.case, name="other")
    results = Results(tmp_path, [done.case, other], Store(home / "store"))
    told = []
    for case in (done.case, other):
        results.add(replace(bare(done, Verdict.FAILED), case=case))
        told.append((read_result(tmp_path).complete, outcomes(tmp_path / "junit.xml")["other: ran"]))
    assert told == [(False, "error"), (True, "passed")]


def test_what_is_not_judged_yet_is_an_error(
    home: Path, done: Judged, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = results_of(home, tmp_path, done.case, monkeypatch=monkeypatch)
    assert outcomes(path) == {"made: ran": "error"}
    assert not read_result(tmp_path).complete
    assert "not judged" in (tmp_path / "index.html").read_text()


# --- the folder ---


def test_folder_that_cannot_be_written_is_told_before_anything_is_done(done: Judged, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="cannot hold the results"):
        Results(tmp_path / "file", [done.case], Store(tmp_path / "store"))


def test_full_disk_is_told_in_one_line(
    home: Path, done: Judged, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DATA, str(home))
    results = Results(tmp_path, [done.case], Store(home / "store"))
    before = (tmp_path / "result.json").read_bytes()

    def full(path: Path, content: str) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("refseq_bench.scenarios.campaign.results.replace_text", full)
    with pytest.raises(ScenarioError, match=r"report\.html: cannot be written: No space left on device$"):
        results.add(bare(done, Verdict.FAILED))
    assert (tmp_path / "result.json").read_bytes() == before


@given(st.lists(st.text(min_size=1, max_size=120), unique=True, max_size=20))
def test_every_case_has_a_folder_of_its_own_that_any_system_takes(names: list[str]) -> None:
    found = slugs(names)
    assert list(found) == names
    assert len({slug.lower() for slug in found.values()}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9_+][A-Za-z0-9._+-]*", slug) and len(slug) <= 100 for slug in found.values())


def test_slugs_are_the_names_where_these_will_do() -> None:
    assert slugs(["light-dial/08:00", "fig-2.7-laboratory"]) == {
        "light-dial/08:00": "light-dial-08-00",
        "fig-2.7-laboratory": "fig-2.7-laboratory",
    }


def test_a_folder_that_another_process_fills_is_refused(tmp_path: Path, done: Judged) -> None:
    tmp_path.joinpath("out").mkdir()
    hold = (
        "import fcntl, os, sys; lock = os.open(sys.argv[1], os.O_RDONLY); fcntl.flock(lock, fcntl.LOCK_EX); "
        "print('held', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", hold, tmp_path / "out"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(ScenarioError, match=r"out: another run is filling it; valid is a folder of its own$"):
            Results(tmp_path / "out", [done.case], Store(tmp_path / "store"))
        assert list((tmp_path / "out").iterdir()) == []
        other.kill()
    Results(tmp_path / "out", [done.case], Store(tmp_path / "store"))


def test_a_folder_is_free_when_its_campaign_is_complete(
    home: Path, tmp_path: Path, done: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DATA, str(home))
    results = Results(tmp_path, [done.case], Store(tmp_path / "store"))
    lock = os.open(tmp_path, os.O_RDONLY)
    with pytest.raises(BlockingIOError):
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    results.add(done)
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(lock)


def test_a_page_that_no_run_has_made_stays_as_it_is(tmp_path: Path, done: Judged) -> None:
    (tmp_path / "index.html").write_text("mine")
    with pytest.raises(ScenarioError, match=r"holds an index\.html that no run has made; valid is a new folder, or"):
        Results(tmp_path, [done.case], Store(tmp_path / "store"))
    assert (tmp_path / "index.html").read_text() == "mine"


def test_a_disk_that_has_no_room_for_all_files_keeps_none_of_them(
    home: Path, done: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Verdicts without their page would be half a result."""
    monkeypatch.setenv(DATA, str(home))

    def full(path: Path, text: str) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    folder, older = home / "full", home / "older"
    Results(older, [done.case], Store(home / "store")).close()
    before = {file.name: file.read_bytes() for file in older.iterdir()}
    monkeypatch.setattr("refseq_bench.scenarios.campaign.results.replace_text", full)
    for place in (folder, older):
        with pytest.raises(ScenarioError, match=f"{place}.*: No space left on device"):
            Results(place, [done.case], Store(home / "store"))
    assert not folder.exists()
    assert {file.name: file.read_bytes() for file in older.iterdir()} == before
    monkeypatch.undo()
    monkeypatch.setenv(DATA, str(home))
    Results(folder, [done.case], Store(home / "store")).close()  # nobody holds it
    assert len(list(folder.iterdir())) == len(before)
