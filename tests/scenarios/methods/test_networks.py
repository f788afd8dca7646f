from pathlib import Path

import pytest

from refseq.errors import MapError
from refseq.features.neural.network import FILE, key_network
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask, perform
from refseq_bench.scenarios.campaign.store.cache import Store
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.methods.checks import methods_named
from refseq_bench.scenarios.methods.networks import network_of
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.key_network import write_key_network


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """Another network than the one at hand."""
    return write_key_network(tmp_path / "other.onnx", seed=2)


def test_only_those_that_ask_a_network_have_one(monkeypatch: pytest.MonkeyPatch) -> None:
    digest = key_network((640, 480)).digest
    asking = (
        (["thesis/chain", "neural/hindsight", "vlad"], None, None),
        (["neural/chain"], None, ("camera-1", "laser")),
        (["best/chain"], ("sift", "neural"), None),
        (["hamming"], ("sift", "neural"), None),
    )
    others = (
        (["thesis/chain", "best/chain", "vlad"], None, None),
        (["neural/chain"], ("sift",), None),
        (["neural/chain"], None, ("laser",)),
    )
    assert [network_of(*one) for one in (*asking, *others)] == [digest] * len(asking) + [None] * len(others)
    monkeypatch.delenv(FILE)
    assert [network_of(*one) for one in others] == [None] * len(others)
    for one in asking:
        with pytest.raises(MapError, match=FILE):
            network_of(*one)


def test_all_methods_are_asked_without_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ``refseq compare`` without ``--methods``."""
    monkeypatch.delenv(FILE)
    assert "best/chain" in methods_named(None)
    assert network_of(methods_named(None)) is None
    assert methods_named(["neural"]) == ("neural/uniform", "neural/prior", "neural/chain")


def test_a_task_that_meets_another_network_than_it_was_planned_with_is_not_carried_out(
    other: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A file that was replaced, or another machine's."""
    drive = Drive(world="hallway", renderer=RendererKind.NONE)
    task = AnswerTask(("neural/chain",), drive, drive, None, None, 1, 60.0)
    planned = task.network
    monkeypatch.setenv(FILE, str(other))
    outcome = perform(task, Store(tmp_path / "store"))
    assert not outcome.good
    assert planned
    assert f"valid is {planned[:12]}…" in outcome.reason


def test_answers_and_maps_are_kept_by_the_network_that_they_ask(other: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def task(method: str) -> AnswerTask:
        first, later = (Drive(world="hallway", renderer=RendererKind.NONE, seed=seed) for seed in (1, 2))
        return AnswerTask((method,), first, later, None, None, 1, 60.0)

    before = {method: (task(method).key, set(task(method).maps)) for method in ("neural/chain", "best/chain")}
    monkeypatch.setenv(FILE, str(other))
    assert (task("best/chain").key, set(task("best/chain").maps)) == before["best/chain"]
    assert task("neural/chain").key != before["neural/chain"][0]
    assert len(set(task("neural/chain").maps) - before["neural/chain"][1]) == 1
    monkeypatch.delenv(FILE)
    assert task("best/chain").key == before["best/chain"][0]
    with pytest.raises(AbsentError, match=f"{FILE} names no neural network"):
        _ = task("neural/chain").key
