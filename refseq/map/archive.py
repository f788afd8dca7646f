"""The container of a map file: a zip archive of a JSON header and ``.npy`` arrays, with a checksum of every array.

Reading parses numbers and JSON, nothing else: nothing in a file is ever executed or unpickled.
"""

import hashlib
import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.files import replace_bytes

FORMAT = "refseq-map"
VERSION = 4
HEADER = "map.json"
OLD_ATLAS = "atlas.json"
"""Name in the header's place where a file of format version 3 held several maps."""
EPOCH = (1980, 1, 1, 0, 0, 0)  # zip's earliest date: the same map gives the same bytes
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, RuntimeError, EOFError, ValueError, OverflowError)
"""Errors of ``zipfile`` for bytes that make no archive; RuntimeError includes methods that it does not know."""

Arrays = Mapping[str, NDArray[Any]]


def pack(header: Mapping[str, Any], arrays: Arrays) -> bytes:
    """The content of a file: the same header and arrays give the same bytes."""
    encoded = {name: encode(array) for name, array in arrays.items()}
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in encoded.items()}
    whole = {"format": FORMAT, "version": VERSION, **header, "sha256": digests}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(HEADER, EPOCH), json.dumps(whole, indent=1))
        for name, content in encoded.items():
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", EPOCH), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def encode(array: NDArray[Any]) -> bytes:
    """An array as the content of a ``.npy`` file."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def write_archive(path: Path, content: bytes) -> None:
    """Replace a file in one step. Raises ``MapError`` when it cannot be written."""
    try:
        replace_bytes(path, content)
    except OSError as error:
        raise MapError(f"{path}: cannot be written: {error.strerror}") from error


def unpack(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a file. Raises ``MapError`` for one that is none, is damaged, or is of another version."""
    try:
        with zipfile.ZipFile(path) as archive:
            header = _header(archive, path)
            return header, {name: _array(archive, name, digest, path) for name, digest in header["sha256"].items()}
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    except DAMAGE as error:
        raise MapError(f"{path}: is not a .refseq map, or is damaged: {error}") from error


def _header(archive: zipfile.ZipFile, path: Path) -> dict[str, Any]:
    if OLD_ATLAS in archive.namelist():
        raise MapError(f"{path}: is an atlas of map format version 3; valid is {VERSION}: learn and merge anew")
    try:
        header = json.loads(archive.read(HEADER))
    except (KeyError, ValueError) as error:
        raise MapError(f"{path}: is not a .refseq map: {HEADER} is missing or no JSON") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise MapError(f"{path}: is not a .refseq map: {HEADER} has no format {FORMAT!r}")
    if header.get("version") != VERSION:
        raise MapError(f"{path}: is of map format version {header.get('version')!r}; valid is {VERSION}: learn it anew")
    digests = header.get("sha256")
    if not isinstance(digests, dict) or not all(isinstance(digest, str) for digest in digests.values()):
        raise MapError(f"{path}: {HEADER}: sha256 is no table of checksums")
    return header


def _array(archive: zipfile.ZipFile, name: str, digest: str, path: Path) -> NDArray[Any]:
    """An array of an archive. Raises ``MapError`` where it is missing, damaged, or not of numbers."""
    try:
        content = archive.read(f"{name}.npy")
    except KeyError as error:
        raise MapError(f"{path}: array {name} is missing") from error
    if hashlib.sha256(content).hexdigest() != digest:
        raise MapError(f"{path}: array {name} does not match its checksum: the file is damaged")
    try:
        array: NDArray[Any] = np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    except ValueError as error:
        raise MapError(f"{path}: array {name} is no array of numbers: {error}") from error
    return array
