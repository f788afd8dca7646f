"""Confinement of a guest: what keeps it from the bench's files, memory, processes and network on this machine.

``confine`` is called in the guest before any of the user's code; ``holds`` tells on the bench's side what will be in
force. Where the kernel has a means and it cannot be applied, the guest does not begin.
"""

import ctypes
import os
import resource
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from refseq_bench.scenarios.methods.guests import landlock, seccomp
from refseq_bench.scenarios.methods.guests.limits import FILE_BYTES, OPEN_FILES, GuestLimits

SYSTEM = (
    *("/bin", "/lib", "/lib32", "/lib64", "/usr/bin", "/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/libexec"),
    *("/usr/share", "/usr/local/bin", "/usr/local/lib", "/usr/local/share", "/usr/local/cuda", "/nix/store"),
    *("/etc/ld.so.cache", "/etc/localtime", "/etc/ssl/openssl.cnf", "/etc/OpenCL/vendors", "/etc/vulkan"),
    *("/proc/self", "/proc/cpuinfo", "/proc/meminfo", "/proc/stat", "/proc/driver", "/proc/devices"),
    *("/proc/sys/vm/overcommit_memory", "/sys/devices/system", "/sys/fs/cgroup/cpu.max"),
    *("/sys/bus/pci", "/sys/class/drm", "/sys/module/nvidia", "/sys/kernel/mm/transparent_hugepage"),
)
"""Files of the system that any program may read: its libraries, and what the machine is like."""
DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom", "/dev/kfd", "/dev/dri")
GRAPHICS_CARDS = "nvidia*"
SET_DEATH_SIGNAL, SET_DUMPABLE, SET_NO_NEW_PRIVILEGES = 1, 4, 38
CAPABILITIES = 0x20080522
"""Version of the structure that ``capset`` is given: two words of each of three sets, for the process 0, itself."""
SIGKILL = 9


@dataclass(frozen=True)
class Hold:
    """One thing that a guest is kept from; ``by`` what, empty where this machine has nothing that would."""

    kept_from: str
    by: str


def holds() -> tuple[Hold, ...]:
    """All that guests are to be kept from, and what does so on this machine."""
    version, filtered = landlock.version(), seccomp.available()
    lock, filter_ = f"landlock {version}" if version else "", "seccomp" if filtered else ""
    tcp = f"{lock}, TCP only" if version >= 4 else ""
    return (
        Hold("files", lock and ", ".join(filter(None, (lock, filter_)))),
        Hold("network", filter_ or tcp),
        Hold("other processes", ", ".join(filter(None, (filter_, lock if version >= 6 or filtered else "")))),
        Hold("child processes", filter_),
        Hold("memory, time, threads, file size", "rlimits and a watch" if sys.platform.startswith("linux") else ""),
    )


def in_words(found: Sequence[Hold]) -> str:
    """A line that tells what is in force, and what is not."""
    kept = "; ".join(f"{one.kept_from}: {one.by}" for one in found if one.by)
    missing = ", ".join(one.kept_from for one in found if not one.by)
    return "; ".join(filter(None, (kept, f"not kept from {missing}" if missing else "")))


def confine(limits: GuestLimits, read: Sequence[str], write: Sequence[str], bench: int) -> None:
    """Confine this process for good; it ends with ``bench``, its parent. Raises ``OSError`` where that cannot be."""
    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_NOFILE, OPEN_FILES),
        (resource.RLIMIT_FSIZE, FILE_BYTES),
        (resource.RLIMIT_DATA, limits.memory_bytes),
    ):
        _lower(kind, most)
    if not sys.platform.startswith("linux"):
        return
    _control(SET_DEATH_SIGNAL, SIGKILL)
    if os.getppid() != bench:  # it died before it was to tell
        os._exit(1)
    _control(SET_NO_NEW_PRIVILEGES, 1)
    if landlock.version():
        cards = (str(path) for path in Path("/dev").glob(GRAPHICS_CARDS))
        landlock.restrict((*SYSTEM, *read), write, (*DEVICES, *cards))
    _drop_capabilities()
    if seccomp.available():
        seccomp.restrict()


def _lower(kind: int, most: int) -> None:
    _, hard = resource.getrlimit(kind)
    most = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(kind, (most, most))


def _control(command: int, value: int) -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(command, *map(ctypes.c_ulong, (value, 0, 0, 0))) != 0:
        code = ctypes.get_errno()
        raise OSError(code, f"prctl {command}: {os.strerror(code)}")


def _drop_capabilities() -> None:
    """Root's rights over other users' files and processes go; of one who is not root there are none."""
    library = ctypes.CDLL(None, use_errno=True)
    head, none = (ctypes.c_uint32 * 2)(CAPABILITIES, 0), (ctypes.c_uint32 * 6)()
    if library.capset(head, none) != 0:
        code = ctypes.get_errno()
        raise OSError(code, f"capset: {os.strerror(code)}")
