import os
from collections.abc import Callable
from pathlib import Path

import pytest

from refseq.files import check_input, open_input, replace_bytes, replace_text, replacing


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
