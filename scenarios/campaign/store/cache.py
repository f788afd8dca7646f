"""A store of what is dear to make, by key: recordings and answers are made once and kept for whoever asks again."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from refseq.drafts import draft_folder, sweep_drafts
from refseq.errors import RefseqError
from refseq.files import put
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.user_cache import VARIABLE

RECORDING, MAP, ANSWERS = ".mcap", ".refseq", ".parquet"
"""Endings of what is kept."""
DESCRIPTIONS = "descriptions.sqlite"
"""The file of descriptions (``refseq_bench.scenarios.campaign.store.descriptions``); SQLite has others beside it."""
ENDS = {
    RECORDING: (b"\x89MCAP0\r\n", b"\x89MCAP0\r\n", 8),
    MAP: (b"PK\3\4", b"PK\5\6", 22),
    ANSWERS: (b"PAR1", b"PAR1", 4),
}
"""With what a whole file of each kind begins, what stands near its end, and how many bytes before it."""
MORE = 1 << 20
"""Bytes that a disk must still take not to be called full: about those of a view with its images."""


class DamagedError(Exception):
    """A file of the store is not what was put there; ``key`` is its own."""

    def __init__(self, key: str, reason: str) -> None:
        super().__init__(key, reason)
        self.key, self.reason = key, reason

    def __str__(self) -> str:
        return self.reason


class Store:
    """Files in a folder, each named by its key; one that is there is whole.

    Several processes, of several campaigns, may make the same file at once: the last one wins, and all are alike. A
    file is made in a draft folder (``refseq.drafts``) and moved to its name in one step. Raises ``ScenarioError`` where
    the folder cannot be made or written to, unless all that is wanted is to be ``read_only``.
    """

    def __init__(self, folder: Path, *, read_only: bool = False) -> None:
        self.folder = folder
        if not read_only:
            _make_ready(folder)

    def path(self, key: str, ending: str) -> Path:
        """Where a key's file is, or will be."""
        return self.folder / f"{key}{ending}"

    def has(self, key: str, ending: str) -> bool:
        """Return true where it is there and not cut off."""
        return _whole(self.path(key, ending))

    def make(self, key: str, ending: str, maker: Callable[[Path], object]) -> Path:
        """The file of a key, made by ``maker`` where it is not there yet. ``ScenarioError`` where the disk is full."""
        path = self.path(key, ending)
        if not _whole(path):
            with draft_folder(self.folder) as folder:
                draft = folder / path.name
                try:
                    maker(draft)
                except (OSError, RuntimeError, RefseqError) as error:
                    if reason := _refuses(folder):  # writers tell of a full disk in many ways, some in riddles
                        raise ScenarioError(f"{path}: cannot be kept: {reason}") from error
                    raise
                if not _whole(draft):
                    raise ScenarioError(f"{path}: cannot be kept: {_refuses(folder) or 'it was not written whole'}")
                put(draft, path)
        return path

    def discard(self, key: str) -> None:
        """Throw away what is kept of a key."""
        for ending in ENDS:
            self.path(key, ending).unlink(missing_ok=True)

    @property
    def size(self) -> int:
        """Bytes of all that is kept."""
        files = (path for path in self.folder.iterdir() if path.suffix in ENDS or path.name.startswith(DESCRIPTIONS))
        return sum(path.stat().st_size for path in files if path.is_file())

    def sweep(self) -> None:
        """Remove the drafts of makers that are no more."""
        sweep_drafts(self.folder)


def _make_ready(folder: Path) -> None:
    """Make a folder to write into, or see that the one that is there can be written to."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        reason = "" if os.access(folder, os.W_OK | os.X_OK) else "no write access"
    except OSError as error:
        reason = error.strerror or str(error)
    if reason:
        valid = f"valid is a folder that can be written to, by --cache or {VARIABLE}"
        raise ScenarioError(f"{folder}: cannot hold what is kept: {reason}; {valid}")


def _refuses(folder: Path) -> str:
    """Reason why no more can be written into a folder; empty where it can be."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(MORE))
            file.flush()
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _whole(path: Path) -> bool:
    """Return true where a file begins and ends as its kind does: one that was cut off does not."""
    begin, end, before = ENDS[path.suffix]
    try:
        with path.open("rb") as file:
            begins = file.read(len(begin)) == begin
            start = file.seek(-before, os.SEEK_END)
            return begins and start >= len(begin) and file.read(len(end)) == end
    except OSError:
        return False
