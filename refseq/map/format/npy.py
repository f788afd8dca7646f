"""Arrays in the ``.npy`` format: their declared type and shape first, their numbers only when these were found right.

Only the header that NumPy writes for plain numbers in C order is read, by its text: nothing is evaluated.
"""

import math
import re
from dataclasses import dataclass
from hashlib import sha256
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\x93NUMPY\x01\x00"
"""Begins a file of version 1.0, in which NumPy writes all arrays whose header is shorter than 64 KiB."""
_HEADER = re.compile(
    rb"\{'descr': '([<|][a-zA-Z][0-9]{1,2})', 'fortran_order': False, "
    rb"'shape': \(((?:[0-9]{1,18}, ?)*(?:[0-9]{1,18})?)\), \} *\n"
)
_BLOCK = 1 << 20
"""Bytes that are unpacked at once."""


@dataclass(frozen=True, slots=True)
class DeclaredArray:
    """An array by the ``header`` of its file (bytes): the ``type`` of its numbers, as ``f8``, and its ``shape``."""

    header: bytes
    type: str
    shape: tuple[int, ...]

    @property
    def nbytes(self) -> int:
        """Size of its numbers [bytes]."""
        return math.prod(self.shape) * int(self.type[1:])

    def __str__(self) -> str:
        return f"{self.type} of shape {self.shape}"


def read_declared(file: IO[bytes]) -> DeclaredArray:
    """Read the header of a ``.npy`` file. Raises ``ValueError`` for one that is no array of plain numbers."""
    start = file.read(len(MAGIC) + 2)
    if not start.startswith(MAGIC) or len(start) < len(MAGIC) + 2:
        raise ValueError("it does not begin as an .npy file of version 1.0")
    text = file.read(int.from_bytes(start[-2:], "little"))
    found = _HEADER.fullmatch(text)
    if found is None:
        raise ValueError(f"its header is {text.rstrip()!r:.80}; valid is one of plain numbers in C order")
    shape = tuple(int(one) for one in found[2].replace(b",", b" ").split())
    return DeclaredArray(start + text, found[1][1:].decode(), shape)


def read_numbers(file: IO[bytes], declared: DeclaredArray) -> tuple[NDArray[Any], str]:
    """Read the numbers behind a header, and the SHA-256 of header and numbers in hexadecimal digits.

    Raises ``ValueError`` where there are fewer or more bytes than the header tells.
    """
    array = np.empty(declared.shape, f"<{declared.type}")
    digest = sha256(declared.header)
    into, at = array.reshape(-1).view(np.uint8), 0
    while block := file.read(_BLOCK):
        if at + len(block) > len(into):
            raise ValueError(f"it holds more bytes than {declared} takes")
        into[at : at + len(block)] = np.frombuffer(block, np.uint8)
        digest.update(block)
        at += len(block)
    if at < len(into):
        raise ValueError(f"it holds {at} bytes of the {len(into)} that {declared} takes")
    return array, digest.hexdigest()
