"""Draft folders: a file is made in one beside its place, and moved there when it is whole.

A folder's name is new and nobody else may write into it, so no link lies ready to be written through. Its maker holds a
lock on it, which the system frees when the maker is no more: such leftovers are swept by whoever drafts there next.
"""

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

DRAFT = ".refseq-draft-"
"""Beginning of the names of draft folders."""


@contextmanager
def draft_folder(place: Path) -> Iterator[Path]:
    """A new folder in ``place`` to make files in, which is gone afterwards; those of the dead are swept."""
    sweep_drafts(place)
    folder, lock = _new_draft(place)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if lock is not None:
            os.close(lock)


def remove_folder(folder: Path) -> None:
    """Remove a folder as far as that can be, as a draft: what a killed process leaves of it is swept by the next."""
    with suppress(OSError), draft_folder(folder.parent) as draft:
        folder.rename(draft / folder.name)
    shutil.rmtree(folder, ignore_errors=True)  # where no draft can be made: on a full disk


def sweep_drafts(place: Path) -> None:
    """Remove the draft folders in ``place`` whose makers are no more."""
    with suppress(OSError):
        for folder in [entry for entry in os.scandir(place) if entry.name.startswith(DRAFT)]:
            with suppress(OSError):
                lock = locked(Path(folder.path), wait=False)
                shutil.rmtree(folder.path, ignore_errors=True)  # follows no links
                os.close(lock)


def _new_draft(place: Path) -> tuple[Path, int | None]:
    """Make a draft folder and lock it; the lock is None where the file system has none."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=DRAFT, dir=place))
        try:
            lock = locked(folder, wait=True)
        except FileNotFoundError:
            continue
        except OSError:
            return folder, None
        if folder.exists():
            return folder, lock
        os.close(lock)  # swept before it was locked


def locked(folder: Path, *, wait: bool) -> int:
    """Open a folder, lock it, and return the descriptor. Raises ``OSError``, for a link and one that others hold too.

    Processes forked meanwhile share the lock.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
