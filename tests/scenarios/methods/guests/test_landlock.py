import ctypes
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from refseq_bench.scenarios.methods.guests import landlock

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Landlock is Linux's")


@dataclass
class Kernel:
    """A kernel of one version of the interface, by what `landlock.h` says of it; takes down what it is asked for."""

    version: int
    handled: tuple[int, ...] = ()
    allowed: dict[str, int] = field(default_factory=dict)
    restricted: bool = False

    def syscall(self, number: Any, *given: Any) -> int:
        match getattr(number, "value", number):
            case 444 if given[0] is None:
                return self.version
            case 444:
                words = given[1].value // 8
                assert words == (1 if self.version < 4 else 2 if self.version < 6 else 3)
                self.handled = tuple((ctypes.c_uint64 * words).from_address(ctypes.addressof(given[0]._obj)))
                return os.open(os.devnull, os.O_RDONLY)
            case 445:
                assert not self.restricted
                rule = given[2]._obj
                assert rule.rights & ~self.handled[0] == 0  # the kernel says EINVAL to rights that are not handled
                self.allowed[str(Path(f"/proc/self/fd/{rule.folder}").readlink())] = rule.rights
                return 0
            case 446:
                self.restricted = True
                return 0
        raise AssertionError(number)


@pytest.fixture(params=range(1, 9))
def kernel(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Kernel:
    """Kernels of all versions, one by one."""
    made = Kernel(request.param)
    monkeypatch.setattr(landlock, "_library", lambda: made)
    return made


@LINUX
def test_each_version_is_asked_for_all_that_it_knows(kernel: Kernel, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "file").touch()
    open_before = len(list(Path("/proc/self/fd").iterdir()))
    landlock.restrict(
        [str(tmp_path), str(tmp_path / "file"), str(tmp_path / "absent")], [str(tmp_path / "own")], ["/dev/null"]
    )
    # Bits of LANDLOCK_ACCESS_FS_*: thirteen at first, then to refer, to truncate and to control devices.
    bits = 13 + (kernel.version >= 2) + (kernel.version >= 3) + (kernel.version >= 5)
    every = 2**bits - 1
    assert kernel.handled == (every, *[0b11] * (kernel.version >= 4), *[0b11] * (kernel.version >= 6))
    assert kernel.restricted
    device = 0b110 | (0x8000 if kernel.version >= 5 else 0)
    assert kernel.allowed == {
        str(tmp_path): 0b1101,  # to execute, to read a file and to list
        str(tmp_path / "file"): 0b101,
        str(tmp_path / "own"): every & ~1,
        "/dev/null": device,
    }
    assert len(list(Path("/proc/self/fd").iterdir())) == open_before


@LINUX
def test_a_kernel_without_it_has_version_0(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(landlock, "_library", lambda: Kernel(-1))
    assert landlock.version() == 0


def test_another_system_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(landlock, "_library", lambda: pytest.fail("asked"))
    assert landlock.version() == 0
