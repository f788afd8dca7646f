"""Recordings that are given up, and what is told of a drive when it has ended."""

from pathlib import Path

import numpy as np
import pytest

from refseq.logs import RecordingWriter, read_recording
from refseq.planar import Pose
from refseq.view import Scan, View

VIEW = View(1.0, scan=Scan(np.full(361, 2.0, np.float32)), truth=Pose(0.0, 0.0, 0.0))
POSE = Pose(0.0, 0.0, 0.0)


def test_what_is_given_up_leaves_nothing_and_keeps_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    for older in (None, b"older"):
        if older is not None:
            path.write_bytes(older)
        with RecordingWriter(path, {}) as writer:
            writer.write(VIEW, POSE)
            writer.discard()
        assert [found.name for found in tmp_path.iterdir()] == ([] if older is None else ["drive.mcap"])
    assert path.read_bytes() == b"older"


def test_what_is_noted_later_adds_to_what_was_told_first(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    with RecordingWriter(path, {"world": "hallway", "name": "first"}) as writer:
        writer.write(VIEW, POSE)
        writer.note({"name": "later", "controls": "0 start\n1 stop\n"})
        writer.note({})
    told = read_recording(path).metadata
    assert told == {"world": "hallway", "name": "later", "controls": "0 start\n1 stop\n"}


def test_what_went_wrong_first_is_told_though_it_was_given_up(tmp_path: Path) -> None:
    def fail() -> None:
        with RecordingWriter(tmp_path / "drive.mcap", {}) as writer:
            writer.discard()
            raise ValueError("first")

    with pytest.raises(ValueError, match="first"):
        fail()
    assert not list(tmp_path.iterdir())
