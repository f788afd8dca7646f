"""A real cluster of two nodes on this machine: what it makes is what is made here, also when one node is lost."""

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from refseq.logs import open_log, plan_views
from refseq_bench.scenarios.campaign.campaign import Watcher, run_campaign
from refseq_bench.scenarios.campaign.declare.case import Case
from refseq_bench.scenarios.campaign.declare.cases import load
from refseq_bench.scenarios.campaign.declare.outcomes import TaskOutcome, Verdict
from refseq_bench.scenarios.campaign.judge.drives import Judged
from refseq_bench.scenarios.campaign.run import remote_payload
from refseq_bench.scenarios.campaign.run.case_tasks import answer_tasks
from refseq_bench.scenarios.campaign.run.remote_payload import (
    NodeFingerprint,
    RemoteResult,
    RemoteTask,
    carry_out,
    here,
    remote_task_for,
)
from refseq_bench.scenarios.campaign.run.tasks import RecordTask, distinct, perform
from refseq_bench.scenarios.campaign.run.workers import LocalWorkers, WorkerPool
from refseq_bench.scenarios.campaign.store.cache import ANSWERS, DESCRIPTIONS, MAP, RECORDING, Store
from refseq_bench.scenarios.log_tools.rewriting.conversion import LogFormat, convert
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.scenarios.campaign.chores import Dying, Hanging, scenario_in

# --- what goes with a task, carried out in this process in place of another machine ---


def contents(order: RemoteTask) -> list[bytes]:
    return [piece.path.read_bytes() for piece in order.pieces]


@pytest.fixture
def in_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process below the worker, which costs seconds to begin, is left out."""

    class Here:
        def call(self, mishap: object, limit: float, function: Any, *given: object) -> Any:
            return type("Done", (), {"result": lambda self: function(*given)})()

    monkeypatch.setattr(remote_payload, "_process", Here)
    monkeypatch.delenv("REFSEQ_RECORDINGS", raising=False)


def test_a_task_goes_with_all_that_it_reads_and_comes_back_with_all_that_it_makes(
    tmp_path: Path, in_process: None
) -> None:
    case = load(scenario_in(tmp_path))[0]
    local, elsewhere = Store(tmp_path / "local"), Store(tmp_path / "elsewhere")
    tasks = distinct([task for asked in answer_tasks(case).values() for task in asked])
    for task in tasks:
        assert perform(task, local).good
        order = remote_task_for(task, elsewhere)
        sent = contents(order)
        (tmp_path / "small.toml").rename(tmp_path / "hidden")  # the other machine does not have the plan
        delivery = carry_out(order, *sent)
        (tmp_path / "hidden").rename(tmp_path / "small.toml")
        assert delivery.outcome.good, delivery.outcome.reason
        for name, content in delivery.files.items():
            (elsewhere.folder / name).write_bytes(content)
    again = [piece.path.suffix for piece in remote_task_for(tasks[-1], elsewhere).pieces]
    assert sorted(again) == [RECORDING, RECORDING, MAP]  # what was learnt before goes with who asks again
    names = {path.name for path in local.folder.iterdir()} - {DESCRIPTIONS}
    assert {path.name for path in elsewhere.folder.iterdir()} == names
    for name in names:
        if name.endswith(RECORDING):
            assert (local.folder / name).read_bytes() == (elsewhere.folder / name).read_bytes()


@pytest.mark.quick_cases("deep/drive.mcap-mcap-names0")
@pytest.mark.parametrize(
    ("log", "form", "names"),
    [
        ("deep/drive.mcap", LogFormat.MCAP, ["deep/drive.mcap"]),
        ("deep/bag", LogFormat.ROSBAG2, ["deep/bag/bag.mcap", "deep/bag/metadata.yaml"]),
    ],
)
def test_real_recordings_go_with_a_task(
    log: str, form: LogFormat, names: list[str], tmp_path: Path, in_process: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "real"
    (home / "deep").mkdir(parents=True)
    case = load(scenario_in(tmp_path))[0]
    drive = case.sources(1)[0]
    store = Store(tmp_path / "store")
    record = RecordTask(drive, 60.0)  # type: ignore[arg-type]
    assert perform(record, store).good
    convert(plan_views(open_log(store.path(record.key, RECORDING))), home / log, form, {})
    text = (
        f'title = "A log"\nseeds = [1]\n[localise]\nmethods = ["thesis"]\n[reference]\nlog = "{log}"\n'
        "odometry_noise = true\n"
    )
    (tmp_path / "log.toml").write_text(text)
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(home))
    task = answer_tasks(load(tmp_path / "log.toml")[0])[1][0]
    order = remote_task_for(task, store)
    assert [piece.name for piece in order.pieces if piece.where == remote_payload.REAL] == names
    sent = contents(order)
    monkeypatch.setenv("REFSEQ_RECORDINGS", str(tmp_path / "nowhere"))
    delivery = carry_out(order, *sent)
    assert delivery.outcome.good, delivery.outcome.reason
    assert f"{task.key}{ANSWERS}" in delivery.files


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (lambda one: replace(one, sources="0123456789ab"), "the code differs (digest "),
        (lambda one: replace(one, packages={**one.packages, "numpy": "1.0"}), "numpy is "),
    ],
    ids=["code", "packages"],
)
def test_a_machine_that_would_make_something_else_is_refused(
    tmp_path: Path, other: Callable[[NodeFingerprint], NodeFingerprint], said: str
) -> None:
    place = other(here())
    task = answer_tasks(load(scenario_in(tmp_path))[0])[1][0].needs[0]
    delivery = carry_out(RemoteTask(task, place, {}, ()))
    assert delivery.outcome.verdict is Verdict.ERROR
    assert said in delivery.outcome.reason
    assert "valid is the same checkout and lock on all nodes" in delivery.outcome.reason
    assert not delivery.files


def test_only_pictures_depend_on_the_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote_payload, "_carried_out", lambda *given: RemoteResult(TaskOutcome(Verdict.PASSED), {}))
    drive = answer_tasks(load(scenario_in(tmp_path))[0])[1][0].needs[0].drive
    place = replace(
        here(), devices=dict.fromkeys(RendererKind, "another") | {RendererKind.NONE: here().devices[RendererKind.NONE]}
    )
    reasons = [
        carry_out(RemoteTask(RecordTask(replace(drive, renderer=renderer), 60.0), place, {}, ())).outcome.reason
        for renderer in RendererKind
    ]
    for renderer, reason in zip(RendererKind, reasons, strict=True):
        told = f"the device of {renderer} is {here().devices[renderer]} there and another here"
        assert (told in reason) is (renderer is not RendererKind.NONE)
    assert [bool(reason) for reason in reasons].count(False) == 1


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("nowhere_to_be_found:Mine", "there is no module 'nowhere_to_be_found'"),
        ("of_another_digest:Mine", "the code of of_another_digest:Mine differs"),
    ],
)
def test_a_localiser_that_the_other_machine_does_not_have_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    (tmp_path / "of_another_digest.py").write_text("class Mine: ...\n")
    monkeypatch.syspath_prepend(tmp_path)
    task = answer_tasks(load(scenario_in(tmp_path))[0])[1][0]
    delivery = carry_out(RemoteTask(task, here(), {name: "digest"}, ()))
    assert delivery.outcome.verdict is Verdict.ERROR
    assert said in delivery.outcome.reason


# --- two nodes ---


@pytest.fixture(scope="module")
def ray() -> Any:
    return pytest.importorskip("ray")


class Nodes:
    """A cluster of a head without cores and two nodes of one core each, so that either may be lost."""

    def __init__(self) -> None:
        from ray.cluster_utils import Cluster

        # The head lives on as the driver's own node does: it holds the campaign's inputs.
        self._cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
        self._nodes = [self._cluster.add_node(num_cpus=1) for _ in range(2)]
        self.address = self._cluster.address

    def kill_one(self) -> None:
        """As when the power fails: the node's processes end in the middle of what they do."""
        for processes in self._nodes.pop().all_processes.values():
            for one in processes:
                os.kill(one.process.pid, signal.SIGKILL)

    def close(self) -> None:
        self._cluster.shutdown()


@pytest.fixture
def nodes(ray: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Nodes]:
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    found = Nodes()
    yield found
    found.close()


def told(results: list[Judged]) -> list[Any]:
    """Verdicts and beliefs, bit for bit."""
    return [(one.case.name, one.verdict, dict(one.digests)) for one in sorted(results, key=lambda one: one.case.name)]


def conducted(cases: list[Case], executor: WorkerPool, store: Store, watcher: Watcher) -> list[Judged]:
    try:
        return list(run_campaign(cases, executor, store, watcher))
    finally:
        executor.close(at_once=False)


class Saboteur(Watcher):
    """Kills a node once a third of all is done, when both nodes have been at work for a tick."""

    def __init__(self, nodes: Nodes) -> None:
        self._nodes, self._running, self._ended, self._busy = nodes, 0, 0, 0
        self.killed_after = 0

    def started(self, task: object) -> None:
        self._running += 1
        self._busy = 0

    def ended(self, task: object, outcome: object) -> None:
        self._running -= 1
        self._ended += 1

    def tick(self) -> None:
        self._busy = self._busy + 1 if self._running == 2 else 0
        if not self.killed_after and self._ended >= 6 and self._busy >= 1:
            self.killed_after = self._ended
            self._nodes.kill_one()


def kept(store: Store) -> set[str]:
    """Names of what may be asked for again; descriptions of images stay on the machine that made them."""
    return {path.name for path in store.folder.iterdir() if not path.name.startswith(DESCRIPTIONS)}


@pytest.mark.slow
def test_beliefs_of_a_cluster_that_loses_a_node_are_those_of_this_machine(tmp_path: Path, nodes: Nodes) -> None:
    from refseq_bench.scenarios.campaign.run.ray_workers import RayWorkers

    cases = load(scenario_in(tmp_path, seeds=range(1, 7)))
    local, remote = Store(tmp_path / "local"), Store(tmp_path / "remote")
    expected = conducted(cases, LocalWorkers(1, local.folder), local, Watcher())

    saboteur = Saboteur(nodes)
    found = conducted(cases, RayWorkers(nodes.address, remote), remote, saboteur)
    assert 6 <= saboteur.killed_after < 18
    assert told(found) == told(expected)
    assert all(result.verdict is Verdict.PASSED for result in found)
    recordings = sorted(local.folder.glob(f"*{RECORDING}"))
    assert len(recordings) == 12
    for path in recordings:
        assert (remote.folder / path.name).read_bytes() == path.read_bytes()
    assert kept(local) == kept(remote)


@pytest.mark.slow
def test_what_breaks_on_a_node_is_told_as_on_this_machine(tmp_path: Path, nodes: Nodes) -> None:
    from refseq_bench.scenarios.campaign.run.ray_workers import RayWorkers

    store = Store(tmp_path)
    workers = RayWorkers(nodes.address, store)
    assert workers.workers == 2
    task = answer_tasks(load(scenario_in(tmp_path))[0])[1][0].needs[0]
    hanging = Hanging(task.drive, limit=1.0)
    dying = Dying(task.drive, limit=60.0)
    try:
        outcomes = [future.result(120) for future in [workers.submit(one) for one in (hanging, dying, task)]]
    finally:
        workers.close(at_once=True)
    assert [outcome.verdict for outcome in outcomes] == [Verdict.ERROR, Verdict.ERROR, Verdict.PASSED]
    assert "not done within 1 s (limits.seconds)" in outcomes[0].reason
    assert "was killed (SIGKILL)" in outcomes[1].reason
    assert store.has(task.key, RECORDING)
