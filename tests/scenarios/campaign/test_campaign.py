"""A campaign's order, and what it makes of tasks that fail and files that are damaged; its workers are threads."""

import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from refseq_bench.scenarios.campaign import campaign
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run.tasks import perform
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, DamagedError, Store
from refseq_bench.scenarios.errors import ScenarioError, UnwritableError
from tests.scenarios.campaign.chores import BITS, WHOLE, Chore, case_of, chores_of, judged_by_outcomes


@pytest.fixture(autouse=True)
def chores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "tasks_of", chores_of)
    monkeypatch.setattr(campaign, "judged", judged_by_outcomes)
    monkeypatch.setattr(campaign, "TICK", 0.05)


class Threads:
    """An executor that notes what it was given, and how much of it at a time."""

    def __init__(self, workers: int, store: Store) -> None:
        self.workers, self._store = workers, store
        self._pool, self._lock, self._now = ThreadPoolExecutor(8), threading.Lock(), 0
        self.most, self.order = 0, list[str]()

    def submit(self, task: Chore) -> "Future[TaskOutcome]":
        with self._lock:
            self.order.append(task.key)
            self._now += 1
            self.most = max(self.most, self._now)
        return self._pool.submit(self._perform, task)

    def _perform(self, task: Chore) -> TaskOutcome:
        try:
            return perform(task, self._store)
        finally:
            with self._lock:
                self._now -= 1

    def close(self, *, at_once: bool) -> None:
        self._pool.shutdown()


class Notes(Watcher):
    def __init__(self) -> None:
        self.lines, self.kept, self.verdicts = list[str](), list[str](), dict[str, str]()

    def noted(self, line: str) -> None:
        self.lines.append(line)

    def ended(self, task: Chore, outcome: TaskOutcome) -> None:
        if outcome.kept:
            self.kept.append(task.key)

    def judged(self, result: Judged) -> None:
        self.verdicts[result.case.name] = result.verdict.value


def conducted(
    store: Store, cases: Sequence[Case], workers: int = 2, fresh: bool = False
) -> tuple[list[Judged], Threads, Notes]:
    executor, notes = Threads(workers, store), Notes()
    return list(run_campaign(cases, executor, store, notes, fresh=fresh)), executor, notes


def verdicts(results: Sequence[Judged]) -> dict[str, str]:
    return {result.case.name: result.verdict.value for result in results}


# --- order ---


def test_first_cases_come_first_though_later_ones_could_begin(tmp_path: Path) -> None:
    drives = [Chore(f"drive-{n}") for n in range(4)]
    cases = [case_of(f"case-{n}", Chore(f"ask-{n}", needs=(drive,))) for n, drive in enumerate(drives)]
    results, executor, _ = conducted(Store(tmp_path), cases, workers=1)
    assert executor.order == [word for n in range(4) for word in (f"drive-{n}", f"ask-{n}")]
    assert [result.case.name for result in results] == [case.name for case in cases]


@st.composite
def plans(draw: st.DrawFn) -> list[list[Chore]]:
    """Cases whose tasks share what they need; some tasks fail."""
    does = st.sampled_from(["write", "write", "write", "raise"])
    drives = [Chore(f"drive-{n}", draw(does)) for n in range(draw(st.integers(1, 4)))]
    return [
        [
            Chore(f"ask-{c}-{n}", draw(does), tuple(draw(st.lists(st.sampled_from(drives), max_size=2, unique=True))))
            for n in range(draw(st.integers(1, 3)))
        ]
        for c in range(draw(st.integers(1, 4)))
    ]


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(plans(), st.integers(1, 4))
def test_whatever_is_asked_each_task_is_done_once_after_its_needs_and_each_case_judged_by_its_own(
    asked: list[list[Chore]], workers: int
) -> None:
    cases = [case_of(f"case-{n}", *chores) for n, chores in enumerate(asked)]
    with TemporaryDirectory() as folder:
        results, executor, _ = conducted(Store(Path(folder)), cases, workers)
    assert executor.most <= workers
    assert len(executor.order) == len(set(executor.order))
    chores = {chore.key: chore for chores in asked for chore in chores}
    for key, chore in chores.items():
        spoilt = any(need.does == "raise" for need in chore.needs)
        assert (key in executor.order) is not spoilt  # what cannot succeed is not begun
        for need in chore.needs if not spoilt else ():
            assert executor.order.index(need.key) < executor.order.index(key)
    bad = {
        f"case-{n}"
        for n, chores in enumerate(asked)
        if any(task.does == "raise" for chore in chores for task in (chore, *chore.needs))
    }
    assert verdicts(results) == {case.name: "error" if case.name in bad else "passed" for case in cases}


# --- what is kept ---


def test_what_is_kept_is_not_done_again_and_fresh_asks_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "Question", Answer)
    store, drive = Store(tmp_path), Chore("drive")
    cases = [case_of("a", Answer("ask", needs=(drive,)))]
    assert conducted(store, cases)[1].order == ["drive", "ask"]
    _, executor, notes = conducted(store, cases)
    assert executor.order == []
    assert notes.kept == ["drive", "ask"]
    _, executor, notes = conducted(store, cases, fresh=True)
    assert executor.order == ["ask"]
    assert notes.kept == ["drive"]  # nor did the worker find the old answers


@dataclass(frozen=True)
class Answer(Chore):
    """A task that counts as a question; ``learnt`` are the maps that it did not find."""

    maps: tuple[str, ...] = ()
    learnt: list[str] = field(default_factory=list, compare=False)

    def carry_out(self, store: Store) -> None:
        for key in self.maps:
            store.make(key, ANSWERS, partial(self._learn, key))
        super().carry_out(store)

    def _learn(self, key: str, path: Path) -> None:
        self.learnt.append(key)
        path.write_bytes(WHOLE)


def test_fresh_learns_each_map_anew_and_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "Question", Answer)
    store, learnt = Store(tmp_path), list[str]()
    one, other = (Answer(key, maps=maps, learnt=learnt) for key, maps in (("a", ("shared", "own")), ("b", ("shared",))))
    for fresh in (False, False, True):
        conducted(store, [case_of("a", one), case_of("b", other)], workers=1, fresh=fresh)
    assert learnt == ["shared", "own"] * 2


def test_an_interrupted_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    store = Store(tmp_path)
    cases = [case_of(f"case-{n}", Chore(f"ask-{n}", needs=(Chore(f"drive-{n}"),))) for n in range(3)]
    executor = Threads(1, store)
    begun = run_campaign(cases, executor, store, Watcher())
    next(begun)
    begun.close()
    executor.close(at_once=True)
    done = {path.stem for path in tmp_path.glob("*.parquet")}
    assert {"drive-0", "ask-0"} <= done
    results, second, _ = conducted(store, cases)
    assert set(verdicts(results).values()) == {"passed"}
    assert not set(second.order) & done
    assert set(second.order) | done == {f"{kind}-{n}" for kind in ("drive", "ask") for n in range(3)}


def test_what_killed_workers_left_behind_is_swept(tmp_path: Path) -> None:
    (tmp_path / ".refseq-draft-dead").mkdir()
    conducted(Store(tmp_path), [case_of("a", Chore("ask"))])
    assert {path.name for path in tmp_path.iterdir()} == {f"ask{ANSWERS}"}


def test_the_store_is_not_searched_for_all_that_waits_again_and_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked, has = Counter[str](), Store.has

    def counted(store: Store, key: str, ending: str) -> bool:
        looked[key] += 1
        return has(store, key, ending)

    monkeypatch.setattr(Store, "has", counted)
    conducted(Store(tmp_path), [case_of(f"case-{n}", Chore(f"ask-{n}")) for n in range(20)], workers=1)
    assert max(looked.values()) == 3  # as it begins to wait, in its turn, and by the worker


def test_what_another_campaign_has_made_meanwhile_is_not_made_again(tmp_path: Path) -> None:
    store = Store(tmp_path)

    class Watch(Notes):
        def started(self, task: Chore) -> None:
            Chore("second").carry_out(store)

    executor, notes = Threads(1, store), Watch()
    list(run_campaign([case_of("a", Chore("first"), Chore("second"))], executor, store, notes))
    assert (executor.order, notes.kept) == (["first"], ["second"])


def test_two_campaigns_at_once_share_a_store(tmp_path: Path) -> None:
    cases = [case_of(f"case-{n}", Chore(f"ask-{n}", needs=(Chore("drive"),))) for n in range(6)]
    both: list[list[Judged]] = []
    threads = [threading.Thread(target=lambda: both.append(conducted(Store(tmp_path), cases)[0])) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [set(verdicts(results).values()) for results in both] == [{"passed"}, {"passed"}]
    assert {path.read_bytes() for path in tmp_path.glob("*.parquet")} == {WHOLE}


# --- damage ---


def test_what_is_cut_off_is_made_anew_and_told(tmp_path: Path) -> None:
    store, drive = Store(tmp_path), Chore("drive")
    cases = [case_of("a", Chore("ask", needs=(drive,)))]
    conducted(store, cases)
    store.path("ask", ANSWERS).write_bytes(WHOLE[:-2])
    results, executor, notes = conducted(store, cases)
    assert verdicts(results) == {"a": "passed"}
    assert executor.order == ["ask"]
    assert notes.lines == [f"{store.path('ask', ANSWERS)}: is cut off or damaged; it is made anew"]


def test_damage_that_a_task_meets_is_repaired_once_for_all_who_meet_it(tmp_path: Path) -> None:
    store, drive = Store(tmp_path), Chore("drive")
    store.path("drive", ANSWERS).write_bytes(BITS)
    cases = [case_of(f"case-{n}", Chore(f"ask-{n}", needs=(drive,))) for n in range(3)]
    results, executor, notes = conducted(store, cases, workers=3)
    assert set(verdicts(results).values()) == {"passed"}
    assert executor.order.count("drive") == 1
    assert len(notes.lines) == 1
    assert "drive is damaged; it is made anew" in notes.lines[0]


def test_damage_that_judging_meets_is_repaired(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.path("ask", ANSWERS).write_bytes(BITS)
    results, executor, notes = conducted(store, [case_of("a", Chore("ask")), case_of("b", Chore("other"))])
    assert verdicts(results) == {"a": "passed", "b": "passed"}
    assert executor.order.count("ask") == 1
    assert notes.lines == ["ask is damaged; it is made anew"]


def test_what_stays_damaged_is_an_error_of_its_case_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Chore, "_make", lambda chore, path: path.write_bytes(BITS if chore.key == "bad" else WHOLE))
    cases = [case_of("a", Chore("ask", needs=(Chore("bad"),))), case_of("b", Chore("bad")), case_of("c", Chore("good"))]
    results, executor, _ = conducted(Store(tmp_path), cases)
    assert verdicts(results) == {"a": "error", "b": "error", "c": "passed"}
    assert executor.order.count("bad") == 2


# --- judging ---


def test_a_case_that_cannot_be_judged_stops_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def judged(case: Case, *given: object) -> Judged:
        if case.name == "known":
            raise ScenarioError("there is no true pose")
        if case.name == "unknown":
            raise ZeroDivisionError("by\nnought")
        return judged_by_outcomes(case, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(campaign, "judged", judged)
    results, _, _ = conducted(Store(tmp_path), [case_of(name, Chore(name)) for name in ("known", "unknown", "fine")])
    assert {result.case.name: (result.verdict, result.reasons) for result in results} == {
        "known": (Verdict.ERROR, ("judging: there is no true pose",)),
        "unknown": (Verdict.ERROR, ("judging: ZeroDivisionError: by nought",)),
        "fine": (Verdict.PASSED, ()),
    }


class AbsentChore:
    """A question whose key hangs on a real recording that is not there, as those of scenarios do."""

    needs = ()

    @property
    def key(self) -> str:
        raise AbsentError("a.log: is not there")


def test_what_is_not_on_this_machine_is_skipped(tmp_path: Path) -> None:
    store, notes, concluded = Store(tmp_path), Notes(), list[Judged]()
    cases = [case_of("absent", AbsentChore()), case_of("there", Chore("b"))]  # type: ignore[arg-type]
    results = list(run_campaign(cases, Threads(1, store), store, notes, conclude=concluded.append))
    assert verdicts(results) == notes.verdicts == {"absent": "skipped", "there": "passed"}
    assert results[0].reasons == ("a.log: is not there",)
    assert concluded == results


def test_cases_that_share_damage_are_judged_after_its_repair(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.path("ask", ANSWERS).write_bytes(BITS)
    results, executor, notes = conducted(store, [case_of(name, Chore("ask"), Chore(f"own-{name}")) for name in "abc"])
    assert verdicts(results) == dict.fromkeys("abc", "passed")
    assert executor.order.count("ask") == 1
    assert notes.lines == ["ask is damaged; it is made anew"]


# --- who works ---


def test_a_campaign_whose_workers_are_lost_says_so_and_goes_on_with_others(tmp_path: Path) -> None:
    store, said = Store(tmp_path), list[str]()
    executor = Threads(0, store)

    class Watch(Watcher):
        def noted(self, line: str) -> None:
            said.append(line)
            executor.workers = 1

    results = list(run_campaign([case_of("a", Chore("ask"))], executor, store, Watch()))
    assert verdicts(results) == {"a": "passed"}
    assert said == ["there is no worker; the campaign waits for one", "there are workers"]


# --- what is done with a verdict ---


def test_each_verdict_is_concluded_before_it_is_yielded_and_work_goes_on_meanwhile(tmp_path: Path) -> None:
    store, concluded = Store(tmp_path), list[str]()
    second_done = threading.Event()

    def conclude(result: Judged) -> None:
        if result.case.name == "a":
            assert second_done.wait(10)  # the next case's task is done while this one is concluded
        concluded.append(result.case.name)

    class Watch(Watcher):
        def ended(self, task: Chore, outcome: TaskOutcome) -> None:
            if task.key == "b":
                second_done.set()

    executor, cases = Threads(1, store), [case_of("a", Chore("a")), case_of("b", Chore("b"))]
    for result in run_campaign(cases, executor, store, Watch(), conclude=conclude):
        assert result.case.name in concluded
    assert concluded == ["a", "b"]


def test_damage_that_concluding_meets_is_repaired(tmp_path: Path) -> None:
    store, met = Store(tmp_path), list[str]()

    def conclude(result: Judged) -> None:
        met.append(result.case.name)
        if len(met) == 1:
            raise DamagedError("ask", "ask is damaged")

    executor = Threads(1, store)
    results = list(run_campaign([case_of("a", Chore("ask"))], executor, store, Watcher(), conclude=conclude))
    assert verdicts(results) == {"a": "passed"}
    assert met == ["a", "a"]
    assert executor.order == ["ask", "ask"]


def test_one_verdict_is_concluded_at_a_time_and_no_thread_is_left(tmp_path: Path) -> None:
    before, store = threading.active_count(), Store(tmp_path)
    executor = Threads(3, store)
    alone = threading.Lock()

    def conclude(result: Judged) -> None:
        assert alone.acquire(blocking=False)
        time.sleep(0.02)
        alone.release()

    cases = [case_of(name, Chore(name)) for name in "abcd"]
    results = list(run_campaign(cases, executor, store, Watcher(), conclude=conclude))
    executor.close(at_once=False)
    assert verdicts(results) == dict.fromkeys("abcd", "passed")
    assert threading.active_count() <= before


def test_a_results_folder_that_cannot_be_written_ends_the_campaign(tmp_path: Path) -> None:
    def conclude(result: Judged) -> None:
        raise UnwritableError("out: cannot be written")

    store = Store(tmp_path)
    with pytest.raises(UnwritableError, match="out: cannot be written"):
        list(run_campaign([case_of("a", Chore("ask"))], Threads(1, store), store, Watcher(), conclude=conclude))


@pytest.mark.parametrize("tries", [1, 2])
def test_a_page_that_cannot_be_drawn_is_an_error_of_its_case_only(tmp_path: Path, tries: int) -> None:
    tried, concluded = Counter[str](), list[Judged]()

    def conclude(result: Judged) -> None:
        tried[result.case.name] += 1
        if result.case.name != "fine" and tried[result.case.name] <= tries:
            raise ValueError("no\nsample points")
        concluded.append(result)

    store, notes = Store(tmp_path), Notes()
    cases = [case_of("absent", AbsentChore()), case_of("drawn", Chore("a")), case_of("fine", Chore("b"))]  # type: ignore[arg-type]
    results = list(run_campaign(cases, Threads(1, store), store, notes, conclude=conclude))
    assert verdicts(results) == notes.verdicts == {"absent": "error", "drawn": "error", "fine": "passed"}
    assert concluded == (results if tries == 1 else results[2:])
    assert results[1].reasons == ("its page: ValueError: no sample points",)


def test_who_leaves_waits_for_the_page_that_is_written_and_begins_no_other(tmp_path: Path) -> None:
    begun, ended = list[str](), list[str]()

    def conclude(result: Judged) -> None:
        begun.append(result.case.name)
        time.sleep(0.3)
        ended.append(result.case.name)

    class Impatient(Watcher):
        def tick(self) -> None:
            if begun:
                raise KeyboardInterrupt

    store = Store(tmp_path)
    cases = [case_of(name, Chore(name)) for name in "ab"]
    with pytest.raises(KeyboardInterrupt):
        list(run_campaign(cases, Threads(1, store), store, Impatient(), conclude=conclude))
    assert begun == ended == ["a"]


def test_who_leaves_while_a_case_is_judged_has_no_page_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judging, concluded = threading.Event(), list[Judged]()

    def slow(*words: object) -> Judged:
        judging.set()
        time.sleep(0.3)
        return judged_by_outcomes(*words)

    class Impatient(Watcher):
        def tick(self) -> None:
            if judging.is_set():
                raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "judged", slow)
    store = Store(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        list(run_campaign([case_of("a", Chore("a"))], Threads(1, store), store, Impatient(), conclude=concluded.append))
    time.sleep(0.5)  # it would be concluded by then
    assert concluded == []
