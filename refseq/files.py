"""Files at the door: opened only if they are files, and replaced in one step, so that none is met half-written.

Content is on the disk before a file gets its name.
"""

import ctypes
import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import IO

from refseq.drafts import draft_folder
from refseq.errors import RefseqError

AT_FDCWD, RENAME_EXCHANGE = -100, 2
"""Of Linux: paths are from the working directory; two names change their places."""


def open_input(path: Path) -> IO[bytes]:
    """Open a file for reading. Raises ``OSError`` for what is none: a folder, a pipe that nobody writes to, a device.

    A symbolic link is followed: whoever names it may read what it leads to.
    """
    # Opening a pipe waits for its other end unless told not to; for a file it makes no difference.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _check_mode(os.fstat(descriptor).st_mode, path)
    except OSError:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def check_input(path: Path) -> None:
    """Raise ``OSError`` as ``open_input`` does, for libraries that open a file themselves."""
    _check_mode(path.stat().st_mode, path)


def _check_mode(mode: int, path: Path) -> None:
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, f"is {_KINDS.get(stat.S_IFMT(mode), 'no file')}; valid is a file", str(path))


_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def followed(path: Path) -> Path:
    """The place of what is written to ``path``: there, or where a symbolic link leads to, be something there or not.

    Raises ``OSError`` for links that lead in a circle, and for one that another user has laid in a folder for all, as
    /tmp is: it may lead to a file of ours.
    """
    if not path.is_symlink():
        return path
    folder, for_all = path.parent.stat(), stat.S_ISVTX | stat.S_IWOTH
    if folder.st_mode & for_all == for_all and path.lstat().st_uid not in (os.geteuid(), folder.st_uid):
        reason = "is another user's link in a folder for all; valid is another name"
        raise PermissionError(errno.EACCES, reason, str(path))
    with suppress(FileNotFoundError):
        path.stat()  # raises for a circle, in which ``resolve`` stops somewhere
    return path.resolve()


@contextmanager
def replacing_at(path: Path) -> Iterator[Path]:
    """A file's name that becomes ``path`` when the block ends well; otherwise ``path`` stays as it was.

    It is called like ``path``, for libraries that open the file themselves. A ``path`` that is a link stays one: what
    it leads to is replaced.
    """
    target = followed(path)
    with draft_folder(target.parent) as folder:
        draft = folder / path.name
        yield draft
        put(draft, target)


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A binary file that becomes ``path`` when the block ends well; otherwise ``path`` stays as it was."""
    with replacing_at(path) as draft, draft.open("xb") as file:
        yield file


@contextmanager
def naming_writes(path: Path | str, error: type[RefseqError], *riddles: type[Exception]) -> Iterator[None]:
    """Tell an ``OSError`` of the block as a package's own ``error``, which names the ``path``, not its draft.

    ``riddles`` are errors of a library that may stand for a full disk, of which they do not tell.
    """
    failures: tuple[type[Exception], ...] = (OSError, *riddles)
    try:
        yield
    except failures as met:
        reason = met.strerror if isinstance(met, OSError) else None
        asked = "" if reason else " (is the disk full?)"
        raise error(f"{path}: cannot be written{asked}: {reason or met}") from met


def replace_bytes(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path`` in one step."""
    with replacing(path) as file:
        file.write(content)


def replace_text(path: Path, content: str) -> None:
    """Write ``content`` to ``path`` as UTF-8 in one step."""
    replace_bytes(path, content.encode())


def put(draft: Path, path: Path) -> None:
    """Give a finished file the name ``path``, in place of an older one, with its content on the disk before.

    Raises ``OSError`` where something else than a file has that name: who may, would replace a device as well.
    """
    if path.exists():
        check_input(path)
    sync(draft)
    draft.replace(path)
    sync(path.parent)


def put_folder(draft: Path, path: Path) -> None:
    """Give a finished folder of files the name ``path``; an older one then lies at ``draft``.

    It happens in one step where the file system can let two names change places, else in two. Raises ``OSError`` where
    something else than a folder has that name.
    """
    if path.exists() and not path.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
    for one in (*draft.iterdir(), draft):
        sync(one)
    if not path.exists():
        draft.rename(path)
    elif not _exchanged(draft, path):
        older = draft.with_name(f"{draft.name}.older")
        path.rename(older)
        try:
            draft.rename(path)
        except OSError:
            older.rename(path)
            raise
        older.rename(draft)
    sync(path.parent)


def _exchanged(one: Path, other: Path) -> bool:
    """Let two names change places; false where the system or the file system cannot."""
    rename = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if rename is None:
        return False
    if rename(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in (errno.ENOSYS, errno.EINVAL):
        return False
    raise OSError(code, os.strerror(code), str(other))


def sync(path: Path) -> None:
    """Have the content of a file, or the names in a folder, written to the disk. Raises ``OSError``."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if not path.is_dir() or error.errno not in (errno.EINVAL, errno.ENOTSUP):  # some file systems sync no folders
            raise
    finally:
        os.close(descriptor)


def free_names(path: Path) -> Iterator[Path]:
    """Names for what is to lie beside all else: ``path``, then ``…-2``, ``…-3`` before its ending.

    To be tried in turn by what fails where something lies, a link for one.
    """
    yield path
    yield from (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
