"""Format 4 of the ``.refseq`` file: which header and arrays describe a map, and whether they make one.

The header holds the profile, a table for each sequence and one for each path; the arrays of the n-th of either are
named ``sequences/n/…`` and ``paths/n/…``.
"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Extractor
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.annotations import Annotations
from refseq.map.archive import Arrays
from refseq.map.extractors import make_extractor
from refseq.map.path import MapPath
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence, check_comparable
from refseq.planar import Pose

PATH_ARRAYS = ("along", "sequences", "places")

Parts = tuple[tuple[str, ...], tuple[ReferenceSequence, ...], tuple[MapPath, ...]]
"""Names of the sequences, sequences and paths: the fields of a ``Map``."""


def described(
    names: Sequence[str], sequences: Sequence[ReferenceSequence], paths: Sequence[MapPath]
) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a map."""
    header: dict[str, Any] = {
        "profile": sequences[0].profile.to_dict(),
        "sequences": [
            {
                "name": name,
                "blocks": {key: len(block) for key, block in sequence.matrix.blocks.items()},
                "metadata": dict(sequence.metadata),
            }
            for name, sequence in zip(names, sequences, strict=True)
        ],
        "paths": [{"name": path.name, "annotations": path.annotations.to_dict()} for path in paths],
    }
    arrays: dict[str, NDArray[Any]] = {}
    for number, sequence in enumerate(sequences):
        arrays |= {f"sequences/{number}/{name}": array for name, array in _arrays_of(sequence).items()}
    for number, path in enumerate(paths):
        arrays |= {f"paths/{number}/{name}": getattr(path, name) for name in PATH_ARRAYS}
    return header, arrays


def _arrays_of(sequence: ReferenceSequence) -> Arrays:
    poses = [(p.x, p.y, p.heading) if p else (math.nan,) * 3 for p in sequence.poses]
    arrays: dict[str, NDArray[Any]] = {
        "pointers": sequence.matrix.pointers,
        "places": sequence.matrix.places,
        "along": sequence.along,
        "poses": np.array(poses),
        "odometry": sequence.odometry,
    }
    for extractor in sequence.extractors:
        arrays |= {f"features/{extractor.key}/{name}": array for name, array in extractor.state().items()}
    return arrays


def read_parts(header: Mapping[str, Any], arrays: Arrays) -> Parts:
    """The parts of a map by its header and arrays. Raises ``KeyError``, ``ValueError`` and the like for none."""
    if not isinstance(header["profile"], dict):
        raise ValueError("profile is no table")
    profile = Profile.from_dict(header["profile"])
    tables = {what: _tables(header, what) for what in ("sequences", "paths")}
    names = tuple(table["name"] for table in tables["sequences"])
    sequences = tuple(
        _sequence(table, _under(f"sequences/{number}/", arrays), profile)
        for number, table in enumerate(tables["sequences"])
    )
    paths = tuple(_path(table, f"paths/{number}", arrays) for number, table in enumerate(tables["paths"]))
    _check(names, sequences, paths)
    return names, sequences, paths


def _tables(header: Mapping[str, Any], what: str) -> list[dict[str, Any]]:
    tables = header[what]
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise ValueError(f"{what} is no list of tables, at least one")
    names = [table["name"] for table in tables]
    if not all(isinstance(name, str) for name in names):
        raise ValueError(f"{what}: a name is no text")
    if twice := [name for number, name in enumerate(names) if name in names[:number]]:
        raise ValueError(f"{what}: name {twice[0]!r} is there twice")
    return tables


def _under(prefix: str, arrays: Arrays) -> Arrays:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _sequence(table: Mapping[str, Any], arrays: Arrays, profile: Profile) -> ReferenceSequence:
    for name in ("blocks", "metadata"):
        if not isinstance(table[name], dict):
            raise ValueError(f"{name} is no table")
    along = _distances(arrays["along"], "along")
    sizes = {str(key): int(size) for key, size in table["blocks"].items()}
    matrix = IncidenceMatrix.from_rows(arrays["pointers"], arrays["places"], len(along), sizes)
    extractors = tuple(_extractor(key, size, arrays, profile) for key, size in sizes.items())
    poses = tuple(None if math.isnan(row[0]) else Pose(*row) for row in arrays["poses"].tolist())
    if len(poses) != len(along):
        raise ValueError(f"{len(poses)} poses for {len(along)} places")
    metadata = {str(key): str(value) for key, value in table["metadata"].items()}
    odometry = _odometry(arrays.get("odometry", np.zeros((0, 3))), len(along))
    return ReferenceSequence(matrix, extractors, along, poses, profile, MappingProxyType(metadata), odometry)


def _odometry(array: NDArray[Any], places: int) -> NDArray[np.float64]:
    """Poses by odometry, for all places or, as maps before 0.3 have it, for none."""
    if array.shape not in ((places, 3), (0, 3)) or array.dtype.kind != "f" or not np.isfinite(array).all():
        raise ValueError(f"odometry is no table of {places} poses")
    return array.astype(np.float64)


def _extractor(key: str, size: int, arrays: Arrays, profile: Profile) -> Extractor:
    extractor = make_extractor(key, profile, _under(f"features/{key}/", arrays))
    if extractor.size != size:
        raise ValueError(f"{key} has {extractor.size} features; the matrix has {size} rows for it")
    return extractor


def _path(table: Mapping[str, Any], stem: str, arrays: Arrays) -> MapPath:
    along, sequences, places = (arrays[f"{stem}/{name}"] for name in PATH_ARRAYS)
    annotations = Annotations.from_dict(table["annotations"])
    if annotations.behaviours and len(annotations.behaviours) != len(along):
        raise ValueError(f"annotations: {len(annotations.behaviours)} behaviours for {len(along)} places")
    return MapPath(table["name"], _distances(along, stem), _whole(sequences, stem), _whole(places, stem), annotations)


def _distances(array: NDArray[Any], what: str) -> NDArray[np.float64]:
    if array.ndim != 1 or not len(array) or array.dtype.kind not in "fiu":
        raise ValueError(f"{what} is no list of distances")
    along = array.astype(np.float64)
    if not np.isfinite(along).all() or (np.diff(along) < 0).any():
        raise ValueError(f"{what} is no list of distances that do not fall")
    return along


def _whole(array: NDArray[Any], what: str) -> NDArray[np.intp]:
    if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{what} is no list of whole numbers")
    return array.astype(np.intp)


def _check(names: Sequence[str], sequences: Sequence[ReferenceSequence], paths: Sequence[MapPath]) -> None:
    """Raise ``ValueError`` for parts that are each right but not together."""
    for name, sequence in zip(names, sequences, strict=True):
        try:
            check_comparable(sequences[0], sequence)
        except MapError as error:
            raise ValueError(f"sequence {name!r}: {error}") from error
    for path in paths:
        _check_path(path, np.array([len(sequence) for sequence in sequences]))
    for number, name in enumerate(names):
        _check_own(paths, number, name, len(sequences[number]))


def _check_path(path: MapPath, sizes: NDArray[np.intp]) -> None:
    """Raise ``ValueError`` where a path runs through places that sequences of so many do not have."""
    if not len(path.along) == len(path.sequences) == len(path.places):
        raise ValueError(f"path {path.name!r} has lists of unequal length")
    if (outside := path.sequences[(path.sequences < 0) | (path.sequences >= len(sizes))]).size:
        raise ValueError(f"path {path.name!r} runs through sequence {int(outside[0])}, which is not there")
    if (outside := path.places[(path.places < 0) | (path.places >= sizes[path.sequences])]).size:
        raise ValueError(f"path {path.name!r} runs through place {int(outside[0])}, which is not there")


def _check_own(paths: Sequence[MapPath], number: int, name: str, count: int) -> None:
    """Raise ``ValueError`` where a sequence's own path does not run through its places, each once and in their order.

    Merging keeps to that: places go to ever shorter sequences, so that none comes back to one that gave it away.
    """
    own = [path.places[path.sequences == number] for path in paths if path.name == name]
    if not own:
        raise ValueError(f"sequence {name!r} has no path")
    if (missed := np.setdiff1d(np.arange(count), own[0])).size:
        raise ValueError(f"path {name!r} does not run through place {int(missed[0])} of its sequence")
    if len(own[0]) > count or (np.diff(own[0]) <= 0).any():
        raise ValueError(f"path {name!r} runs through places of its sequence more than once, or not in their order")
