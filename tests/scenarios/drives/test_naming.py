import pytest

from refseq_bench.scenarios.drives.naming import pair_name

FIRST = {"world": "hallway", "light": "16:00", "route": "forward", "change": "none"}


@pytest.mark.parametrize(
    ("query", "name"),
    [
        ({"light": "18:00"}, "hallway, 16:00 → 18:00"),
        ({"light": "18:00", "route": "reverse"}, "hallway, 16:00 → 18:00, reverse"),
        ({"change": "people=0.5"}, "hallway, 16:00 → 16:00, change people=0.5"),
        ({"light": ""}, "hallway"),
    ],
)
def test_drives_are_named_by_what_differs(query: dict[str, str], name: str) -> None:
    assert pair_name(FIRST, FIRST | query) == name


def test_a_changed_reference_is_told_too() -> None:
    busy = FIRST | {"change": "doors=0.2"}
    assert pair_name(busy, FIRST) == "hallway, 16:00 → 16:00, change doors=0.2 → none"


def test_logs_that_tell_nothing() -> None:
    assert pair_name({}, {}) == "drives of unknown light"
