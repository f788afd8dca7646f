"""A store of what is dear to make, by key: recordings and answers are made once and kept for whoever asks again."""

import os
from collections.abc import Callable
from pathlib import Path

from refseq.files import replacing_at
from scenarios.errors import ScenarioError

RECORDING, ANSWERS = ".mcap", ".parquet"
"""Endings of what is kept."""
FOLDER = "REFSEQ_CACHE"
"""Environment variable that names another folder than the user's own."""


class Store:
    """Files in a folder, each named by its key; one that is there is whole.

    Several processes may make the same file at once: the last one wins, and all are alike. Raises ``ScenarioError``
    where the folder cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ScenarioError(f"{folder}: cannot hold what is kept: {error.strerror}") from error

    def path(self, key: str, ending: str) -> Path:
        """Where a key's file is, or will be."""
        return self.folder / f"{key}{ending}"

    def has(self, key: str, ending: str) -> bool:
        """Whether it is there."""
        return self.path(key, ending).is_file()

    def make(self, key: str, ending: str, maker: Callable[[Path], object]) -> Path:
        """The file of a key, made by ``maker`` where it is not there yet."""
        path = self.path(key, ending)
        if not path.is_file():
            with replacing_at(path) as draft:
                maker(draft)
        return path

    @property
    def size(self) -> int:
        """Bytes of all that is kept."""
        return sum(path.stat().st_size for path in self.folder.iterdir() if path.is_file())


def default_store() -> Path:
    """The folder of the user's own store: ``REFSEQ_CACHE``, or ``refseq`` in the user's cache folder."""
    if named := os.environ.get(FOLDER):
        return Path(named)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "refseq"
