"""The container of a map file: a zip archive of a JSON header and ``.npy`` arrays, with a checksum of every array.

Reading parses numbers and JSON, nothing else: nothing in a file is ever executed or unpickled.
"""

import hashlib
import io
import json
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.files import naming_writes, open_input, replace_bytes
from refseq.limits import MAP_BYTES, MAP_DIRECTORY_BYTES, MAP_HEADER_BYTES
from refseq.map.format.npy import DeclaredArray, read_declared, read_numbers

FORMAT = "refseq-map"
VERSION = 4
HEADER = "map.json"
OLD_ATLAS = "atlas.json"
"""Name in the header's place where a file of format version 3 held several maps."""
EPOCH = (1980, 1, 1, 0, 0, 0)  # zip's earliest date: the same map gives the same bytes
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, RuntimeError, EOFError, ValueError, OverflowError)
"""Errors of ``zipfile`` for bytes that make no archive; RuntimeError includes methods that it does not know."""

DIRECTORY_END = 22
"""Bytes that end a zip archive without a comment: they tell where its list of files is, and how long."""

Arrays = Mapping[str, NDArray[Any]]


def pack(header: Mapping[str, Any], arrays: Arrays) -> bytes:
    """The content of a file: the same header and arrays give the same bytes.

    Raises ``MapError`` for more than a map file may hold.
    """
    check_total(sum(array.nbytes for array in arrays.values()))
    encoded = {name: encode(array) for name, array in arrays.items()}
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in encoded.items()}
    whole = {"format": FORMAT, "version": VERSION, **header, "sha256": digests}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(HEADER, EPOCH), json.dumps(whole, indent=1))
        for name, content in encoded.items():
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", EPOCH), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def check_total(nbytes: int) -> None:
    """Raise ``MapError`` for arrays that take more than a map file may hold."""
    if nbytes > MAP_BYTES:
        raise MapError(f"its arrays take {nbytes / 2**20:.0f} MiB; valid are {MAP_BYTES / 2**20:.0f} at most")


def encode(array: NDArray[Any]) -> bytes:
    """An array as the content of a ``.npy`` file."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def write_archive(path: Path, content: bytes) -> None:
    """Replace a file in one step. Raises ``MapError`` when it cannot be written."""
    with naming_writes(path, MapError):
        replace_bytes(path, content)


class MapArchive:
    """A map file that is open: its header, the arrays that it declares, and each of them when it is asked for."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._zip = archive
        self.header = _header(archive)
        self._digests: Mapping[str, str] = self.header["sha256"]

    @cached_property
    def declared(self) -> Mapping[str, DeclaredArray]:
        """Type and shape of each array, by its name. Raises ``MapError`` where they are not those of its file."""
        found = {}
        for name in self._digests:
            with self._member(name) as file, _named(name):
                found[name] = one = read_declared(file)
                held = self._zip.getinfo(f"{name}.npy").file_size - len(one.header)
                if held != one.nbytes:
                    raise ValueError(f"it holds {held} bytes; valid are the {one.nbytes} that {one} takes")
        return found

    def read(self, name: str) -> NDArray[Any]:
        """An array that was declared. Raises ``MapError`` for a damaged one."""
        with self._member(name) as file, _named(name):
            array, digest = read_numbers(file, read_declared(file))
        if digest != self._digests[name]:
            raise MapError(f"array {name} does not match its checksum: the file is damaged")
        return array

    def _member(self, name: str) -> IO[bytes]:
        try:
            return self._zip.open(f"{name}.npy")
        except KeyError as error:
            raise MapError(f"array {name:.80} is missing") from error


@contextmanager
def open_archive(path: Path) -> Iterator[MapArchive]:
    """Open a map file. Whatever is wrong with it, now or when it is read, raises ``MapError`` that names it."""
    with _naming(str(path)), open_input(path) as file, _archive_in(file) as archive:
        yield archive


@contextmanager
def archive_of(content: bytes) -> Iterator[MapArchive]:
    """Open the content of a map file. Raises as ``open_archive`` does."""
    with _naming(f"{len(content)} bytes"), _archive_in(io.BytesIO(content)) as archive:
        yield archive


@contextmanager
def _archive_in(file: IO[bytes]) -> Iterator[MapArchive]:
    _check_directory(file)
    with zipfile.ZipFile(file) as archive:
        yield MapArchive(archive)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    """Whatever is wrong with a map becomes a ``MapError`` that names it."""
    try:
        yield
    except OSError as error:
        raise MapError(f"{what}: cannot be read: {error.strerror or error}") from error
    except MapError as error:
        raise MapError(f"{what}: {error}") from error
    except DAMAGE as error:
        raise MapError(f"{what}: is not a .refseq map, or is damaged: {error}") from error


def _check_directory(file: IO[bytes]) -> None:
    """Raise ``MapError`` for an archive that does not end as ours do, or lists far more files than a map has.

    ``zipfile`` reads the list of files into memory, as long as the last bytes say that it is.
    """
    file.seek(max(0, file.seek(0, os.SEEK_END) - DIRECTORY_END))
    end = file.read()
    if len(end) < DIRECTORY_END or not end.startswith(b"PK\5\6"):
        raise zipfile.BadZipFile("it does not end as a map does" if end else "it is empty")
    if int.from_bytes(end[12:16], "little") > MAP_DIRECTORY_BYTES:
        raise zipfile.BadZipFile(f"its list of files is longer than {MAP_DIRECTORY_BYTES} bytes")


@contextmanager
def _named(array: str) -> Iterator[None]:
    """Say which array it is that cannot be read."""
    try:
        yield
    except ValueError as error:
        raise MapError(f"array {array} is no array of numbers: {error}") from error


def _header(archive: zipfile.ZipFile) -> dict[str, Any]:
    if OLD_ATLAS in archive.namelist():
        raise MapError(f"is an atlas of map format version 3; valid is {VERSION}: learn and merge anew")
    try:
        with archive.open(HEADER) as file:
            text = file.read(MAP_HEADER_BYTES + 1)
        header = json.loads(text[: MAP_HEADER_BYTES + 1], parse_constant=_refused)
    except (KeyError, ValueError, RecursionError) as error:
        raise MapError(f"is not a .refseq map: {HEADER} is missing or no JSON") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise MapError(f"is not a .refseq map: {HEADER} has no format {FORMAT!r}")
    if header.get("version") != VERSION:
        newer = isinstance(header.get("version"), int) and header["version"] > VERSION
        remedy = "a newer refseq wrote it" if newer else "learn it anew"
        raise MapError(f"is of map format version {header.get('version')!r:.20}; valid is {VERSION}: {remedy}")
    digests = header.get("sha256")
    if not isinstance(digests, dict) or not all(isinstance(digest, str) for digest in digests.values()):
        raise MapError(f"{HEADER}: sha256 is no table of checksums")
    return header


def _refused(constant: str) -> None:
    """Raise for NaN and Infinity, which are not JSON, though Python reads them."""
    raise ValueError(f"{constant} is no number")
