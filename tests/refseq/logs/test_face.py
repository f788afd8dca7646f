"""The names that ``refseq.logs`` offers: imported when they are asked for, and all of them there."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from refseq import Belief, Scan, View, logs
from refseq.errors import LogError
from refseq.logs.beliefs import read_beliefs, write_beliefs
from refseq.planar import Pose


@pytest.mark.parametrize("name", logs.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name: str) -> None:
    assert name in dir(logs)
    assert getattr(logs, name).__doc__


def test_an_unknown_name_is_told() -> None:
    with pytest.raises(AttributeError, match=r"^module 'refseq.logs' has no attribute 'nope'$"):
        _ = logs.nope


@pytest.mark.parametrize(
    ("asked", "not_loaded"),
    [
        ("__all__", {"numpy", "cv2", "foxglove", "rosbags"}),
        ("Recording", {"foxglove", "rosbags", "mcap", "refseq.logs.kinds"}),
        ("RecordingWriter", {"rosbags", "mcap", "refseq.logs.carmen", "refseq.logs.pairing"}),
        ("write_carmen", {"foxglove", "rosbags", "mcap", "refseq.logs.pairing"}),
    ],
)
def test_nothing_is_loaded_that_a_name_does_not_need(asked: str, not_loaded: set[str]) -> None:
    code = f"import sys; from refseq import logs; logs.{asked}; print(sorted({not_loaded} & set(sys.modules)))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "[]\n"


def test_a_file_may_be_named_by_a_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the first call that anybody types."""
    monkeypatch.chdir(tmp_path)
    scan = Scan(np.ones(5, np.float32), start=-1.0, step=0.5)
    views = [View(float(k), {}, scan, distance=0.5 * bool(k), turn=0.0) for k in range(2)]
    with logs.RecordingWriter("a.mcap", {}) as writer:
        for view in views:
            writer.write(view, Pose(view.time, 0.0, 0.0))
    logs.write_carmen("a.clf", views)
    for name in ("a.mcap", "a.clf"):
        assert len(logs.read_recording(name).views) == len(views)
        assert len(logs.plan_views(logs.open_log(name), logs.PairingOptions())) == len(views)
    belief = Belief(np.full(3, 1 / 3), 0.4, 1, (1,), 1.1)
    write_beliefs("a.parquet", views, {"chain": [belief, belief]})
    assert len(read_beliefs("a.parquet")["chain"]) == len(views)
    with pytest.raises(LogError, match=r"^nowhere.mcap: "):
        logs.read_recording("nowhere.mcap")
