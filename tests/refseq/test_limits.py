"""Limits refuse what is beyond them in one line, and the page shows each of them."""

from pathlib import Path

import pytest

from refseq.errors import LogError, MapError
from refseq.limits import Limit, Share, all_limits
from tests.pages import ROOT

TEN = Limit(10, "wheels on a robot", "real ones have four")


def test_what_is_within_is_taken() -> None:
    TEN.check(10, "a.toml: has")


@pytest.mark.parametrize("found", [11, 10.5, float("inf"), float("nan")])
def test_what_is_beyond_is_refused(found: float) -> None:
    with pytest.raises(LogError, match=rf"^a\.toml: has {found} wheels on a robot; valid are at most 10$"):
        TEN.check(found, "a.toml: has")


def test_the_error_of_a_family_of_ones_own() -> None:
    with pytest.raises(MapError):
        TEN.check(11, "a.refseq: has", MapError)


def test_a_share_grows_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(bytes(100))
    meter = Share(10, 2, "wheels", "none").of(path)
    meter.add(10)
    meter.add(200)
    assert meter.left == 0
    with pytest.raises(
        LogError, match=r"holds more than 210 wheels in 100 bytes; valid are 10, and 2 a byte of the file$"
    ):
        meter.add(1)


def test_the_page_shows_each() -> None:
    """The row of each is there; a row for a limit that is none any more is not."""
    page = (ROOT / "docs" / "limits.md").read_text()
    rows = [f"| {one.unit} | {one.text} | {one.why} |" for one in all_limits().values()]
    assert [line for line in page.splitlines() if line.startswith("| ")][1:] == rows
