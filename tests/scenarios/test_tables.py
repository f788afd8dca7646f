"""Words of tables: counts with what they count."""

import pytest

from refseq_bench.scenarios.tables import plural


@pytest.mark.parametrize(
    ("count", "word", "told"),
    [(1, "path", "1 path"), (0, "path", "0 paths"), (2, "stretch", "2 stretches"), (3, "pass", "3 passes")],
)
def test_one_is_not_many(count: int, word: str, told: str) -> None:
    assert plural(count, word) == told
