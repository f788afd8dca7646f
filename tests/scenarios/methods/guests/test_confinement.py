import ctypes
import errno
import os
import resource
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from refseq_bench.scenarios.methods.guests import confinement, landlock, seccomp
from refseq_bench.scenarios.methods.guests.confinement import Hold, confine, holds, in_words
from refseq_bench.scenarios.methods.guests.limits import FILE_BYTES, OPEN_FILES, GuestLimits
from tests.forked import in_child

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="confinement is Linux's")
PROGRAM = [path for path in (*sys.path, sys.prefix, sys.base_prefix) if path]


def outcome(act: Callable[[], object]) -> str:
    """The name of the error that an act meets, or 'done'."""
    try:
        act()
    except OSError as error:
        return errno.errorcode[error.errno or 0]
    return "done"


def confined(bench: int, scratch: Path, secret: Path) -> dict[str, object]:
    """Confine this process and try all that it should be kept from, and some that it may do."""
    confine(GuestLimits(memory=3, threads=64), PROGRAM, [str(scratch)], bench)
    return {
        "secret": outcome(secret.read_text),
        "beside": outcome(lambda: (secret.parent / "new").write_text("x")),
        "program": outcome(Path(os.__file__).read_bytes),
        "over the program": outcome(lambda: Path(os.__file__).open("ab")),
        "scratch": outcome(lambda: (scratch / "own").write_text("x")),
        "null": outcome(lambda: Path(os.devnull).write_text("x")),
        "socket": outcome(socket.socket),
        "child": outcome(lambda: os.fork() or os._exit(0)),
        "bench": outcome(lambda: os.kill(bench, 0)),
        "limits": [
            resource.getrlimit(kind)[1]
            for kind in (
                resource.RLIMIT_CORE,
                resource.RLIMIT_NOFILE,
                resource.RLIMIT_FSIZE,
                resource.RLIMIT_DATA,
            )
        ],
    }


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """A scratch folder, and a file beside it that is not to be read."""
    (tmp_path / "scratch").mkdir()
    (tmp_path / "secret").write_text("secret")
    return tmp_path / "scratch", tmp_path / "secret"


def below(kind: int, most: int) -> int:
    hard = resource.getrlimit(kind)[1]
    return most if hard == resource.RLIM_INFINITY else min(most, hard)


@LINUX
def test_a_confined_process_has_its_own_and_nothing_else(folders: tuple[Path, Path]) -> None:
    if not landlock.version() or not seccomp.available():
        pytest.skip("this kernel has not both Landlock and seccomp")
    bench = os.getpid()
    found = in_child(lambda: confined(bench, *folders), folders[0])
    assert found.pop("limits") == [
        below(resource.RLIMIT_CORE, 0),
        below(resource.RLIMIT_NOFILE, OPEN_FILES),
        below(resource.RLIMIT_FSIZE, FILE_BYTES),
        below(resource.RLIMIT_DATA, 3 * 2**30),
    ]
    assert found == {
        "secret": "EACCES",
        "beside": "EACCES",
        "program": "done",
        "over the program": "EACCES",
        "scratch": "done",
        "null": "done",
        "socket": "EPERM",
        "child": "EPERM",
        "bench": "EPERM",
    }
    assert not (folders[1].parent / "new").exists()


@LINUX
def test_without_landlock_the_filter_still_holds(folders: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    if not seccomp.available():
        pytest.skip("this kernel has no seccomp")
    monkeypatch.setattr(landlock, "version", lambda: 0)
    bench = os.getpid()
    found = in_child(lambda: confined(bench, *folders), folders[0])
    assert (found["secret"], found["socket"], found["child"]) == ("done", "EPERM", "EPERM")


@LINUX
def test_without_a_filter_landlock_still_holds(folders: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    if not landlock.version():
        pytest.skip("this kernel has no Landlock")
    monkeypatch.setattr(seccomp, "available", lambda: False)
    bench = os.getpid()
    found = in_child(lambda: confined(bench, *folders), folders[0])
    assert (found["secret"], found["beside"], found["scratch"], found["child"]) == ("EACCES", "EACCES", "done", "done")


@LINUX
def test_a_guest_whose_bench_has_died_does_not_begin(folders: tuple[Path, Path]) -> None:
    with pytest.raises(ChildProcessError) as caught:
        in_child(lambda: confined(1 << 22, *folders), folders[0])
    assert caught.value.args == (1,)


@pytest.mark.parametrize(
    ("version", "filtered", "lacking"),
    [
        (7, True, []),
        (6, False, ["network", "child processes"]),
        (3, False, ["network", "other processes", "child processes"]),
        (0, True, ["files"]),
        (0, False, ["files", "network", "other processes", "child processes"]),
    ],
)
def test_what_a_machine_cannot_keep_a_guest_from_is_told(
    version: int, filtered: bool, lacking: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(landlock, "version", lambda: version)
    monkeypatch.setattr(seccomp, "available", lambda: filtered)
    monkeypatch.setattr(sys, "platform", "linux")
    found = holds()
    expected = lacking if version < 4 else [one for one in lacking if one != "network"]
    assert [one.kept_from for one in found if not one.by] == expected
    assert in_words(found).endswith(f"not kept from {', '.join(expected)}") == bool(expected)


def test_holds_in_words() -> None:
    assert in_words([Hold("files", "a"), Hold("network", ""), Hold("memory", "b")]) == (
        "files: a; memory: b; not kept from network"
    )
    assert in_words([Hold("files", "")]) == "not kept from files"


@dataclass
class Refusing:
    """A C library whose calls fail with one error."""

    code: int

    def _fail(self, *_: object) -> int:
        ctypes.set_errno(self.code)
        return -1

    prctl = capset = syscall = _fail


def test_a_means_that_cannot_be_applied_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Refusing(errno.EINVAL))
    monkeypatch.setattr(landlock, "version", lambda: 1)
    with pytest.raises(OSError, match="prctl 4: Invalid argument"):
        confinement._control(confinement.SET_DUMPABLE, 0)
    with pytest.raises(OSError, match="capset: Invalid argument"):
        confinement._drop_capabilities()
    with pytest.raises(OSError, match="seccomp: Invalid argument"):
        seccomp.restrict()
    with pytest.raises(OSError, match="landlock: Invalid argument"):
        landlock.restrict([], [], [])
