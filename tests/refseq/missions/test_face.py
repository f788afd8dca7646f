"""The names that ``refseq.missions`` offers: imported when they are asked for, and all of them there."""

import subprocess
import sys

import pytest

from refseq import missions


@pytest.mark.parametrize("name", missions.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert name in dir(missions)
    assert getattr(missions, name) is not None


def test_an_unknown_name_is_told() -> None:
    with pytest.raises(AttributeError, match=r"^module 'refseq.missions' has no attribute 'nope'$"):
        _ = missions.nope


@pytest.mark.parametrize(
    ("asked", "not_loaded"),
    [
        ("parse_mission", {"numpy", "scipy", "refseq.map.map", "refseq.missions.executor"}),
        ("lamp", {"numpy", "scipy", "refseq.map.map", "refseq.missions.executor"}),
        ("as_learnt", {"scipy", "networkx", "refseq.map.map", "refseq.missions.executor"}),
    ],
)
def test_nothing_is_loaded_that_a_name_does_not_need(asked: str, not_loaded: set[str]) -> None:
    code = f"import sys; from refseq.missions import {asked}; print(sorted({not_loaded} & set(sys.modules)))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "[]\n"
