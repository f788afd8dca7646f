import gc
import os
from pathlib import Path
from typing import Any

import pytest

from refseq.threads import ONE_THREAD
from refseq_bench.scenarios.campaign.run.worker_init import RENDERING, call_and_trim, init_worker, share
from tests.forked import in_child


@pytest.mark.parametrize(("chosen", "drawing"), [(None, "3"), ("7", "7")])
def test_a_worker_begins_with_few_threads_and_leaves_the_drivers_as_the_user_chose(
    chosen: str | None, drawing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "16")
    monkeypatch.delenv(RENDERING, raising=False)
    if chosen is not None:
        monkeypatch.setenv(RENDERING, chosen)

    def worker() -> dict[str, Any]:
        import cv2

        init_worker(os.getppid(), 3)
        return {"opencv": cv2.getNumThreads(), **{name: os.environ[name] for name in (*ONE_THREAD, RENDERING)}}

    found = in_child(worker, tmp_path)
    assert found == {"opencv": 3, **ONE_THREAD, RENDERING: drawing}
    assert os.environ["OMP_NUM_THREADS"] == "16"


def test_memory_is_given_back_whatever_the_function_does(monkeypatch: pytest.MonkeyPatch) -> None:
    collected: list[None] = []
    monkeypatch.setattr(gc, "collect", lambda: collected.append(None))
    assert call_and_trim(divmod, 7, 2) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        call_and_trim(divmod, 7, 0)
    assert len(collected) == 2


@pytest.mark.parametrize(("cores", "workers", "threads"), [(8, 1, 8), (8, 3, 2), (8, 8, 1), (2, 16, 1)])
def test_cores_are_shared_and_nobody_goes_without(
    cores: int, workers: int, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)), raising=False)
    assert share(workers) == threads
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    assert share(workers) == threads
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert share(workers) == 1
