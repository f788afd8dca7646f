"""A filter of system calls: no network, no second process, no hand on other processes; Linux, no root.

Calls are refused by an error as if the user had not the right, so that libraries that try one go on without. The filter
is a program for the kernel's packet filter (``linux/filter.h``, ``linux/seccomp.h``); numbers are those of the kernel's
``unistd.h``, on the two kinds of machines that the bench is run on.
"""

import ctypes
import errno
import os
import platform
import struct
import sys
from collections.abc import Mapping
from types import MappingProxyType

REFUSED: Mapping[str, tuple[int, int | None]] = {
    # network, and the ring that would make calls past the filter
    "socket": (41, 198),
    "io_uring_setup": (425, 425),
    # what Landlock lets anybody do to a file whose path he knows
    "chmod": (90, None),
    "fchmod": (91, 52),
    "fchmodat": (268, 53),
    "fchmodat2": (452, 452),
    "chown": (92, None),
    "fchown": (93, 55),
    "lchown": (94, None),
    "fchownat": (260, 54),
    "utime": (132, None),
    "utimes": (235, None),
    "futimesat": (261, None),
    "utimensat": (280, 88),
    "setxattr": (188, 5),
    "lsetxattr": (189, 6),
    "fsetxattr": (190, 7),
    "setxattrat": (463, 463),
    "removexattr": (197, 14),
    "lremovexattr": (198, 15),
    "fremovexattr": (199, 16),
    "removexattrat": (466, 466),
    "file_setattr": (469, 469),
    "truncate": (76, 45),
    "inotify_init": (253, None),
    "inotify_init1": (294, 26),
    "fanotify_init": (300, 262),
    # processes
    "fork": (57, None),
    "vfork": (58, None),
    "unshare": (272, 97),
    "setns": (308, 268),
    # memory that outlives a process, or is in none
    "shmget": (29, 194),
    "shmat": (30, 196),
    "semop": (65, 193),
    "semtimedop": (220, 192),
    "msgsnd": (69, 189),
    "msgrcv": (70, 188),
    "semget": (64, 190),
    "msgget": (68, 186),
    "mq_open": (240, 180),
    "memfd_create": (319, 279),
    "memfd_secret": (447, 447),
    # other processes
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "process_madvise": (440, 440),
    "pidfd_open": (434, 434),
    "pidfd_getfd": (438, 438),
    "pidfd_send_signal": (424, 424),
    "kcmp": (312, 272),
    "tkill": (200, 130),
    "setpriority": (141, 140),
    "ioprio_set": (251, 30),
    "migrate_pages": (256, 238),
    "move_pages": (279, 239),
    # doors into the kernel that no localiser needs
    "bpf": (321, 280),
    "perf_event_open": (298, 241),
    "userfaultfd": (323, 282),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
}
OWN_ONLY: Mapping[str, tuple[int, int]] = {
    "kill": (62, 129),
    "tgkill": (234, 131),
    "rt_sigqueueinfo": (129, 138),
    "rt_tgsigqueueinfo": (297, 240),
    "prlimit64": (302, 261),
    "sched_setparam": (142, 118),
    "sched_setscheduler": (144, 119),
    "sched_setaffinity": (203, 122),
    "sched_setattr": (314, 274),
}
"""Calls whose first argument is a process: only the guest's own number, or 0 for itself, will do."""
CLONE, CLONE3, FCNTL, PRCTL = (56, 220), (435, 435), (72, 25), (157, 167)
OWNERS = (8, 15)
"""Commands of ``fcntl`` that choose who gets a file's signals."""
DEATH_SIGNAL = 1
"""Command of ``prctl`` by which a guest could outlive the bench."""
THREAD = 0x10000
"""Flag of ``clone`` for a thread of the same process."""
MACHINES = MappingProxyType({"x86_64": (0, 0xC000003E), "aarch64": (1, 0xC00000B7)})
"""Column of the numbers above, and the kernel's name of the machine."""
X32 = 0x40000000
"""Bit of the numbers of x86's second set of calls, which nobody uses."""

LOAD, EQUAL, SET, RETURN = 0x20, 0x15, 0x45, 0x06
NUMBER_AT, MACHINE_AT, FIRST_AT, SECOND_AT = 0, 4, 16, 24
ALLOW, FAIL, KILL = 0x7FFF0000, 0x00050000, 0x80000000
SET_FILTER, SET_SECCOMP, GET_SECCOMP = 2, 22, 21

Step = tuple[int, int, int, int]
"""A step of the program: what it does, how many steps to skip if true and if false, its number."""


def available() -> bool:
    """Tell whether this machine can filter system calls, and is one whose numbers are known."""
    if not sys.platform.startswith("linux") or platform.machine() not in MACHINES or struct.calcsize("P") != 8:
        return False
    return bool(ctypes.CDLL(None).prctl(GET_SECCOMP, 0, 0, 0, 0) >= 0)


def program(machine: str, own: int) -> bytes:
    """The filter for the process of that number on a kind of machine."""
    column, name = MACHINES[machine]
    allow, refuse, absent = ((RETURN, 0, 0, told) for told in (ALLOW, FAIL | errno.EPERM, FAIL | errno.ENOSYS))
    steps: list[Step] = [(LOAD, 0, 0, MACHINE_AT), (EQUAL, 1, 0, name), (RETURN, 0, 0, KILL), (LOAD, 0, 0, NUMBER_AT)]
    steps += [(SET, 0, 1, X32), absent]

    def on(numbers: tuple[int, int | None], *then: Step) -> None:
        if (number := numbers[column]) is not None:
            steps.extend([(EQUAL, 0, len(then), number), *then])

    for numbers in REFUSED.values():
        on(numbers, refuse)
    for numbers in OWN_ONLY.values():
        on(numbers, (LOAD, 0, 0, FIRST_AT), (EQUAL, 1, 0, 0), (EQUAL, 0, 1, own), allow, refuse)
    on(CLONE, (LOAD, 0, 0, FIRST_AT), (SET, 0, 1, THREAD), allow, refuse)
    on(CLONE3, absent)  # its flags lie in memory, out of sight: the C library goes back to clone
    on(FCNTL, (LOAD, 0, 0, SECOND_AT), (EQUAL, 1, 0, OWNERS[0]), (EQUAL, 0, 1, OWNERS[1]), refuse, allow)
    on(PRCTL, (LOAD, 0, 0, FIRST_AT), (EQUAL, 0, 1, DEATH_SIGNAL), refuse, allow)
    return b"".join(struct.pack("<HBBI", *step) for step in [*steps, allow])


def restrict() -> None:
    """Filter the calls of this process from now on, after ``no_new_privs`` was set. Raises ``OSError``."""
    code = ctypes.create_string_buffer(program(platform.machine(), os.getpid()))
    head = ctypes.create_string_buffer(struct.pack("@HP", (len(code) - 1) // 8, ctypes.addressof(code)))
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(SET_SECCOMP, ctypes.c_ulong(SET_FILTER), head, ctypes.c_ulong(0), ctypes.c_ulong(0)) != 0:
        found = ctypes.get_errno()
        raise OSError(found, f"seccomp: {os.strerror(found)}")
