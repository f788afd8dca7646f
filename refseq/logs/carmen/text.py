"""Text of a log, line by line, plain or compressed by gzip or bzip2."""

import bz2
import gzip
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from refseq.files import open_input
from refseq.limits import LINE_BYTES, MESSAGES, UNPACKED_TEXT


class CutOffError(Exception):
    """Compressed data end or are damaged."""


def is_carmen(path: Path) -> bool:
    """Tell whether a file is text that is not blank, compressed or not."""
    if not path.is_file():
        return False
    with _opened(path) as file:
        try:
            head = file.read(4096)
        except (EOFError, zlib.error, OSError):
            return False
    return b"\0" not in head and bool(head.strip())


def is_packed(head: bytes) -> bool:
    """Tell by a file's first bytes whether gzip or bzip2 compressed it."""
    return head[:2] == b"\x1f\x8b" or head[:3] == b"BZh"


def is_blank(path: Path) -> bool:
    """Tell whether a text begins with nothing but blanks; false for one that is damaged."""
    with _opened(path) as file:
        try:
            return not file.read(4096).strip()
        except (EOFError, zlib.error, OSError):
            return False


def text_lines(path: Path) -> Iterator[bytes]:
    """All lines, as they are. Raises ``CutOffError`` where compressed data end before their time."""
    unpacked, lines = UNPACKED_TEXT.of(path), MESSAGES.of(path)
    with _opened(path) as file:
        for number, text in enumerate(iter(lambda: _next_line(file), b""), 1):
            LINE_BYTES.check(len(text), f"{path}: line {number}: has")
            unpacked.add(len(text))
            lines.add(1)
            yield text


def _next_line(file: IO[bytes]) -> bytes:
    try:
        return file.readline(LINE_BYTES + 1)
    except EOFError as error:
        raise CutOffError("its compressed data end before their time") from error
    except (zlib.error, gzip.BadGzipFile) as error:
        raise CutOffError(str(error) or "compressed data end") from error
    except OSError as error:
        if error.errno is None:  # bz2 has no error of its own for damaged data
            raise CutOffError(str(error)) from error
        raise


def _opened(path: Path) -> IO[bytes]:
    """The file's text; of one that is compressed by gzip or bzip2, as its first bytes say, what it was before."""
    with open_input(path) as file:
        head = file.read(3)
    if head[:2] == b"\x1f\x8b":
        return cast(IO[bytes], gzip.open(path))
    return cast(IO[bytes], bz2.open(path)) if head == b"BZh" else path.open("rb")
