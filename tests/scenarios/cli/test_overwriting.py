"""No command writes over what it reads: neither a recording nor a map, whatever name it is given for the result."""

import os
from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter
from refseq.map.learning import learn
from refseq.map.profile import BEST
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

COMMANDS = {
    "learn": ("drive.mcap", "learn drive.mcap -o {}"),
    "learn-truth": ("poses.tum", "learn drive.mcap --truth poses.tum -o {}"),
    "localise": ("drive.mcap", "localise one.refseq drive.mcap -o {}"),
    "localise-map": ("one.refseq", "localise one.refseq drive.mcap -o {}"),
    "report": ("drive.mcap", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "report-map": ("one.refseq", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "report-beliefs": ("beliefs.parquet", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "view": ("drive.mcap", "view drive.mcap -o {}"),
    "check": ("drive.mcap", "log check drive.mcap -o {}"),
    "layout": ("drive.mcap", "log layout drive.mcap -o {}"),
    "scene": ("drive.mcap", "mission scene drive.mcap --along 1 -o {}"),
    "add": ("drive.mcap", "map add one.refseq drive.mcap -o {}"),
    "compact": ("one.refseq", "map compact one.refseq -o {}"),
    "merge": ("one.refseq", "map merge one.refseq two.refseq -o {}"),
    "merge-page": ("two.refseq", "map merge one.refseq two.refseq -o whole.refseq --page {}"),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("overwriting")
    views = corridor_drive(np.random.default_rng(1), count=6, size=96)
    for name in ("one", "two"):
        learn(views, profile=BEST, name=name).save(folder / f"{name}.refseq")
    with RecordingWriter(folder / "drive.mcap", {}) as writer:
        for view in views:
            writer.write(view, view.truth)
    (folder / "poses.tum").write_text("".join(f"{v.time} {k} 0 0 0 0 0 1\n" for k, v in enumerate(views)))
    (folder / "beliefs.parquet").write_bytes(b"not looked at")
    return folder


@pytest.mark.parametrize("linked", [False, True], ids=["same name", "another name of it"])
@pytest.mark.parametrize("name", COMMANDS)
def test_an_input_is_no_output(
    made: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, linked: bool
) -> None:
    monkeypatch.chdir(made)
    source, command = COMMANDS[name]
    target = source
    if linked:
        target = str(tmp_path / source)
        os.link(made / source, target)
    before = {path: path.read_bytes() for path in made.iterdir()}
    told = refseq(*command.format(target).split())
    assert told.code == 2
    assert told.err == f"error: {target}: would overwrite {source}; valid is another name\n"
    assert {path: path.read_bytes() for path in made.iterdir()} == before
