"""The folder in which the bench keeps what is dear to make: recordings, answers, light."""

import os
from pathlib import Path

VARIABLE = "REFSEQ_CACHE"
"""Environment variable that names another folder than the user's own."""


def user_cache() -> Path:
    """The user's own: ``REFSEQ_CACHE``, or ``refseq`` in the user's cache folder. Nothing is made."""
    if named := os.environ.get(VARIABLE):
        return Path(named)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "refseq"
