"""Landlock, by which a process gives up files, ports and other processes for good; Linux 5.13 or later, no root.

Rights and structures: the kernel's ``include/uapi/linux/landlock.h``. Libraries have no calls for it, so the three
system calls are made by their numbers, which are the same on all machines.
"""

import ctypes
import os
import sys
from collections.abc import Iterable
from stat import S_ISDIR

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
VERSION, PATH_BENEATH = 1, 1
EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
TRUNCATE, IOCTL_DEV = 1 << 14, 1 << 15
FILE_RIGHTS = {1: 0x1FFF, 2: 0x3FFF, 3: 0x7FFF, 4: 0x7FFF, 5: 0xFFFF}
"""All rights to files that a version of the interface knows; later versions have those of the fifth."""
TCP = 0b11
"""To bind a TCP port and to connect to one; from the fourth version on."""
SCOPES = 0b11
"""Abstract Unix sockets and signals to processes outside; from the sixth version on."""
READ = EXECUTE | READ_FILE | READ_DIR
NOT_OF_FILES = READ_DIR | 0x1FF0 | 1 << 13
"""Rights that only folders can give: to list, remove and make what is in them."""


class _Ruleset(ctypes.Structure):
    _fields_ = (("files", ctypes.c_uint64), ("ports", ctypes.c_uint64), ("scopes", ctypes.c_uint64))


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("rights", ctypes.c_uint64), ("folder", ctypes.c_int32))


def version() -> int:
    """Version of the kernel's interface; 0 where there is none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(0, _library().syscall(CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(VERSION)))


def restrict(read: Iterable[str], write: Iterable[str], devices: Iterable[str]) -> None:
    """Give up all files but these, for this process and what comes of it; paths that are not there are left out.

    What is below a path of ``read`` may be read and executed, below one of ``write`` all may be done, ``devices`` are
    spoken to. Ports, other processes' memory and signals to them go as well, where the kernel's version knows them. It
    must be called with one thread, after ``no_new_privs`` was set. Raises ``OSError``.
    """
    found = version()
    every = FILE_RIGHTS[min(found, max(FILE_RIGHTS))]
    ruleset = _Ruleset(every, TCP if found >= 4 else 0, SCOPES if found >= 6 else 0)
    size = 8 if found < 4 else 16 if found < 6 else 24
    rules = _call(CREATE_RULESET, ctypes.byref(ruleset), ctypes.c_size_t(size), ctypes.c_uint32(0))
    try:
        for paths, rights in ((read, READ), (write, every & ~EXECUTE), (devices, READ_FILE | WRITE_FILE | IOCTL_DEV)):
            for path in paths:
                _allow(rules, path, rights & every)
        _call(RESTRICT_SELF, ctypes.c_int(rules), ctypes.c_uint32(0))
    finally:
        os.close(rules)


def _allow(rules: int, path: str, rights: int) -> None:
    try:
        place = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not S_ISDIR(os.fstat(place).st_mode):
            rights &= ~NOT_OF_FILES
        rule = _PathBeneath(rights, place)
        _call(ADD_RULE, ctypes.c_int(rules), ctypes.c_int(PATH_BENEATH), ctypes.byref(rule), ctypes.c_uint32(0))
    finally:
        os.close(place)


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def _call(number: int, *arguments: object) -> int:
    answer: int = _library().syscall(ctypes.c_long(number), *arguments)
    if answer < 0:
        code = ctypes.get_errno()
        raise OSError(code, f"landlock: {os.strerror(code)}")
    return answer
