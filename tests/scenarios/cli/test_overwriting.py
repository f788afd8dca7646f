"""No command writes over what it reads, nor over a file of another kind, whatever name it is given for the result."""

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
    "learn": ("drive.mcap", ".refseq", "learn drive.mcap -o {}"),
    "learn-truth": ("poses.tum", ".refseq", "learn drive.mcap --truth poses.tum -o {}"),
    "localise": ("drive.mcap", ".parquet", "localise one.refseq drive.mcap -o {}"),
    "localise-map": ("one.refseq", ".parquet", "localise one.refseq drive.mcap -o {}"),
    "report": ("drive.mcap", ".html", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "report-map": ("one.refseq", ".html", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "report-beliefs": ("beliefs.parquet", ".html", "report one.refseq drive.mcap beliefs.parquet -o {}"),
    "compare": ("drive.mcap", ".csv", "compare drive.mcap drive.mcap -o {}"),
    "compare-page": ("drive.mcap", ".html", "compare drive.mcap drive.mcap --report {}"),
    "view": ("drive.mcap", ".rrd", "view drive.mcap -o {}"),
    "check": ("drive.mcap", ".html", "log check drive.mcap -o {}"),
    "record": ("led.mcap", ".mcap", "record corridor:1 --renderer none --script led.mcap -o {}"),
    "live": ("led.mcap", ".mcap", "live one.refseq corridor:1 --script led.mcap --recording {}"),
    "layout": ("drive.mcap", ".json", "log layout drive.mcap -o {}"),
    "scene": ("drive.mcap", ".scene", "mission scene drive.mcap --along 1 -o {}"),
    "add": ("drive.mcap", ".refseq", "map add one.refseq drive.mcap -o {}"),
    "compact": ("one.refseq", ".refseq", "map compact one.refseq -o {}"),
    "merge": ("one.refseq", ".refseq", "map merge one.refseq two.refseq -o {}"),
    "merge-page": ("two.refseq", ".html", "map merge one.refseq two.refseq -o whole.refseq --page {}"),
    "merge-decisions": ("two.refseq", ".toml", "map merge one.refseq two.refseq -o whole.refseq --write-decisions {}"),
    "similarity": ("one.refseq", ".npz", "map similarity one.refseq two.refseq --arrays {}"),
}
"""A file that a command reads, the ending of a file that it writes, and the command without that name."""
OTHERS = {
    "record-alone": ("beliefs.parquet", ".mcap", "record corridor:1 --renderer none -o {}"),
    "drive": ("beliefs.parquet", ".mcap", "drive corridor:1 --renderer none -o {}"),
    "live-alone": ("one.refseq", ".mcap", "live one.refseq corridor:1 --recording {}"),
    "live-viewer": ("drive.mcap", ".rrd", "live one.refseq corridor:1 --rrd {}"),
    "viewer": ("drive.mcap", ".rrd", "module viewer one.refseq --rrd {}"),
    "curves": ("drive.mcap", ".svg", "scenario curves . -o {}"),
    "plan": ("drive.mcap", ".pdf", "map plan one.refseq -o {}"),
    "draw": ("drive.mcap", ".png", "world draw corridor:1 -o {}"),
    "generate": ("new.mcap", ".toml", "world generate -o {}"),
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
    (folder / "led.mcap").write_bytes(b"not looked at")
    (folder / "poses.tum").write_text("".join(f"{v.time} {k} 0 0 0 0 0 1\n" for k, v in enumerate(views)))
    (folder / "beliefs.parquet").write_bytes(b"not looked at")
    return folder


@pytest.mark.parametrize("name", COMMANDS)
def test_an_input_is_no_output(
    made: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str
) -> None:
    monkeypatch.chdir(made)
    source, ending, command = COMMANDS[name]
    target = tmp_path / f"linked{ending}"
    os.link(made / source, target)
    assert _told(made, refseq, command.format(target)) == f"{target}: would overwrite {source}; valid is another name"


def test_a_bag_is_no_output_where_the_recording_is_that_leads(
    made: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(made)
    told = _told(made, refseq, "record corridor:1 --renderer none --format rosbag2 --script led.mcap -o led.mcap")
    assert told == "led.mcap: would overwrite led.mcap; valid is another name"


@pytest.mark.parametrize("name", COMMANDS | OTHERS)
def test_a_file_of_another_kind_stays(made: Path, refseq: Refseq, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(made)
    other, ending, command = (COMMANDS | OTHERS)[name]
    if other.endswith(ending):
        other = "one.refseq" if ending == ".mcap" else "drive.mcap"
    told = _told(made, refseq, command.format(other))
    assert told.startswith(f"{other}: is no name of ")
    assert ending in told.partition("; valid is one that ends in ")[2]


def _told(made: Path, refseq: Refseq, command: str) -> str:
    """The one line of a command that is refused, once nothing has changed in the folder."""
    before = {path: path.read_bytes() for path in made.iterdir()}
    code, out, err = refseq(*command.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert {path: path.read_bytes() for path in made.iterdir()} == before
    return err.removeprefix("error: ").rstrip()
