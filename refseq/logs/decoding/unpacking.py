"""Unpacking within a bound, and one translation of whatever a library raises for bytes that it cannot read."""

import bz2
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, cast

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from refseq.errors import RefseqError
from refseq.files import open_input
from refseq.limits import CHUNK_BYTES

LONGEST_REASON = 200
"""Characters of a library's own words that are passed on."""


@contextmanager
def translating(refused: Callable[[str], Exception], *told: type[Exception]) -> Iterator[None]:
    """Raise what a library raises for damaged bytes as ``refused`` of its words in one line.

    Libraries raise nearly anything for bytes that nobody has written, ``MemoryError`` and ``RecursionError`` among it:
    so nothing is left out but the errors of this package and those that are ``told`` already.
    """
    try:
        yield
    except Exception as error:
        if isinstance(error, (RefseqError, *told)):
            raise
        words = f"it names {error}, which it does not hold" if isinstance(error, KeyError) else str(error)
        raise refused(" ".join(words.split())[:LONGEST_REASON] or type(error).__name__) from error


class WholeReads(io.BufferedReader):
    """A file that raises ``EOFError`` where more is asked of it than it has; libraries ask for what a file declares."""

    def __init__(self, path: Path) -> None:
        opened = open_input(path)
        super().__init__(cast(io.BufferedReader, opened).detach())
        self._size = path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        """Exactly ``size`` bytes, or all that are left. The memory for them is taken only if they are there."""
        left = self._size - self.tell()
        count = left if size is None or size < 0 else size
        if count > left:
            raise EOFError("unexpected end of file")
        return super().read(count)


def unpack_zstd(data: bytes, most: int = CHUNK_BYTES) -> bytes:
    """Unpack a Zstandard frame. Raises ``ValueError`` beyond ``most`` bytes, whatever its head declares."""
    with zstandard.ZstdDecompressor(max_window_size=CHUNK_BYTES).stream_reader(data) as stream:
        return _bounded(_read(stream, most + 1), most)


def unpack_bz2(data: bytes, most: int = CHUNK_BYTES) -> bytes:
    """Unpack a bzip2 stream. Raises ``ValueError`` beyond ``most`` bytes."""
    return _bounded(bz2.BZ2Decompressor().decompress(data, most + 1), most)


def unpack_lz4(data: bytes, most: int = CHUNK_BYTES) -> bytes:
    """Unpack an LZ4 frame. Raises ``ValueError`` beyond ``most`` bytes."""
    unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, most + 1)
    return _bounded(unpacked, most)


def _read(stream: IO[bytes], most: int) -> bytes:
    """As ``stream.read``, piece by piece: it would take the memory for all that may come."""
    pieces = []
    while most > 0 and (piece := stream.read(min(most, 1 << 20))):
        pieces.append(piece)
        most -= len(piece)
    return b"".join(pieces)


def _bounded(unpacked: bytes, most: int) -> bytes:
    if len(unpacked) > most:
        raise ValueError(f"it unpacks to more than {most} bytes")
    return unpacked
