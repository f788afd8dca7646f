from pathlib import Path

import pytest

from refseq.errors import MapError
from refseq.features.neural.network import FILE, key_network
from refseq_bench.scenarios.campaign.declare.real_recordings import AbsentError
from refseq_bench.scenarios.campaign.run.tasks import AnswerTask
from refseq_bench.scenarios.drives.record import Drive
from refseq_bench.scenarios.methods.networks import networks_of
from refseq_bench.sim.rendering.renderer import RendererKind
from tests.key_network import write_key_network


@pytest.fixture
def other(tmp_path: Path) -> Path:
    """Another network than the one at hand."""
    return write_key_network(tmp_path / "other.onnx", seed=2)


def test_only_those_that_ask_a_network_have_one(monkeypatch: pytest.MonkeyPatch) -> None:
    digest = key_network((640, 480)).digest
    assert networks_of(["thesis/chain", "neural/chain", "neural/hindsight", "vlad"]) == {"neural": digest}
    assert networks_of(["best/chain"], ("sift", "neural")) == {"best": digest}
    assert networks_of(["neural/chain"], ("sift",)) == {}
    monkeypatch.delenv(FILE)
    assert networks_of(["thesis/chain", "best/chain", "vlad"]) == {}
    with pytest.raises(MapError, match=FILE):
        networks_of(["thesis/chain", "neural/chain"])


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
