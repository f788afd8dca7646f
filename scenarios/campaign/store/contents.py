"""Digests of what files hold, kept so that large ones are not read again for every key."""

import hashlib
import json
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from refseq.files import replace_text
from refseq_bench.scenarios.campaign.store.keys import key_of
from refseq_bench.user_cache import user_cache

KEPT = "contents"
"""Folder of the user's own store in which digests are kept, one file for each path."""
SETTLED = 2_000_000_000
"""Longest tick of a file system's dates [ns]: within one, a file may change and its dates may not."""

State = Sequence[tuple[str, int, int, int, int]]
"""Name, inode, size, and the times of the last change [ns] of a file's content and of anything else, by file."""


def content_digest(path: Path) -> str:
    """Digest of a file, or of all files in a folder with their names; their dates and places do not count.

    It is kept with the files' sizes, dates and inodes, and reckoned again where one of them is another. Nobody can set
    the date of the last change of anything, so whatever is done to a file shows. Raises ``OSError``.
    """
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    named = [(file.relative_to(path).as_posix(), file) for file in files if file.is_file()]
    now, state = time.time_ns(), _state(named)
    place = user_cache() / KEPT / f"{key_of(str(path.resolve()))}.json"
    if (kept := _kept(place, state)) is not None:
        return kept
    digest = hashlib.sha256()
    for name, file in named:
        digest.update(f"{name}\n".encode())
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    found = digest.hexdigest()
    if _settled(state, now) and _state(named) == state:
        _keep(place, state, found)
    return found


def _state(named: Sequence[tuple[str, Path]]) -> State:
    told = ((name, file.stat()) for name, file in named)
    return [(name, one.st_ino, one.st_size, one.st_mtime_ns, one.st_ctime_ns) for name, one in told]


def _settled(state: State, now: int) -> bool:
    """Tell whether no file was changed so lately [ns] that its dates would be the same after another change."""
    return all(max(content, other) + SETTLED < now for *_, content, other in state)


def _kept(place: Path, state: State) -> str | None:
    """The digest that is kept of files in this state, None: none."""
    with suppress(OSError, ValueError):
        match json.loads(place.read_text(encoding="utf-8")):
            case {"state": told, "digest": str(digest)} if told == key_of(state):
                return digest
    return None


def _keep(place: Path, state: State, digest: str) -> None:
    with suppress(OSError):  # where nothing can be kept, it is reckoned each time
        place.parent.mkdir(parents=True, exist_ok=True)
        replace_text(place, json.dumps({"state": key_of(state), "digest": digest}))
