"""Options by their keys, as they are read of a word: ``cloud=0.5,lamps=on``."""

from collections.abc import Sequence
from typing import TypeVar

from refseq_bench.worlds.errors import WorldsError

Value = TypeVar("Value")


def once(options: Sequence[tuple[str, Value]], what: str, error: type[WorldsError]) -> dict[str, Value]:
    """Options by key. Raises ``error`` of ``what`` they are for where a key is given twice."""
    keys = [key for key, _ in options]
    for key in keys:
        if keys.count(key) > 1:
            raise error(f"{what}: {key} is given twice; valid is once")
    return dict(options)
