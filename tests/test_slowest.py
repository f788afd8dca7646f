"""The table of the slowest tests."""

from dataclasses import dataclass

from tests.slowest import slowest


@dataclass
class Phase:
    nodeid: str
    duration: float


def test_phases_of_a_test_add_up_and_the_longest_come_first() -> None:
    phases = [
        Phase("a.py::quick", 1.0),
        Phase("b.py::slow[x]", 2.0),
        Phase("b.py::slow[x]", 1.5),
        Phase("c.py::c", 2.5),
    ]
    assert slowest(phases, 2).splitlines() == [
        "The slowest 2 of 3 tests, which together took 7 s of one core:",
        "",
        "| s | test |",
        "|---:|---|",
        "| 3.5 | `b.py::slow[x]` |",
        "| 2.5 | `c.py::c` |",
    ]
