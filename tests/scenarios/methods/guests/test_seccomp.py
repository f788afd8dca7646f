import errno
import os
import platform
import re
import struct
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from refseq_bench.scenarios.methods.guests import seccomp
from refseq_bench.scenarios.methods.guests.seccomp import (
    CLONE,
    CLONE3,
    FCNTL,
    MACHINES,
    OWN_ONLY,
    PRCTL,
    REFUSED,
    program,
)

ALLOWED = 0x7FFF0000
REFUSED_SO, ABSENT = 0x50000 | errno.EPERM, 0x50000 | errno.ENOSYS
OWN = 4711


def decision(code: bytes, machine: int, number: int, *arguments: int) -> int:
    """Run a filter as the kernel does, on the calls' description of `linux/seccomp.h`."""
    values = [*arguments, *[0] * (6 - len(arguments))]
    data = struct.pack("<IIQ6Q", number, machine, 0, *(value & (2**64 - 1) for value in values))
    at, held = 0, 0
    while True:
        what, yes, no, number = struct.unpack_from("<HBBI", code, 8 * at)
        at += 1
        match what:
            case 0x20:
                (held,) = struct.unpack_from("<I", data, number)
            case 0x15:
                at += yes if held == number else no
            case 0x45:
                at += yes if held & number else no
            case 0x06:
                return number


@pytest.mark.parametrize("kind", MACHINES)
def test_the_filter_decides_as_its_tables_say(kind: str) -> None:
    column, machine = MACHINES[kind]
    code = program(kind, OWN)
    for name, numbers in REFUSED.items():
        if (number := numbers[column]) is not None:
            assert decision(code, machine, number) == REFUSED_SO, name
    for name, numbers in OWN_ONLY.items():
        found = [decision(code, machine, numbers[column], first) for first in (0, OWN, 1, OWN + 1, -1, -OWN)]
        assert found == [ALLOWED, ALLOWED, *[REFUSED_SO] * 4], name
    assert decision(code, machine, CLONE[column], 0x3D0F00) == ALLOWED  # a thread of glibc's
    assert decision(code, machine, CLONE[column], 17) == REFUSED_SO  # a child
    assert decision(code, machine, CLONE3[column]) == ABSENT
    assert [decision(code, machine, FCNTL[column], 3, command) for command in (8, 15, 1)] == [
        REFUSED_SO,
        REFUSED_SO,
        ALLOWED,
    ]
    assert [decision(code, machine, PRCTL[column], command) for command in (1, 15)] == [REFUSED_SO, ALLOWED]
    assert decision(code, machine ^ 1, 0) == 0x80000000
    assert decision(code, machine, 0x40000000 | 41) == ABSENT


@given(st.integers(0, 500), st.sampled_from(list(MACHINES)))
def test_calls_in_no_table_are_allowed(number: int, kind: str) -> None:
    column, machine = MACHINES[kind]
    told = (*REFUSED.values(), *OWN_ONLY.values(), CLONE, CLONE3, FCNTL, PRCTL)
    if number not in [numbers[column] for numbers in told]:
        assert decision(program(kind, OWN), machine, number, 99) == ALLOWED


HEADERS = {
    "x86_64": Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h"),
    "aarch64": Path("/usr/include/asm-generic/unistd.h"),
}


@pytest.mark.parametrize("kind", HEADERS)
def test_numbers_are_the_kernel_s(kind: str) -> None:
    if not HEADERS[kind].is_file():
        pytest.skip(f"the kernel's headers are not installed ({HEADERS[kind]})")
    lines = re.findall(r"#define __NR(?:3264)?_(\w+)\s+(\d+)", HEADERS[kind].read_text())
    true = {name: int(number) for name, number in lines}
    column = MACHINES[kind][0]
    tables = {**REFUSED, **OWN_ONLY, "clone": CLONE, "clone3": CLONE3, "fcntl": FCNTL, "prctl": PRCTL}
    assert len(true) > 250
    assert {name: numbers[column] for name, numbers in tables.items() if name in true} == {
        name: true[name] for name in tables if name in true
    }
    only_x86 = {name for name, numbers in REFUSED.items() if numbers[1] is None}
    young = {"memfd_secret", "fchmodat2", "setxattrat", "removexattrat", "file_setattr"}
    assert {name for name in tables if name not in true} <= young | only_x86


def test_it_is_available_where_the_tests_run() -> None:
    if not sys.platform.startswith("linux") or platform.machine() not in MACHINES:
        pytest.skip("no Linux on a machine whose numbers are known")
    assert seccomp.available() == ("Seccomp:" in Path("/proc/self/status").read_text())
    assert os.getpid() > 0
