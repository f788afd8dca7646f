import ctypes
import errno
import os
from collections.abc import Callable
from contextlib import nullcontext
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from refseq.errors import LogError, SceneError
from refseq.files import (
    check_input,
    free_names,
    naming_writes,
    open_input,
    put_folder,
    replace_bytes,
    replace_text,
    replacing,
    sync,
)
from refseq.logs import write_carmen
from refseq.scenes import cut_scene, save_scene
from refseq.view import Scan, View


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


def test_a_place_that_cannot_be_written_is_told_by_its_name_in_each_package_s_own_error(tmp_path: Path) -> None:
    path = tmp_path / "none" / "result"
    view = View(0.0, {"front": np.zeros((60, 80), np.uint8)}, Scan(np.full(361, 3.0, np.float32)))
    for error, write in (
        (LogError, lambda: write_carmen(path, [view])),
        (SceneError, lambda: save_scene(path, cut_scene(view, "front"))),
    ):
        with pytest.raises(error) as told:
            write()
        assert str(told.value) == f"{path}: cannot be written: No such file or directory"


@pytest.mark.parametrize(
    ("met", "told"),
    [
        (PermissionError(errno.EACCES, "Permission denied"), ": Permission denied"),
        (OSError("bad end"), " (is the disk full?): bad end"),
        (RuntimeError("bad end"), " (is the disk full?): bad end"),
    ],
)
def test_a_full_disk_is_thought_of_only_where_the_system_tells_nothing(met: Exception, told: str) -> None:
    with pytest.raises(LogError) as caught, naming_writes("a", LogError, RuntimeError):
        raise met
    assert str(caught.value) == f"a: cannot be written{told}"


@pytest.mark.parametrize("older", ["older", None])
def test_what_a_link_leads_to_is_replaced_or_made_and_the_link_stays(tmp_path: Path, older: str | None) -> None:
    link, target = tmp_path / "link", tmp_path / "there" / "target"
    target.parent.mkdir()
    if older is not None:
        target.write_text(older)
    (tmp_path / "between").symlink_to("there/target")
    link.symlink_to("between")
    with replacing(link) as file:
        assert Path(file.name).parent.parent == target.parent  # on the same disk, for one step
        file.write(b"new")
    assert str(link.readlink()) == "between"
    assert target.read_text() == "new"
    assert sorted(tmp_path.rglob("*")) == [tmp_path / "between", link, target.parent, target]


def test_links_in_a_circle_are_told(tmp_path: Path) -> None:
    (tmp_path / "one").symlink_to("other")
    (tmp_path / "other").symlink_to("one")
    with pytest.raises(OSError, match="Too many levels of symbolic links"):
        replace_text(tmp_path / "one", "new")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may lay a link for another user")
def test_a_link_that_another_user_laid_in_a_folder_for_all_is_not_written_through(tmp_path: Path) -> None:
    for_all, dear = tmp_path / "tmp", tmp_path / "dear"
    dear.write_text("dear")
    for_all.mkdir()
    for_all.chmod(0o1777)
    (link := for_all / "out").symlink_to(dear)
    os.chown(link, 1, 1, follow_symlinks=False)
    with pytest.raises(PermissionError, match="is another user's link in a folder for all; valid is another name"):
        replace_text(link, "new")
    assert dear.read_text() == "dear"
    for_all.chmod(0o755)
    replace_text(link, "new")
    assert dear.read_text() == "new"


@pytest.mark.parametrize(("make", "told"), [(os.mkfifo, "is a pipe; valid is a file"), (Path.mkdir, "is a folder")])
def test_what_is_no_file_is_not_replaced(tmp_path: Path, make: Callable[[Path], None], told: str) -> None:
    make(tmp_path / "out")
    with pytest.raises(OSError, match=told), replacing(tmp_path / "out") as file:
        file.write(b"content")
    assert not (tmp_path / "out").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_does_not_take_the_place_of_something_else(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "out")
    (tmp_path / "draft").mkdir()
    with pytest.raises(NotADirectoryError):
        put_folder(tmp_path / "draft", tmp_path / "out")
    assert (tmp_path / "out").is_fifo()


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


def test_where_the_new_folder_cannot_be_put_the_older_one_comes_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("new", "old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    rename = Path.rename

    def refusing(path: Path, target: Path) -> Path:
        if path.name == "new":
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(path))
        return rename(path, target)

    monkeypatch.setattr("refseq.files._exchanged", lambda one, other: False)
    monkeypatch.setattr(Path, "rename", refusing)
    with pytest.raises(OSError, match="cross-device"):
        put_folder(tmp_path / "new", tmp_path / "old")
    assert {path.name: (path / "file").read_text() for path in tmp_path.iterdir()} == {"new": "new", "old": "old"}


class Renaming:
    """A C library whose call to exchange names fails with an error."""

    def __init__(self, code: int) -> None:
        self.code = code

    def renameat2(self, *_: object) -> int:
        ctypes.set_errno(self.code)
        return -1


@pytest.mark.parametrize("library", [object(), Renaming(errno.ENOSYS), Renaming(errno.EINVAL)])
def test_a_system_that_exchanges_no_names_takes_two_steps(
    library: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("new", "old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / name).touch()
    with monkeypatch.context() as patch:
        patch.setattr(ctypes, "CDLL", lambda *_, **__: library)
        put_folder(tmp_path / "new", tmp_path / "old")
    assert (tmp_path / "old" / "new").exists()
    assert (tmp_path / "new" / "old").exists()
    assert len(list(tmp_path.iterdir())) == 2


def test_other_errors_of_the_exchange_leave_both_as_they_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("new", "old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / name).touch()
    with monkeypatch.context() as patch:
        patch.setattr(ctypes, "CDLL", lambda *_, **__: Renaming(errno.EACCES))
        with pytest.raises(PermissionError):
            put_folder(tmp_path / "new", tmp_path / "old")
    assert (tmp_path / "old" / "old").exists()
    assert (tmp_path / "new" / "new").exists()


@pytest.mark.parametrize(
    ("code", "folder", "bad"),
    [(errno.EINVAL, True, False), (errno.ENOTSUP, True, False), (errno.EIO, True, True), (errno.EINVAL, False, True)],
)
def test_a_disk_that_fails_is_told_and_a_file_system_that_syncs_no_folders_is_not(
    code: int, folder: bool, bad: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(descriptor: int) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(os, "fsync", failing)
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match=os.strerror(code)) if bad else nullcontext():
        sync(tmp_path if folder else tmp_path / "file")


def test_names_for_what_lies_beside_all_else_are_counted(tmp_path: Path) -> None:
    names = [path.name for path in islice(free_names(tmp_path / "a map.refseq"), 3)]
    assert names == ["a map.refseq", "a map-2.refseq", "a map-3.refseq"]
