"""Descriptions of pictures that are kept in the store: for all workers, for later cases and for later campaigns.

Finding a picture's keys is most of what a method does with it, and the same for all variants of the method. They follow
the picture, the settings and the code that describes, and nothing of what is done with them: whoever changes a chain or
tries a setting has them at hand.
"""

import hashlib
import io
import sqlite3
import time
from collections.abc import Callable, Hashable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.memory import Description, DescriptionMemory
from refseq_bench.scenarios.campaign.store.cache import DESCRIPTIONS
from refseq_bench.scenarios.campaign.store.keys import code_digest

MOST = 1 << 30
"""Bytes of descriptions that are kept: of some forty drives of a hundred views with two cameras, by three methods."""
SPARED = 0.75
"""Share of them that stays where the oldest make room."""
WORTH = 0.004
"""Time that finding takes which is worth keeping [s]: less is hardly more than looking it up."""
DESCRIBING = (
    "refseq.features.sift",
    "refseq.features.dense",
    "refseq.features.neural.words",
    "refseq_bench.scenarios.methods.baselines.matches",
)
"""Modules that describe: with them, and all that they import, changes what is kept."""
WAIT = 5.0
"""Time in which another worker's writing is waited for [s]."""

BEGINNING = (
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = OFF",  # what a crash of the machine loses is found again
    "CREATE TABLE IF NOT EXISTS descriptions (key BLOB PRIMARY KEY, seconds REAL, described BLOB)",
)


class KeptDescriptions(DescriptionMemory):
    """A memory whose descriptions, where they took long, are in a file as well, ``most`` bytes of them (``keep_in``).

    Where the file cannot be read or written, it is a memory like any other: nothing depends on it but time.
    """

    def __init__(self, most: int = MOST) -> None:
        super().__init__()
        self._most, self._code, self._room = most, "", 0
        self._folder: Path | None = None
        self._file: sqlite3.Connection | None = None

    def keep_in(self, folder: Path) -> None:
        """Use the file in a folder from now on, beside what is in memory already."""
        if folder == self._folder:
            return
        self._close()
        self._folder, self._file, self._room = folder, _opened(folder / DESCRIPTIONS), 0
        self._code = code_digest(*DESCRIBING)

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None

    def found(self, key: Hashable, find: Callable[[], NDArray[Any]]) -> Description:
        """A description from the file, or one that is found now and kept there."""
        name = hashlib.blake2b(repr((self._code, key)).encode(), digest_size=16).digest()
        begin = time.perf_counter()
        if kept := self._kept_as(name):
            self.spared += kept.seconds - (time.perf_counter() - begin)
            return kept
        found = super().found(key, find)
        if found.seconds > WORTH:
            self._keep(name, found)
        return found

    def _kept_as(self, name: bytes) -> Description | None:
        rows = self._told("SELECT seconds, described FROM descriptions WHERE key = ?", name)
        try:
            return Description(_read(rows[0][1]), float(rows[0][0])) if rows else None
        except (ValueError, TypeError, EOFError):
            return None

    def _keep(self, name: bytes, found: Description) -> None:
        content = _written(found.described)
        if len(content) > self._room:
            self._make_room()
        self._room -= len(content)
        self._told("INSERT OR REPLACE INTO descriptions VALUES (?, ?, ?)", name, found.seconds, content)

    def _make_room(self) -> None:
        """Let the oldest go where no room is left; others may have written meanwhile."""
        held = self._held()
        if held > self._most * SPARED:
            self._told(
                """DELETE FROM descriptions WHERE rowid IN (SELECT rowid FROM (SELECT rowid, sum(length(described))
                OVER (ORDER BY rowid DESC) AS newer FROM descriptions) WHERE newer > ?)""",
                int(self._most * SPARED),
            )
            held = self._held()
        self._room = max(0, int((self._most - held) / 8))  # seven others may write as much before they look again

    def _held(self) -> int:
        return int((self._told("SELECT total(length(described)) FROM descriptions") or [(0,)])[0][0])

    def _told(self, statement: str, *given: object) -> list[tuple[Any, ...]]:
        """Rows that a statement gives; none from then on where the file does not bear it."""
        if self._file is None:
            return []
        try:
            return self._file.execute(statement, given).fetchall()
        except sqlite3.Error:
            self._close()
            return []


def _opened(path: Path) -> sqlite3.Connection | None:
    """The file, made where it is not there, or where it is none; None where that cannot be."""
    for _ in ("the one that is there", "a new one"):
        file = None
        try:
            file = sqlite3.connect(path, timeout=WAIT, isolation_level=None)
            for statement in BEGINNING:
                file.execute(statement)
        except sqlite3.OperationalError:  # it may not be written to
            break
        except sqlite3.DatabaseError:
            if file is not None:
                file.close()
            with suppress(OSError):
                path.unlink()
        else:
            return file
    return None


def _written(described: NDArray[Any]) -> bytes:
    file = io.BytesIO()
    np.save(file, described, allow_pickle=False)
    return file.getvalue()


def _read(content: bytes) -> NDArray[Any]:
    described: NDArray[Any] = np.load(io.BytesIO(content), allow_pickle=False)
    described.setflags(write=False)
    return described
