"""The ``.refseq`` file: one reference sequence, with a format version and a checksum of every array.

A zip archive of ``map.json`` and ``.npy`` arrays. Reading parses numbers and JSON, nothing else: nothing in a file is
ever executed or unpickled.
"""

import hashlib
import io
import json
import math
import struct
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import make_extractor
from refseq.files import replace_bytes
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.annotations import Guide
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence
from refseq.planar import Pose

FORMAT = "refseq-map"
VERSION = 3
HEADER = "map.json"
ATLAS = "atlas.json"
"""What takes the header's place in an atlas."""
EPOCH = (1980, 1, 1, 0, 0, 0)  # zip's earliest date: the same map gives the same bytes
DAMAGE = (zipfile.BadZipFile, zlib.error, struct.error, RuntimeError, EOFError, ValueError, OverflowError)
"""What ``zipfile`` raises for bytes that make no archive; RuntimeError includes methods that it does not know."""


def save_map(sequence: ReferenceSequence, path: Path) -> None:
    """Write a map, replacing ``path`` in one step. Raises ``MapError`` when it cannot be written."""
    write_archive(path, map_bytes(sequence))


def write_archive(path: Path, content: bytes) -> None:
    """Replace a file in one step. Raises ``MapError`` when it cannot be written."""
    try:
        replace_bytes(path, content)
    except OSError as error:
        raise MapError(f"{path}: cannot be written: {error.strerror}") from error


def map_bytes(sequence: ReferenceSequence) -> bytes:
    """A map as the content of its file: the same map gives the same bytes."""
    arrays = _arrays(sequence)
    encoded = {name: encode(array) for name, array in arrays.items()}
    header = {
        "format": FORMAT,
        "version": VERSION,
        "profile": sequence.profile.to_dict(),
        "blocks": {key: len(block) for key, block in sequence.matrix.blocks.items()},
        "metadata": dict(sequence.metadata),
        "guide": sequence.guide.to_dict(),
        "sha256": {name: hashlib.sha256(content).hexdigest() for name, content in encoded.items()},
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(HEADER, EPOCH), json.dumps(header, indent=1))
        for name, content in encoded.items():
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", EPOCH), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def _arrays(sequence: ReferenceSequence) -> dict[str, NDArray[Any]]:
    poses = [(p.x, p.y, p.heading) if p else (math.nan,) * 3 for p in sequence.poses]
    arrays: dict[str, NDArray[Any]] = {
        "pointers": sequence.matrix.pointers,
        "places": sequence.matrix.places,
        "along": sequence.along,
        "poses": np.array(poses),
    }
    for extractor in sequence.extractors:
        arrays |= {f"features/{extractor.key}/{name}": array for name, array in extractor.state().items()}
    return arrays


def encode(array: NDArray[Any]) -> bytes:
    """An array as the content of a ``.npy`` file."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.ascontiguousarray(array), allow_pickle=False)
    return buffer.getvalue()


def load_map(path: Path) -> ReferenceSequence:
    """Read a map. Raises ``MapError`` for a file that is none, is damaged, or is of another format version."""
    return read_map(path, path)


def read_map(file: Path | io.BytesIO, path: Path) -> ReferenceSequence:
    """Read a map from a file, or from the content of one; ``path`` is where errors say that it is."""
    try:
        with zipfile.ZipFile(file) as archive:
            header = _header(archive, path)
            arrays = {name: read_array(archive, name, digest, path) for name, digest in header["sha256"].items()}
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    except DAMAGE as error:
        raise MapError(f"{path}: is not a .refseq map, or is damaged: {error}") from error
    try:
        return _sequence(header, arrays)
    except KeyError as error:
        raise MapError(f"{path}: {HEADER} and arrays do not make a map: {error} is missing") from error
    except (ValueError, TypeError, IndexError, MapError) as error:
        raise MapError(f"{path}: {HEADER} and arrays do not make a map: {error}") from error


def _header(archive: zipfile.ZipFile, path: Path) -> dict[str, Any]:
    if ATLAS in archive.namelist():
        raise MapError(f"{path}: is an atlas of several sequences; valid is a map of one")
    try:
        header = json.loads(archive.read(HEADER))
    except (KeyError, ValueError) as error:
        raise MapError(f"{path}: is not a .refseq map: {HEADER} is missing or no JSON") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise MapError(f"{path}: is not a .refseq map: {HEADER} has no format {FORMAT!r}")
    if header.get("version") != VERSION:
        raise MapError(f"{path}: is of map format version {header.get('version')!r}; valid is {VERSION}: learn it anew")
    for name in ("profile", "blocks", "metadata"):
        if not isinstance(header.get(name), dict):
            raise MapError(f"{path}: {HEADER}: {name} is no table")
    digests = header.get("sha256")
    if not isinstance(digests, dict) or not all(isinstance(digest, str) for digest in digests.values()):
        raise MapError(f"{path}: {HEADER}: sha256 is no table of checksums")
    return header


def read_array(archive: zipfile.ZipFile, name: str, digest: str, path: Path) -> NDArray[Any]:
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


def _sequence(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> ReferenceSequence:
    profile = Profile.from_dict(header["profile"])
    along = np.asarray(arrays["along"], np.float64)
    if along.ndim != 1 or not len(along) or not np.isfinite(along).all() or (np.diff(along) < 0).any():
        raise ValueError("along is no list of distances that do not fall")
    sizes = {str(key): int(size) for key, size in header["blocks"].items()}
    matrix = IncidenceMatrix.from_rows(arrays["pointers"], arrays["places"], len(along), sizes)
    extractors = []
    for key, size in sizes.items():
        prefix = f"features/{key}/"
        state = {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
        extractor = make_extractor(key, profile, state)
        if extractor.size != size:
            raise ValueError(f"{key} has {extractor.size} features; the matrix has {size} rows for it")
        extractors.append(extractor)
    poses = tuple(None if math.isnan(row[0]) else Pose(*row) for row in arrays["poses"].tolist())
    if len(poses) != len(along):
        raise ValueError(f"{len(poses)} poses for {len(along)} places")
    metadata = {str(key): str(value) for key, value in header["metadata"].items()}
    guide = guide_in(header, len(along))
    return ReferenceSequence(matrix, tuple(extractors), along, poses, profile, MappingProxyType(metadata), guide)


def guide_in(table: Mapping[str, Any], places: int) -> Guide:
    """The guide of a path of so many places; maps from before there were guides have none. Raises ``ValueError``."""
    guide = Guide.from_dict(table["guide"]) if "guide" in table else Guide()
    if guide.behaviours and len(guide.behaviours) != places:
        raise ValueError(f"guide: {len(guide.behaviours)} behaviours for {places} places")
    return guide
