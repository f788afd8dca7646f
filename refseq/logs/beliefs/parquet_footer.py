"""Sizes that a Parquet file declares, read from its footer before any of it is.

pyarrow has them too, but asks for a column's in a way that ends the whole process where that column's statistics do
not fit each other: C++ throws and nobody catches. So the footer, a struct in Thrift's compact protocol, is read here;
``num_values`` and ``total_uncompressed_size`` are fields 5 and 6 of a column's ``meta_data`` in Parquet's own
definition (github.com/apache/parquet-format).
"""

import os
import struct
from typing import IO, Any

from refseq.errors import LogError
from refseq.limits import PARQUET_FOOTER_BYTES

MAGIC = b"PAR1"
ROW_GROUPS, COLUMNS, META_DATA, NUM_VALUES, UNCOMPRESSED = 4, 1, 3, 5, 6
DEEPEST = 16
"""A footer's structs lie in each other at most half so deep."""


def declared_sizes(file: IO[bytes], what: str) -> list[tuple[int, int]]:
    """Number of values, and bytes unpacked, of each column of each row group.

    The file is at its start afterwards. Raises ``LogError``, which begins with ``what``, for a footer that is none, is
    damaged, or is larger than any.
    """
    try:
        found = _Compact(_footer(file, what)).struct()
        chunks = [column[META_DATA] for group in found[ROW_GROUPS] for column in group[COLUMNS]]
        sizes = [(int(chunk[NUM_VALUES]), int(chunk[UNCOMPRESSED])) for chunk in chunks]
    except (KeyError, TypeError, IndexError, ValueError, struct.error) as error:
        raise LogError(f"{what}: its footer is damaged") from error
    if any(size < 0 for pair in sizes for size in pair):
        raise LogError(f"{what}: its footer declares a size below 0")
    file.seek(0)
    return sizes


def _footer(file: IO[bytes], what: str) -> bytes:
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - 8))
    length, magic = struct.unpack("<I4s", file.read(8).rjust(8))
    if magic != MAGIC or length > size - 8:
        raise LogError(f"{what}: it has no footer of a Parquet file")
    PARQUET_FOOTER_BYTES.check(length, f"{what}: its footer has")
    file.seek(size - 8 - length)
    return file.read(length)


class _Compact:
    """Values of Thrift's compact protocol; a struct is a dictionary by its fields' numbers."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at, self._depth = data, 0, 0

    def struct(self) -> dict[int, Any]:
        """A struct up to its stop."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError("nested too deep")
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._zigzag()
            fields[number] = self._value(head & 0x0F)
        self._depth -= 1
        return fields

    def _value(self, kind: int) -> Any:
        """A field's value; true and false are kinds of their own."""
        if kind in (1, 2):
            return kind == 1
        if kind in (4, 5, 6):
            return self._zigzag()
        if kind in (9, 10):
            return self._list()
        if kind == 12:
            return self.struct()
        lengths = {3: lambda: 1, 7: lambda: 8, 8: self._varint}
        if kind not in lengths:
            raise ValueError(f"kind {kind}, of which a footer has none")
        return self._bytes(lengths[kind]())

    def _list(self) -> list[Any]:
        head = self._byte()
        count = head >> 4 if head >> 4 < 15 else self._varint()
        kind = head & 0x0F
        return [self._byte() == 1 if kind in (1, 2) else self._value(kind) for _ in range(count)]

    def _bytes(self, length: int) -> bytes:
        if length > len(self._data) - self._at:
            raise IndexError("longer than the footer")
        self._at += length
        return self._data[self._at - length : self._at]

    def _byte(self) -> int:
        self._at += 1
        return self._data[self._at - 1]

    def _varint(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
            if shift > 63:
                raise ValueError("a number of more than 64 bits")

    def _zigzag(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)
