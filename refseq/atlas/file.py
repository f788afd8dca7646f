"""The ``.refseq`` file of an atlas: a map file for each sequence, and the paths through them.

A zip archive of ``atlas.json``, the sequences' map files and ``.npy`` arrays, with a checksum of every one. As with a
map, nothing in a file is ever executed or unpickled.
"""

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.atlas import Atlas, beside
from refseq.atlas.atlas import Path as Way
from refseq.atlas.similarity import check_comparable
from refseq.errors import MapError
from refseq.map.file import (
    ATLAS,
    DAMAGE,
    EPOCH,
    encode,
    guide_in,
    load_map,
    map_bytes,
    read_array,
    read_map,
    write_archive,
)
from refseq.map.sequence import ReferenceSequence

FORMAT = "refseq-atlas"
VERSION = 1
ARRAYS = ("along", "sequences", "places")


def save_atlas(atlas: Atlas, path: Path) -> None:
    """Write an atlas, replacing ``path`` in one step. Raises ``MapError`` when it cannot be written."""
    members = {f"sequences/{n}.refseq": map_bytes(sequence) for n, sequence in enumerate(atlas.sequences)}
    for number, way in enumerate(atlas.paths):
        members |= {f"paths/{number}/{name}.npy": encode(getattr(way, name)) for name in ARRAYS}
    header = {
        "format": FORMAT,
        "version": VERSION,
        "sequences": list(atlas.names),
        "paths": [way.name for way in atlas.paths],
        "guides": [way.guide.to_dict() for way in atlas.paths],
        "sha256": {name: hashlib.sha256(content).hexdigest() for name, content in members.items()},
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(zipfile.ZipInfo(ATLAS, EPOCH), json.dumps(header, indent=1))
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name, EPOCH), content)
    write_archive(path, buffer.getvalue())


def load_atlas(path: Path) -> Atlas:
    """Read an atlas, or a map of one sequence as an atlas of that one, by its file's name.

    Raises ``MapError`` for a file that is neither, is damaged, or is of another format version.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if ATLAS in archive.namelist():
                return _read(archive, path)
    except OSError as error:
        raise MapError(f"{path}: cannot be read: {error.strerror}") from error
    except DAMAGE as error:
        raise MapError(f"{path}: is not a .refseq file, or is damaged: {error}") from error
    return beside([path.stem], [load_map(path)])


def _read(archive: zipfile.ZipFile, path: Path) -> Atlas:
    header = _header(archive, path)
    digests = header["sha256"]
    try:
        sequences = [_sequence(archive, n, digests, path) for n in range(len(header["sequences"]))]
        ways = tuple(_way(archive, n, header, path) for n in range(len(header["paths"])))
        atlas = Atlas(tuple(header["sequences"]), tuple(sequences), ways)
        _check(atlas)
    except KeyError as error:
        raise MapError(f"{path}: {ATLAS} and members do not make an atlas: {error} is missing") from error
    except ValueError as error:
        raise MapError(f"{path}: {ATLAS} and members do not make an atlas: {error}") from error
    return atlas


def _header(archive: zipfile.ZipFile, path: Path) -> dict[str, Any]:
    try:
        header = json.loads(archive.read(ATLAS))
    except ValueError as error:
        raise MapError(f"{path}: is no atlas: {ATLAS} is no JSON") from error
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise MapError(f"{path}: is no atlas: {ATLAS} has no format {FORMAT!r}")
    if header.get("version") != VERSION:
        raise MapError(f"{path}: is of atlas format version {header.get('version')!r}; valid is {VERSION}: merge anew")
    for name in ("sequences", "paths"):
        if not isinstance(names := header.get(name), list) or not all(isinstance(one, str) for one in names):
            raise MapError(f"{path}: {ATLAS}: {name} is no list of names")
    digests = header.get("sha256")
    if not isinstance(digests, dict) or not all(isinstance(digest, str) for digest in digests.values()):
        raise MapError(f"{path}: {ATLAS}: sha256 is no table of checksums")
    return header


def _sequence(archive: zipfile.ZipFile, number: int, digests: Mapping[str, str], path: Path) -> ReferenceSequence:
    name = f"sequences/{number}.refseq"
    if name not in archive.namelist():
        raise ValueError(f"{name} is missing")
    content = archive.read(name)
    if hashlib.sha256(content).hexdigest() != digests[name]:
        raise MapError(f"{path}: {name} does not match its checksum: the file is damaged")
    return read_map(io.BytesIO(content), path / name)


def _way(archive: zipfile.ZipFile, number: int, header: Mapping[str, Any], path: Path) -> Way:
    stem = f"paths/{number}"
    along, sequences, places = (
        read_array(archive, f"{stem}/{array}", header["sha256"][f"{stem}/{array}.npy"], path) for array in ARRAYS
    )
    guides = header.get("guides", {})
    if guides and not (isinstance(guides, list) and number < len(guides)):
        raise ValueError("guides are no list of one a path")
    guide = guide_in({"guide": guides[number]} if guides else {}, len(along))
    return Way(header["paths"][number], _distances(along, stem), _whole(sequences, stem), _whole(places, stem), guide)


def _distances(array: NDArray[Any], stem: str) -> NDArray[np.float64]:
    if array.ndim != 1 or array.dtype.kind not in "fiu":
        raise ValueError(f"{stem} is no list of distances")
    return array.astype(np.float64)


def _whole(array: NDArray[Any], stem: str) -> NDArray[np.intp]:
    if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{stem} is no list of whole numbers")
    return array.astype(np.intp)


def _check(atlas: Atlas) -> None:
    """Raise ``ValueError`` for members that are each right but not together."""
    if not atlas.sequences or not atlas.paths:
        raise ValueError("there is no sequence or no path")
    for name, sequence in zip(atlas.names, atlas.sequences, strict=True):
        try:
            check_comparable(atlas.sequences[0], sequence)
        except MapError as error:
            raise ValueError(f"sequence {name!r}: {error}") from error
    for what, names in (("sequence", atlas.names), ("path", tuple(way.name for way in atlas.paths))):
        if twice := [name for number, name in enumerate(names) if name in names[:number]]:
            raise ValueError(f"{what} {twice[0]!r} is there twice")
    for way in atlas.paths:
        if not len(way.along) == len(way.sequences) == len(way.places) > 0:
            raise ValueError(f"path {way.name!r} has lists of unequal length")
        if not np.isfinite(way.along).all() or (np.diff(way.along) < 0).any():
            raise ValueError(f"path {way.name!r} is no list of distances that do not fall")
        if (outside := way.sequences[(way.sequences < 0) | (way.sequences >= len(atlas.sequences))]).size:
            raise ValueError(f"path {way.name!r} runs through sequence {int(outside[0])}, which is not there")
        sizes = np.array([len(sequence) for sequence in atlas.sequences])[way.sequences]
        if (outside := way.places[(way.places < 0) | (way.places >= sizes)]).size:
            raise ValueError(f"path {way.name!r} runs through place {int(outside[0])}, which is not there")
    for number, (name, sequence) in enumerate(zip(atlas.names, atlas.sequences, strict=True)):
        _check_learnt(atlas, number, name, len(sequence))


def _check_learnt(atlas: Atlas, number: int, name: str, count: int) -> None:
    """Raise ``ValueError`` where a sequence's own path does not run through its places, each once and in their order.

    Merging keeps to that: places go to ever shorter sequences, so that none comes back to one that gave it away.
    """
    own = [way.places[way.sequences == number] for way in atlas.paths if way.name == name]
    if not own:
        raise ValueError(f"sequence {name!r} has no path")
    if (missed := np.setdiff1d(np.arange(count), own[0])).size:
        raise ValueError(f"path {name!r} does not run through place {int(missed[0])} of its sequence")
    if len(own[0]) > count or (np.diff(own[0]) <= 0).any():
        raise ValueError(f"path {name!r} runs through places of its sequence more than once, or not in their order")
