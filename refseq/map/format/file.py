"""Format 4 of the ``.refseq`` file: which header and arrays describe a map, and whether they make one.

The header holds the profile, a table for each sequence and one for each path; the arrays of the n-th of either are
named ``sequences/n/…`` and ``paths/n/…``.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import Extractor
from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.map.extractors import make_extractor
from refseq.map.format.archive import HEADER, Arrays, MapArchive, check_total
from refseq.map.format.header import MapHeader, PathTable, SequenceTable, parse_header
from refseq.map.format.layout import check_declared, check_values, rules_of
from refseq.map.growth.experiences import Experiences
from refseq.map.growth.record import NOT_GROWN, GrowthRecord
from refseq.map.merge_record import MergeRecord
from refseq.map.paths.keys import PathKeys
from refseq.map.paths.path import MapPath
from refseq.map.profile import Profile
from refseq.map.sequence import ReferenceSequence, check_comparable
from refseq.planar import Pose

SPOILT = f"{HEADER} and arrays do not make a map"
PATH_ARRAYS = ("along", "sequences", "places")
PATH_KNOWN = ("odometry", "poses", "scans", "times", "loops")

KEYS, KEY_ARRAYS = "keys/", ("counts", "points", "packed")
EXPERIENCES = "experiences/"

Parts = tuple[tuple[str, ...], tuple[ReferenceSequence, ...], tuple[MapPath, ...], MergeRecord, GrowthRecord]
"""Names of the sequences, sequences, paths, and the records of a merging and of growth: the fields of a ``Map``."""


def described(
    names: Sequence[str],
    sequences: Sequence[ReferenceSequence],
    paths: Sequence[MapPath],
    record: MergeRecord,
    grown: GrowthRecord = NOT_GROWN,
) -> tuple[dict[str, Any], Arrays]:
    """Header and arrays of a map."""
    header: dict[str, Any] = {
        "profile": sequences[0].profile.to_dict(),
        "sequences": [
            {
                "name": name,
                "blocks": {key: len(block) for key, block in sequence.matrix.blocks.items()},
                "metadata": {str(key): str(value) for key, value in sequence.metadata.items()},
            }
            for name, sequence in zip(names, sequences, strict=True)
        ],
        "paths": [{"name": path.name, "annotations": path.annotations.to_dict()} for path in paths],
    }
    if record != MergeRecord():
        header["merged"] = record.to_dict()
    if grown != NOT_GROWN:
        header["grown"] = grown.to_dict()
    arrays: dict[str, NDArray[Any]] = {}
    for number, sequence in enumerate(sequences):
        arrays |= {f"sequences/{number}/{name}": array for name, array in _arrays_of(sequence).items()}
    for number, path in enumerate(paths):
        arrays |= {f"paths/{number}/{name}": getattr(path, name) for name in PATH_ARRAYS}
        known = {name: getattr(path, name) for name in PATH_KNOWN}
        arrays |= {f"paths/{number}/{name}": array for name, array in known.items() if len(array)}
        for camera, its in path.keys.items():
            arrays |= {f"paths/{number}/{KEYS}{camera}/{name}": getattr(its, name) for name in KEY_ARRAYS}
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
    if (its := sequence.experiences) is not None:
        arrays |= {f"{EXPERIENCES}pointers": its.matrix.pointers, f"{EXPERIENCES}entries": its.matrix.places}
        arrays |= {f"{EXPERIENCES}places": its.places, f"{EXPERIENCES}uses": its.uses}
    return arrays


def read_parts(archive: MapArchive) -> Parts:
    """The parts of a map by its open file. Raises ``MapError`` in one line where they make none."""
    try:
        header = parse_header(archive.header)
        rules = rules_of(header)
        check_declared(rules, archive.declared)
        check_total(sum(array.nbytes for array in archive.declared.values()))
        arrays = {name: archive.read(name) for name in archive.declared}
        for name, array in arrays.items():
            check_values(name, rules[name][0], array)
        return _parts(header, arrays)
    except KeyError as error:
        raise MapError(f"{SPOILT}: {error} is missing") from error
    except (ValueError, OverflowError) as error:
        raise MapError(f"{SPOILT}: {error}") from error


def _parts(header: MapHeader, arrays: Arrays) -> Parts:
    names = tuple(table.name for table in header.sequences)
    sequences = tuple(
        _sequence(table, _under(f"sequences/{number}/", arrays), header.profile)
        for number, table in enumerate(header.sequences)
    )
    paths = tuple(_path(table, _under(f"paths/{number}/", arrays)) for number, table in enumerate(header.paths))
    _check(names, sequences, paths)
    return names, sequences, paths, header.merged, header.grown


def _under(prefix: str, arrays: Arrays) -> Arrays:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _sequence(table: SequenceTable, arrays: Arrays, profile: Profile) -> ReferenceSequence:
    along = arrays["along"]
    _check_rising(along, f"sequence {table.name!r}")
    matrix = IncidenceMatrix.from_rows(arrays["pointers"], arrays["places"], len(along), table.blocks)
    extractors = tuple(_extractor(key, size, arrays, profile) for key, size in table.blocks.items())
    poses = tuple(None if math.isnan(row[0]) else Pose(*row) for row in arrays["poses"].tolist())
    odometry = arrays.get("odometry", np.zeros((0, 3)))
    experiences = _experiences(table, _under(EXPERIENCES, arrays), len(along))
    return ReferenceSequence(matrix, extractors, along, poses, profile, table.metadata, odometry, experiences)


def _experiences(table: SequenceTable, arrays: Arrays, count: int) -> Experiences | None:
    """Further experiences of a sequence of ``count`` places; None where the file has none of their arrays."""
    if not arrays:
        return None
    places, uses = (arrays[name].astype(np.intp, copy=False) for name in ("places", "uses"))
    if (outside := places[places >= count]).size:
        raise ValueError(f"sequence {table.name!r}: an experience is of place {int(outside[0])}, which is not there")
    matrix = IncidenceMatrix.from_rows(arrays["pointers"], arrays["entries"], len(places), table.blocks)
    return Experiences(matrix, places, uses)


def _extractor(key: str, size: int, arrays: Arrays, profile: Profile) -> Extractor:
    extractor = make_extractor(key, profile, _under(f"features/{key}/", arrays))
    if extractor.size != size:
        raise ValueError(f"{key} has {extractor.size} features; the matrix has {size} rows for it")
    return extractor


def _path(table: PathTable, arrays: Arrays) -> MapPath:
    along, annotations = arrays["along"], table.annotations
    _check_rising(along, f"path {table.name!r}")
    if annotations.behaviours and len(annotations.behaviours) != len(along):
        raise ValueError(f"annotations: {len(annotations.behaviours)} behaviours for {len(along)} places")
    sequences, places = (arrays[name].astype(np.intp, copy=False) for name in ("sequences", "places"))
    known = {name: arrays[name] for name in PATH_KNOWN if name in arrays}
    keys = _keys(table, _under(KEYS, arrays))
    return MapPath(table.name, along, sequences, places, annotations, **known, keys=keys)


def _keys(table: PathTable, arrays: Arrays) -> dict[str, PathKeys]:
    """Keys of a path's views, by camera."""
    found = {}
    for camera in sorted({name.rpartition("/")[0] for name in arrays}):
        its = PathKeys(*(arrays[f"{camera}/{name}"] for name in KEY_ARRAYS))
        if (count := int(its.counts.sum())) != len(its.points):
            raise ValueError(f"path {table.name!r}: {camera} has {len(its.points)} keys; its counts make {count}")
        found[camera] = its
    return found


def _check_rising(along: NDArray[np.float64], what: str) -> None:
    if not len(along) or (np.diff(along) < 0).any():
        raise ValueError(f"{what}: along is no list of distances that do not fall, at least one")


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
    if (outside := path.sequences[(path.sequences < 0) | (path.sequences >= len(sizes))]).size:
        raise ValueError(f"path {path.name!r} runs through sequence {int(outside[0])}, which is not there")
    if (outside := path.places[(path.places < 0) | (path.places >= sizes[path.sequences])]).size:
        raise ValueError(f"path {path.name!r} runs through place {int(outside[0])}, which is not there")
    if (wrong := path.loops[(path.loops[:, 0] >= path.loops[:, 1]) | (path.loops[:, 1] >= len(path))]).size:
        first, second = wrong[0].tolist()
        raise ValueError(
            f"path {path.name!r} comes back to view {first} at view {second}; valid is an earlier and a later view of "
            f"its {len(path)}"
        )


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
