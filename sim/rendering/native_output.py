"""Lines that native code prints on C's standard output, sifted.

Filament tells its warnings with ``fprintf(stdout, ...)``, past ``sys.stdout`` and into whatever a command's own output
is piped to. Descriptor 1 is not touched here: what Python, its threads and its children print goes its usual way.
"""

import contextlib
import ctypes
import functools
import os
import threading
from collections.abc import Iterator
from typing import Any

_lock = threading.Lock()


@contextlib.contextmanager
def dropping_lines(beginning: bytes) -> Iterator[None]:
    """Drop the lines with that beginning from what native code prints meanwhile; all others are printed behind.

    Costs some microseconds. Where the C library has no ``stdout`` to set, all lines are printed.
    """
    with _lock:
        _memory().enter()
    try:
        yield
    finally:
        with _lock:
            _memory().leave(beginning)


class _Memory:
    """Memory that C's standard output is led into, as long as it has any ``users``.

    glibc's manual, 'Standard Streams': ``stdout`` is a variable 'which you can set just like any other'. Memory, not a
    file: a child that is forked has a copy of its own. It is never closed, since a thread of native code may have read
    the variable and not written yet.
    """

    def __init__(self) -> None:
        self._users = 0
        self._text, self._size = ctypes.c_void_p(), ctypes.c_size_t()
        self._stream: int | None = None
        with contextlib.suppress(AttributeError, ValueError):  # another C library
            self._stdout = ctypes.c_void_p.in_dll(_libc(), "stdout")
            self._stream = _libc().open_memstream(ctypes.byref(self._text), ctypes.byref(self._size))

    def enter(self) -> None:
        """Take what is printed from now on; whoever calls holds the lock."""
        if self._stream and not self._users:
            self._terminal, self._stdout.value = self._stdout.value, self._stream
        self._users += 1

    def leave(self, dropped: bytes) -> None:
        """Print what was taken so far, but for lines that begin so; the last to leave puts the variable back."""
        self._users -= 1
        if not self._stream:
            return
        if not self._users:
            self._stdout.value = self._terminal
        text = b"".join(line for line in self._taken() if not line.startswith(dropped))
        if text:  # behind what was printed before, which may still be in the buffer
            _libc().fwrite(text, 1, len(text), self._terminal)

    def _taken(self) -> list[bytes]:
        """Lines since the last call. No other thread may write meanwhile: its text would move the memory."""
        libc = _libc()
        libc.flockfile(self._stream)
        try:
            libc.fflush(self._stream)
            lines = ctypes.string_at(self._text, self._size.value).splitlines(keepends=True)
            libc.fseek(self._stream, 0, os.SEEK_SET)
        finally:
            libc.funlockfile(self._stream)
        return lines


@functools.cache
def _memory() -> _Memory:
    return _Memory()


@functools.cache
def _libc() -> Any:
    """The C library, with the types that a pointer needs."""
    libc = ctypes.CDLL(None)
    libc.open_memstream.restype = ctypes.c_void_p
    libc.open_memstream.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    libc.fflush.argtypes = libc.flockfile.argtypes = libc.funlockfile.argtypes = [ctypes.c_void_p]
    libc.fseek.argtypes = [ctypes.c_void_p, ctypes.c_long, ctypes.c_int]
    libc.fwrite.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p]
    return libc
