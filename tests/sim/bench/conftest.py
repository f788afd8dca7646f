import pytest

import refseq_bench.sim.bench.bench
from tests.sim.bench.lamp import Lamp


@pytest.fixture
def lamp(monkeypatch: pytest.MonkeyPatch) -> Lamp:
    lamp = Lamp(100.0)
    monkeypatch.setattr(refseq_bench.sim.bench.bench, "open_renderer", lambda kind, model, bake: lamp)
    return lamp
