"""Files of drives that a person sets up one after the other: none takes the place of another."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from refseq.logs import Recording
from refseq_bench.scenarios.drives import capture
from refseq_bench.scenarios.drives.capture import CaptureFiles, record_captures
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import NoViewError
from refseq_bench.scenarios.drives.teleop import TeleopDrive, TeleopResult
from refseq_bench.sim.errors import SimError
from refseq_bench.sim.teleop.capture.desk import Offer
from refseq_bench.sim.teleop.capture.setup import CaptureSetup
from refseq_bench.sim.teleop.session import AbortedError

HALL = CaptureSetup("hall", "", ("laser",), None)


class Person:
    """Somebody at the page: names for one drive after another, as soon as each is offered; then it has finished."""

    def __init__(self, *names: str) -> None:
        self._names, self.notes = list(names), "dry"
        self.offers: list[Offer] = []

    def next_setup(self, offer: Offer) -> CaptureSetup | None:
        """The offer with the next name, if that is accepted."""
        self.offers.append(offer)
        if not self._names:
            return None
        setup = replace(offer.setup, name=self._names.pop(0))
        offer.check(setup)
        return setup


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Files that were written to; a drive called 'aborted' is."""
    found: list[Path] = []

    def write(session: TeleopDrive, path: Path, *_: Any, **__: Any) -> TeleopResult:
        if session.name == "aborted":
            raise AbortedError("aborted at 1.0 s")
        found.append(path)
        path.touch()
        return TeleopResult(Recording(()), (), 1.0, 2.0)

    monkeypatch.setattr(capture, "record_by_hand", write)
    return found


def record(person: Person, files: CaptureFiles) -> list[Path]:
    page: Any = SimpleNamespace(desk=person, leading=None)
    return [path for path, _ in record_captures(page, Drive("hallway"), files, replace(HALL, name=files.name))]


def test_drives_lie_beside_each_other_under_names_that_are_free(tmp_path: Path, recorded: list[Path]) -> None:
    (tmp_path / "hall.mcap").touch()  # named on the command line, so it may be replaced
    (tmp_path / "hall-2.mcap").touch()
    person = Person("hall", "aborted", "kitchen", "hall-3")
    assert record(person, CaptureFiles(tmp_path / "hall.mcap", "hall")) == recorded
    assert [path.name for path in recorded] == ["hall.mcap", "kitchen.mcap", "hall-3.mcap"]
    assert [one.setup.name for one in person.offers] == ["hall", "hall-3", "hall-3", "hall-3", "hall-4"]
    assert [one.last for one in person.offers][1:3] == ["hall.mcap: 0 views, 2.0 m in 1.0 s", "aborted at 1.0 s"]
    assert person.offers[1].setup.notes == "dry"


@pytest.mark.parametrize(
    ("names", "path"),
    [
        (("first", "hall"), "hall.mcap"),  # the first one's name is not its file's
        (("first", "first"), "hall.mcap"),
        (("kitchen",), "kitchen.mcap"),  # was there before
    ],
)
def test_no_drive_takes_the_place_of_another(
    tmp_path: Path, recorded: list[Path], names: tuple[str, ...], path: str
) -> None:
    (tmp_path / "kitchen.mcap").touch()
    with pytest.raises(SimError) as caught:
        record(Person(*names), CaptureFiles(tmp_path / "hall.mcap", "first"))
    free = "first-2" if len(names) > 1 else "first"
    assert str(caught.value) == (
        f"name {names[-1]!r}: {tmp_path / path} is there already; valid is another name, as {free!r}"
    )
    assert len(set(recorded)) == len(recorded)


def test_where_nothing_was_recorded_the_reason_is_the_last_one(tmp_path: Path, recorded: list[Path]) -> None:
    for names, reason in ((("aborted",), "aborted at 1.0 s"), ((), "hall.mcap is not written: no drive was begun")):
        with pytest.raises((AbortedError, NoViewError), match=reason):
            record(Person(*names), CaptureFiles(tmp_path / "hall.mcap", "hall"))
    assert not recorded
