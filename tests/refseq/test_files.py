import os
from collections.abc import Callable
from pathlib import Path

import pytest

from refseq.files import check_input, open_input, put_folder, replace_bytes, replace_text, replacing


def test_replaces_the_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    replace_text(path, "long old content")
    replace_text(path, "né")
    assert path.read_bytes() == "né".encode()
    replace_bytes(path, b"\0\1")
    assert path.read_bytes() == b"\0\1"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_an_error_leaves_the_old_content_and_no_rubbish(tmp_path: Path, error: type[BaseException]) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"old")

    def fail() -> None:
        with replacing(path) as file:
            file.write(b"half of the new")
            file.flush()
            raise error

    with pytest.raises(error):
        fail()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_old_file_stays_until_the_block_ends(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"old")
    with replacing(path) as file:
        file.write(b"new")
        file.flush()
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"


def test_mode_is_that_of_any_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_bytes(b"")
    replace_bytes(tmp_path / "replaced", b"")
    assert (tmp_path / "replaced").stat().st_mode == plain.stat().st_mode


def test_a_missing_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        replace_bytes(tmp_path / "no" / "a", b"")


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (os.mkfifo, "is a pipe; valid is a file"),
        (os.mkdir, "is a folder; valid is a file"),
        (lambda path: path.symlink_to("/dev/zero"), "is a device; valid is a file"),
    ],
)
def test_what_is_no_file_is_not_waited_for(tmp_path: Path, make: Callable[[Path], None], told: str) -> None:
    make(tmp_path / "a")
    for look in (open_input, check_input):
        with pytest.raises(OSError, match=told):
            look(tmp_path / "a")


def test_a_file_is_opened_and_a_missing_one_is_not(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"abc")
    check_input(tmp_path / "a")
    with open_input(tmp_path / "a") as file:
        assert file.read() == b"abc"
    with pytest.raises(FileNotFoundError):
        open_input(tmp_path / "b")


def test_a_link_in_the_way_is_replaced_and_not_written_through(tmp_path: Path) -> None:
    dear = tmp_path / "dear"
    dear.write_text("dear")
    (tmp_path / "a").symlink_to(dear)
    replace_text(tmp_path / "a", "new")
    assert dear.read_text() == "dear"
    assert not (tmp_path / "a").is_symlink()


def test_content_is_synced_before_it_gets_its_name_and_the_folder_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    sync, rename = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        told.append(Path(f"/proc/self/fd/{descriptor}").resolve().name)
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", lambda one, other: (told.append("replace"), rename(one, other)))
    replace_text(tmp_path / "a", "new")
    assert told == ["a", "replace", tmp_path.name]


@pytest.mark.parametrize("exchanges", [True, False])
def test_a_folder_takes_the_place_of_an_older_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, exchanges: bool
) -> None:
    if not exchanges:
        monkeypatch.setattr("refseq.files._exchanged", lambda one, other: False)
    for name in ("new", "old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    put_folder(tmp_path / "new", tmp_path / "old")
    assert (tmp_path / "old" / "file").read_text() == "new"
    assert (tmp_path / "new" / "file").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"old", "new"}
