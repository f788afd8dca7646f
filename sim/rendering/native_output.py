"""Lines that native code prints on C's standard output, sifted.

Filament tells its warnings with ``fprintf(stdout, ...)``, past ``sys.stdout`` and into whatever a command's own output
is piped to. Descriptor 1 is not touched here: what Python, its threads and its children print goes its usual way.
"""

import contextlib
import ctypes
import functools
import threading
from collections.abc import Iterator
from typing import Any

_lock = threading.Lock()
_open: list["_Captured"] = []
"""The capture that is under way, with the number of those who asked for it: C has one standard output a process."""


@contextlib.contextmanager
def dropping_lines(beginning: bytes) -> Iterator[None]:
    """Drop the lines with that beginning from what native code prints meanwhile; all others are printed behind.

    Costs some microseconds. Where the C library has no ``stdout`` to set, all lines are printed.
    """
    with _lock:
        if not _open:
            _open.append(_Captured())
        captured = _open[0]
        captured.users += 1
    try:
        yield
    finally:
        with _lock:
            captured.users -= 1
            if not captured.users:
                _open.clear()
            lines = captured.taken(ended=not captured.users)
        _print([line for line in lines if not line.startswith(beginning)])


class _Captured:
    """C's standard output, led into memory.

    glibc's manual, 'Standard Streams': ``stdout`` is a variable 'which you can set just like any other'. Memory, not a
    file: a child that is forked has a copy of its own.
    """

    def __init__(self) -> None:
        self.users = 0
        self._text, self._size = ctypes.c_void_p(), ctypes.c_size_t()
        self._read = 0
        self._stream: int | None = None
        with contextlib.suppress(AttributeError, ValueError):  # another C library
            self._stdout = ctypes.c_void_p.in_dll(_libc(), "stdout")
            self._stream = _libc().open_memstream(ctypes.byref(self._text), ctypes.byref(self._size))
            if self._stream:
                self._before, self._stdout.value = self._stdout.value, self._stream

    def taken(self, *, ended: bool) -> list[bytes]:
        """Lines since the last call; ``ended`` puts C's standard output back."""
        if not self._stream:
            return []
        if ended:
            self._stdout.value = self._before
        _libc().fflush(self._stream)
        size = self._size.value
        new = ctypes.string_at((self._text.value or 0) + self._read, size - self._read) if size > self._read else b""
        self._read = size
        if ended:
            _libc().fclose(self._stream)
            _libc().free(self._text)
        return new.splitlines(keepends=True)


def _print(lines: list[bytes]) -> None:
    """Print on C's standard output, in whose buffer what was printed before may still be."""
    if lines:
        text, libc = b"".join(lines), _libc()
        libc.fwrite(text, 1, len(text), ctypes.c_void_p.in_dll(libc, "stdout"))


@functools.cache
def _libc() -> Any:
    """The C library, with the types that a pointer needs."""
    libc = ctypes.CDLL(None)
    libc.open_memstream.restype = ctypes.c_void_p
    libc.open_memstream.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    libc.fflush.argtypes = libc.fclose.argtypes = libc.free.argtypes = [ctypes.c_void_p]
    libc.fwrite.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p]
    return libc
