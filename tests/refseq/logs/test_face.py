"""The names that ``refseq.logs`` offers: imported when they are asked for, and all of them there."""

import subprocess
import sys

import pytest

from refseq import logs


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
