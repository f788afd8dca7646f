"""Bytes that a method keeps, against sizes that are known."""

import mmap
from types import SimpleNamespace

import numpy as np
import pytest

from refseq_bench.scenarios.scoring.cost import CLEAR, STATUS, bytes_kept, forget_peak, peak_bytes

SMALL = 1000
"""What the objects around an array may take."""


class Slotted:
    __slots__ = ("table",)

    def __init__(self, table: np.ndarray) -> None:
        self.table = table


class Derived(Slotted):
    """Has a dictionary beside the slots of its parent."""


def test_an_array_counts_once_however_it_is_reached() -> None:
    table = np.zeros(1 << 16)
    derived = Derived(table)
    derived.again = table  # type: ignore[attr-defined]
    for thing in (table, [table, table], {"a": table}, SimpleNamespace(a=(table,)), Slotted(table), derived):
        assert table.nbytes <= bytes_kept(thing) < table.nbytes + SMALL
    assert bytes_kept(table, [table], derived) < table.nbytes + 2 * SMALL


def test_a_view_of_an_array_keeps_the_whole_of_it() -> None:
    table = np.zeros(1 << 16)
    assert table.nbytes <= bytes_kept(table[:3]) < table.nbytes + SMALL
    assert bytes_kept(table[:3], table[5:].reshape(-1)[::2]) < table.nbytes + SMALL
    assert bytes_kept(table[:3].copy()) < SMALL


def test_code_is_not_kept_and_a_ring_is_walked_once() -> None:
    ring: list[object] = [np, bytes_kept, Slotted]
    ring.append(ring)
    assert bytes_kept(ring) < SMALL


@pytest.mark.skipif(not (STATUS.exists() and CLEAR.exists()), reason="the system does not tell")
def test_the_peak_is_of_what_was_given_back_too_and_can_be_forgotten() -> None:
    forget_peak()
    before = peak_bytes()
    size = 64 << 20
    # Pages of its own: what is allocated may lie where something was given back to the process, not to the system, and
    # then stays resident; so nothing large may be allocated to fill them either.
    with mmap.mmap(-1, size) as pages:
        for start in range(0, size, mmap.PAGESIZE):
            pages[start] = 1
    assert size <= peak_bytes() - before + (4 << 20)
    forget_peak()
    assert peak_bytes() < before + size // 2
