import json
import os
import time
from pathlib import Path

import pytest

from refseq_bench.scenarios.campaign.store import contents
from refseq_bench.scenarios.campaign.store.contents import KEPT, SETTLED, content_digest


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("REFSEQ_CACHE", str(tmp_path / "store"))
    path = tmp_path / "run.log"
    path.write_bytes(b"a drive")
    return path


@pytest.fixture
def later(monkeypatch: pytest.MonkeyPatch) -> None:
    """All files were changed long ago."""
    now = time.time_ns
    monkeypatch.setattr(contents.time, "time_ns", lambda: now() + 10 * SETTLED)


def kept(path: Path) -> list[Path]:
    return list((path.parent / "store" / KEPT).glob("*"))


def test_content_alone_counts(log: Path, tmp_path: Path) -> None:
    digest = content_digest(log)
    copy = tmp_path / "elsewhere" / "other.log"
    copy.parent.mkdir()
    copy.write_bytes(log.read_bytes())
    assert content_digest(copy) == digest
    log.touch()
    assert content_digest(log) == digest
    log.write_bytes(b"a drivE")
    assert content_digest(log) != digest


@pytest.mark.usefixtures("later")
def test_a_change_shows_though_size_date_and_inode_stay(log: Path) -> None:
    before, digest = log.stat(), content_digest(log)
    assert kept(log)
    time.sleep(0.02)  # two changes within one tick of the file system have one date
    with log.open("r+b") as file:
        file.write(b"another")
    os.utime(log, ns=(before.st_atime_ns, before.st_mtime_ns))
    after = log.stat()
    assert (after.st_size, after.st_mtime_ns, after.st_ino) == (before.st_size, before.st_mtime_ns, before.st_ino)
    assert content_digest(log) != digest


def test_a_file_that_was_just_changed_is_read_again(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A file system whose clock ticks once a second: dates stay though the content changes.
    state = contents._state([("", log)])
    monkeypatch.setattr(contents, "_state", lambda _: state)
    digest = content_digest(log)
    assert kept(log) == []
    log.write_bytes(b"another")
    assert content_digest(log) != digest


def test_a_file_whose_date_was_set_back_is_as_young_as_its_last_change(log: Path) -> None:
    os.utime(log, (0, 0))  # as copies and archives have it
    content_digest(log)
    assert kept(log) == []


@pytest.mark.usefixtures("later")
def test_a_log_is_read_once(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = content_digest(log)
    log_read = Path.open

    def fail(self: Path, *args: object, **options: object) -> object:
        assert self != log
        return log_read(self, *args, **options)

    monkeypatch.setattr(Path, "open", fail)
    assert content_digest(log) == digest


@pytest.mark.usefixtures("later")
def test_a_file_that_changes_while_it_is_read_is_not_kept(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    states = iter([[("", 1, 7, 1, 1)], [("", 1, 7, 2, 2)]])
    monkeypatch.setattr(contents, "_state", lambda _: next(states))
    content_digest(log)
    assert kept(log) == []


@pytest.mark.usefixtures("later")
@pytest.mark.parametrize("damage", ["", "{", "[]", '{"digest": "0"}', '{"state": 1, "digest": 2}', "\0"])
def test_a_damaged_note_is_made_anew(log: Path, damage: str) -> None:
    digest = content_digest(log)
    (note,) = kept(log)
    whole = note.read_text()
    note.write_text(damage)
    assert content_digest(log) == digest
    assert json.loads(note.read_text()) == json.loads(whole)


@pytest.mark.usefixtures("later")
def test_where_nothing_can_be_kept_it_is_reckoned(log: Path, tmp_path: Path) -> None:
    (tmp_path / "store").write_text("in the way")
    assert content_digest(log) == content_digest(log)


def test_a_folder_counts_with_all_below_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REFSEQ_CACHE", str(tmp_path / "store"))
    folder = tmp_path / "pictures"
    (folder / "left").mkdir(parents=True)
    (folder / "left" / "1.png").write_bytes(b"one")
    os.mkfifo(folder / "pipe")  # would never be read to its end
    found = [content_digest(folder)]
    (folder / "left" / "1.png").write_bytes(b"two")
    found.append(content_digest(folder))
    (folder / "left" / "1.png").rename(folder / "left" / "2.png")
    found.append(content_digest(folder))
    (folder / "left" / "3.png").touch()
    found.append(content_digest(folder))
    assert len(set(found)) == len(found)
