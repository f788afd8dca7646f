"""Outputs: places that take none, and files that another command replaces while they are read."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import pytest

from refseq.files import replace_bytes
from refseq_bench.scenarios.drives.inputs import check_folder, check_output, check_room, replacement
from refseq_bench.scenarios.errors import ScenarioError

CHANGED = "has changed since it was read; valid is to run the command again"


def test_of_two_that_read_a_file_only_the_first_replaces_it(tmp_path: Path) -> None:
    path = tmp_path / "a.refseq"
    path.write_bytes(b"read by both")
    first, second = replacement(path, [path]), replacement(path, [path])

    def write_second() -> None:
        with second:
            replace_bytes(path, b"second")

    with ThreadPoolExecutor(1) as pool:
        with first:
            waiting = pool.submit(write_second)
            replace_bytes(path, b"first")
        with pytest.raises(ScenarioError) as caught:
            waiting.result()
    assert str(caught.value) == f"{path}: {CHANGED}"
    assert path.read_bytes() == b"first"


def test_a_file_that_is_gone_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "a.refseq"
    path.write_bytes(b"read")
    ready = replacement(path, [path])
    path.unlink()
    with pytest.raises(ScenarioError, match=CHANGED), ready:
        pytest.fail("written")


def test_what_is_not_read_may_be_anything(tmp_path: Path) -> None:
    path, read = tmp_path / "new.refseq", tmp_path / "a.refseq"
    read.write_bytes(b"read")
    for _ in range(2):
        ready = replacement(path, [read])
        read.write_bytes(b"changed")
        with ready:
            replace_bytes(path, b"written")
        assert path.read_bytes() == b"written"


def test_an_error_while_writing_is_its_own(tmp_path: Path) -> None:
    path = tmp_path / "a.refseq"
    path.write_bytes(b"read")
    with pytest.raises(OSError, match="disk"), replacement(path, [path]):
        raise OSError("disk")


def test_a_pipe_is_nothing_to_write_a_result_over(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "map.refseq")
    with pytest.raises(ScenarioError, match=r"map\.refseq: is a device, pipe or socket; valid is the name of a file"):
        check_output(pipe)


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="there is no /proc, where nobody makes a file")
@pytest.mark.parametrize("check", [check_output, check_folder, check_room])
def test_a_place_that_takes_no_file_is_told_whatever_its_permissions_say(check: Callable[[Path], None]) -> None:
    with pytest.raises(ScenarioError) as caught:
        check(Path("/proc/x"))
    assert str(caught.value) == "/proc/x: cannot be written: no write access to folder /proc"


@pytest.mark.parametrize(
    ("name", "strict", "making"),
    [
        ("none/deep/x", "there is no folder none/deep", None),
        ("file/x", "file is no folder", "file is no folder"),
        ("file/deep/x", "there is no folder file/deep", "file is no folder"),
        ("circle", "Too many levels of symbolic links", "Too many levels of symbolic links"),
        ("circle/x", "circle is no folder", "circle is no folder"),
        ("nowhere/x", "nowhere is no folder", "nowhere is no folder"),
        ("out", "there is no folder {}/none/deep", None),
    ],
)
def test_what_is_in_the_way_of_a_file_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, strict: str, making: str | None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    for link, target in (("circle", "circle"), ("nowhere", "none"), ("out", "none/deep/x")):
        Path(link).symlink_to(target)
    before = sorted(tmp_path.iterdir())
    for told, makes in ((strict, False), (making, True)):
        with nullcontext() if told is None else pytest.raises(ScenarioError) as caught:
            check_output(Path(name), making=makes)
        if told is not None:
            assert str(caught.value) == f"{name}: cannot be written: {told.format(tmp_path)}"
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("name", "told"), [("circle", ""), ("file", ""), ("file/deep", "file "), ("circle/x", "circle ")]
)
def test_what_is_in_the_way_of_a_folder_is_named_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, told: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("circle").symlink_to("circle")
    with pytest.raises(ScenarioError) as caught:
        check_folder(Path(name))
    assert str(caught.value) == f"{name}: {told}is no folder; valid is the name of a folder to fill"
