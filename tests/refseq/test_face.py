"""The names that ``refseq`` offers: imported when they are asked for, and all of them there."""

import pydoc
import subprocess
import sys

import pytest

import refseq


@pytest.mark.parametrize("name", refseq.__all__)
def test_every_public_name_is_there_and_says_what_it_is(name: str) -> None:
    assert name in dir(refseq)
    assert getattr(refseq, name).__doc__


def test_an_unknown_name_is_told() -> None:
    with pytest.raises(AttributeError, match=r"^module 'refseq' has no attribute 'nope'$"):
        _ = refseq.nope


def test_nothing_is_imported_before_it_is_asked_for() -> None:
    """So that a machine that lacks a package can still be told which."""
    code = "import sys, refseq; print(sorted({'numpy', 'cv2', 'refseq.map'} & set(sys.modules)))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout == "[]\n"


def test_help_shows_the_way_from_a_drive_to_beliefs() -> None:
    page = pydoc.plain(pydoc.render_doc(refseq))
    for step in (
        "read_recording(",
        "learn(",
        ".save(",
        "Localiser(Map.load(",
        ".update(view)",
        "class Localiser",
        "class Map",
    ):
        assert step in page
