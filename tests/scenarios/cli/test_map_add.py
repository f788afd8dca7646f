"""``refseq map add``: a map that grows in its file, or beside it, and mistakes in one line that leave it as it was."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from refseq.errors import MapError
from refseq.files import replace_bytes
from refseq.logs import RecordingWriter
from refseq.map.growth import adding
from refseq.map.growth.adding import Grown, add_drive
from refseq.map.learning import learn
from refseq.map.map import Map
from refseq.map.profile import BEST
from refseq.planar import Pose
from refseq.view import LASER, View
from tests.refseq.rooms import without
from tests.scenarios.conftest import Refseq
from tests.support import corridor_drive

COUNT = 22


def drive(seed: int) -> list[View]:
    return corridor_drive(np.random.default_rng(seed), count=COUNT, size=96)


def written(path: Path, views: Sequence[View], metadata: Mapping[str, str]) -> None:
    way = 0.0
    with RecordingWriter(path, metadata) as writer:
        for view in views:
            way += view.distance
            writer.write(view, Pose(way, 0.0, 0.0))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map, a drive along it of which some pictures are others, and drives and maps that do not go together."""
    folder = tmp_path_factory.mktemp("grow")
    views, robot = drive(1), {"robot": "robuter"}
    learn(views, profile=BEST, metadata=robot, name="map").save(folder / "map.refseq")
    learn(views, sensors=[LASER]).save(folder / "thesis.refseq")
    (folder / "cut.refseq").write_bytes((folder / "map.refseq").read_bytes()[:5000])
    (folder / "text.mcap").write_text("no log")
    other = corridor_drive(np.random.default_rng(2), count=COUNT + 100, size=96)[100:]
    later = drive(2)
    later[10:16] = [replace(one, images=its.images) for one, its in zip(later[10:16], other[10:16], strict=True)]
    written(folder / "later.mcap", later, robot)
    written(folder / "other.mcap", later, {"robot": "segway-rmp"})
    written(folder / "short.mcap", later[:3], robot)
    written(folder / "one-eye.mcap", [without(view, "lateral") for view in later], robot)
    written(folder / "elsewhere.mcap", other, robot)
    ahead = [*drive(3)[8:], *other[:14]]
    written(folder / "ahead.mcap", [replace(view, time=2.0 * n) for n, view in enumerate(ahead)], robot)
    return folder


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for file in made.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_map_grows_in_its_file_and_by_the_same_drive_only_once(refseq: Refseq, here: Path) -> None:
    before = (here / "map.refseq").stat().st_size
    answer = refseq("map", "add", "map.refseq", "later.mcap")
    assert (answer.code, answer.err) == (0, "")
    found = re.fullmatch(
        r"map\.refseq: (\d+) of 22 views kept, (\d+) found on the map, 0 older ones forgotten; (\d+) bytes before, "
        r"(\d+) now\n",
        answer.out,
    )
    assert found is not None
    kept, placed, was, now = map(int, found.groups())
    assert 3 <= kept <= 10
    assert placed >= 18
    assert (was, now) == (before, (here / "map.refseq").stat().st_size)
    assert now > was
    content = (here / "map.refseq").read_bytes()
    answer = refseq("map", "add", "map.refseq", "later.mcap")
    assert (answer.code, answer.out) == (0, "map.refseq: later.mcap was added before, nothing is new\n")
    assert (here / "map.refseq").read_bytes() == content


def test_a_larger_map_is_written_beside(refseq: Refseq, here: Path) -> None:
    content = (here / "map.refseq").read_bytes()
    found = json.loads(refseq("map", "add", "map.refseq", "later.mcap", "-o", "new.refseq", "--json").out)
    assert (here / "map.refseq").read_bytes() == content
    assert found["drive"]["kept"] == len(found["kept"]) == len(Map.load(here / "new.refseq").sequence.experiences or ())
    assert found["after"]["bytes"] == (here / "new.refseq").stat().st_size
    assert not found["known"]
    assert refseq("map", "add", "new.refseq", "later.mcap", "-o", "same.refseq").code == 0
    assert (here / "same.refseq").read_bytes() == (here / "new.refseq").read_bytes()


def test_a_map_that_another_command_changed_meanwhile_is_not_replaced(
    refseq: Refseq, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = b"of another command"

    def slow(*given: Any, **more: Any) -> Grown:
        grown = add_drive(*given, **more)
        replace_bytes(here / "map.refseq", other)
        return grown

    monkeypatch.setattr(adding, "add_drive", slow)
    answer = refseq("map", "add", "map.refseq", "later.mcap")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == "error: map.refseq: has changed since it was read; valid is to run the command again\n"
    assert (here / "map.refseq").read_bytes() == other


@pytest.mark.slow
def test_what_was_added_to_a_merged_map_alone_is_not_lost_in_a_merge(refseq: Refseq, here: Path) -> None:
    assert refseq("map", "merge", "map.refseq", "-o", "whole.refseq").code == 0
    assert refseq("map", "add", "whole.refseq", "later.mcap").code == 0
    answer = refseq("map", "merge", "whole.refseq", "-o", "again.refseq")
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert "whole.refseq: drive 'later.mcap' was added to it and not to its members" in answer.err
    assert refseq("map", "merge", "whole.refseq", "-o", "again.refseq", "--keep-joins").code == 0
    assert len(Map.load(here / "again.refseq").sequence.experiences or ()) > 0
    assert refseq("map", "add", "map.refseq", "later.mcap").code == 0
    assert refseq("map", "merge", "map.refseq", "-o", "whole.refseq").code == 0
    assert refseq("map", "merge", "whole.refseq", "-o", "again.refseq").code == 0
    assert Map.load(here / "again.refseq").grown.drives[0].name == "later.mcap"


def test_what_leads_off_the_map_is_told_and_becomes_a_path_of_its_own_when_asked(refseq: Refseq, here: Path) -> None:
    told = refseq("map", "add", "map.refseq", "ahead.mcap", "-o", "grown.refseq").err
    assert re.fullmatch(
        r"note: views 1\d:28 of ahead\.mcap lead \d+\.\d m off the map; --explore makes a path .*\n", told
    )
    words = ("--explore", "-o", "whole.refseq", "--tolerance", "0.05")
    answer = refseq("map", "add", "map.refseq", "ahead.mcap", *words)
    assert (answer.code, answer.err) == (0, "")
    assert re.search(
        r"^ahead-1\.refseq: views \d+:28 of ahead\.mcap, \d+\.\d m of them off the map$", answer.out, re.MULTILINE
    )
    whole = Map.load(here / "whole.refseq")
    assert whole.names == ("map", "ahead-1")
    assert len(whole) < len(Map.load(here / "map.refseq")) + len(Map.load(here / "ahead-1.refseq")), "they are joined"
    assert [member.file for member in whole.record.members] == ["map.refseq", "ahead-1.refseq"]
    # It tells its recording as a learnt map does, so that the page of joins finds its pictures, read as they were.
    notes = Map.load(here / "ahead-1.refseq").metadata
    assert {key: notes.get(key) for key in ("source", "read_with_tolerance", "robot")} == {
        "source": "ahead.mcap",
        "read_with_tolerance": "0.05",
        "robot": "robuter",
    }
    # What was explored is known from now on.
    again = refseq("map", "add", "whole.refseq", "ahead.mcap", "--explore")
    assert (again.code, again.out) == (0, "ahead.mcap: leads nowhere off the map; nothing is written\n")


def test_new_paths_are_merged_with_the_shortest_overlap_that_was_asked_for(refseq: Refseq, here: Path) -> None:
    assert refseq("map", "merge", "map.refseq", "-o", "whole.refseq", "--min-overlap", "40").code == 0
    assert refseq("map", "add", "whole.refseq", "ahead.mcap", "--explore").code == 0
    whole = Map.load(here / "whole.refseq")
    assert (whole.names, whole.record.min_overlap) == (("map", "ahead-1"), 40.0)
    assert len(whole) == len(Map.load(here / "map.refseq")) + len(Map.load(here / "ahead-1.refseq")), (
        "nothing is joined"
    )


def test_a_member_that_is_missing_is_told_before_the_drive_is_read_and_none_is_written_over(
    refseq: Refseq, here: Path
) -> None:
    assert refseq("map", "merge", "map.refseq", "-o", "whole.refseq").code == 0
    answer = refseq("map", "add", "whole.refseq", "ahead.mcap", "--explore", "-o", "map.refseq")
    told = "becomes one path of the larger map; valid is --output with another name"
    assert (answer.code, answer.out, answer.err) == (2, "", f"error: map.refseq: {told}\n")
    (here / "map.refseq").unlink()
    answer = refseq("map", "add", "whole.refseq", "text.mcap", "--explore")
    assert (answer.code, answer.out) == (2, "")
    member = here / "map.refseq"
    assert answer.err == f"error: whole.refseq: its member {member} is not there; valid is to put it back\n"


def test_a_file_that_has_a_new_path_s_name_is_not_written_over(refseq: Refseq, here: Path) -> None:
    (here / "ahead-1.refseq").write_bytes(b"of another drive")
    answer = refseq("map", "add", "map.refseq", "ahead.mcap", "--explore", "-o", "whole.refseq")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == (
        "error: ahead-1.refseq: is there already, and a new path would have its name; valid is to rename one\n"
    )
    assert (here / "ahead-1.refseq").read_bytes() == b"of another drive"
    assert not (here / "whole.refseq").exists()


def test_where_the_larger_map_cannot_be_written_no_new_path_stays(
    refseq: Refseq, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, save = {file.name: file.read_bytes() for file in here.iterdir()}, Map.save

    def full(map_: Map, path: Path) -> None:
        if path.name == "whole.refseq":
            raise MapError(f"{path}: cannot be written: the disk is full")
        save(map_, path)

    monkeypatch.setattr(Map, "save", full)
    answer = refseq("map", "add", "map.refseq", "ahead.mcap", "--explore", "-o", "whole.refseq")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err == "error: whole.refseq: cannot be written: the disk is full\n"
    assert {file.name: file.read_bytes() for file in here.iterdir()} == before


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("map.refseq ahead.mcap --explore", "map.refseq: becomes one path of the larger map; valid is --output with"),
        ("map.refseq later.mcap --explore -o no/x.refseq", "no/x.refseq: cannot be written: there is no folder no"),
        (
            "map.refseq one-eye.mcap --explore -o x.refseq",
            "one-eye.mcap: the drive has no lateral; valid are drives with all sensors",
        ),
        ("map.refseq other.mcap", "other.mcap: the drive is of robot segway-rmp; valid is that of the map, robuter"),
        (
            "map.refseq one-eye.mcap",
            "one-eye.mcap: the drive has no lateral; valid are drives with all sensors of the map",
        ),
        ("map.refseq short.mcap", "short.mcap: the drive has 3 views over 1.7 m; valid is a way of 3 m"),
        ("map.refseq elsewhere.mcap", "elsewhere.mcap: the drive has 22 views, of which "),
        ("map.refseq none.mcap", "none.mcap: "),
        ("map.refseq text.mcap", "text.mcap: "),
        ("cut.refseq later.mcap", "cut.refseq: is not a .refseq map, or is damaged"),
        ("thesis.refseq text.mcap", "thesis.refseq: its matching is mixture, which takes no further experiences"),
        ("map.refseq later.mcap -o no/x.refseq", "no/x.refseq: cannot be written: there is no folder no"),
    ],
)
def test_what_is_wrong_is_told_in_one_line_and_the_map_stays(refseq: Refseq, here: Path, words: str, told: str) -> None:
    before = {file.name: file.read_bytes() for file in here.iterdir()}
    answer = refseq("map", "add", *words.split())
    assert (answer.code, answer.out, len(answer.err.splitlines())) == (2, "", 1)
    assert answer.err.startswith(f"error: {told}")
    assert {file.name: file.read_bytes() for file in here.iterdir()} == before
