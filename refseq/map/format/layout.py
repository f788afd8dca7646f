"""Arrays of a map file as a declared table: type, shape and values of each, checked before any is unpacked.

A size in a shape is a number, or a name that means the same number wherever it stands for one sequence or path: ``K``
places, ``N1`` the features and one more, ``E`` entries of the incidence matrix, ``W`` words, ``D`` values of a
network's descriptor, ``V`` views of a path, ``L`` pairs of them that are one place.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from refseq.features.hu import MOMENTS
from refseq.features.sift import DESCRIPTOR_SIZE
from refseq.inference.matching.incidence import feature_of
from refseq.limits import MAP_METRES, MAP_PLACES
from refseq.map.format.header import MapHeader
from refseq.map.format.npy import DeclaredArray
from refseq.map.paths.keys import MOST, PACKED_SIZE
from refseq.scan_matching.panorama import DEGREES

LARGEST = float(np.finfo(np.float64).max)
"""A stamp is any finite number: a robot's clock begins where it likes."""


@dataclass(frozen=True, slots=True)
class ArrayRule:
    """Valid content of an array: numbers of a ``type`` from ``low`` to ``high``.

    ``gaps`` allows rows of NaN, ``or_empty`` a shape whose first size is 0, ``optional`` that the array is not there.
    """

    type: str
    shape: tuple[str | int, ...]
    low: float = -MAP_METRES
    high: float = MAP_METRES
    gaps: bool = False
    or_empty: bool = False
    optional: bool = False


SEQUENCE: Mapping[str, ArrayRule] = {
    "along": ArrayRule("f8", ("K",)),
    "poses": ArrayRule("f8", ("K", 3), gaps=True),
    "odometry": ArrayRule("f8", ("K", 3), or_empty=True, optional=True),
    "pointers": ArrayRule("i8", ("N1",), low=0, high=np.inf),
    "places": ArrayRule("i4", ("E",), low=0, high=MAP_PLACES),
}
"""Arrays of a sequence."""

EXPERIENCES: Mapping[str, ArrayRule] = {
    "experiences/pointers": ArrayRule("i8", ("N1",), low=0, high=np.inf, optional=True),
    "experiences/entries": ArrayRule("i4", ("X",), low=0, high=MAP_PLACES, optional=True),
    "experiences/places": ArrayRule("i8", ("P",), low=0, high=MAP_PLACES, optional=True),
    "experiences/uses": ArrayRule("i8", ("P",), low=0, high=MAP_PLACES, optional=True),
}
"""Arrays of a sequence that later drives were added to: ``P`` experiences, ``X`` entries of their matrix."""

WORDS: Mapping[str, ArrayRule] = {
    "sift": ArrayRule("u1", ("W", DESCRIPTOR_SIZE)),
    "neural": ArrayRule("u1", ("W", "D")),
    "dense": ArrayRule("i8", ("W",), low=0),
    "hu": ArrayRule("f8", ("W", MOMENTS)),
}
"""Arrays of a sequence for each of these features: its words."""

PATH: Mapping[str, ArrayRule] = {
    "along": ArrayRule("f8", ("V",)),
    "sequences": ArrayRule("i8", ("V",), low=0, high=MAP_PLACES),
    "places": ArrayRule("i8", ("V",), low=0, high=MAP_PLACES),
    "odometry": ArrayRule("f8", ("V", 3), or_empty=True, optional=True),
    "poses": ArrayRule("f8", ("V", 3), or_empty=True, optional=True),
    "scans": ArrayRule("u2", ("V", DEGREES), low=0, or_empty=True, optional=True),
    "times": ArrayRule("f8", ("V",), low=-LARGEST, high=LARGEST, or_empty=True, optional=True),
    "loops": ArrayRule("i8", ("L", 2), low=0, high=MAP_PLACES, or_empty=True, optional=True),
}
"""Arrays of a path."""


def keys_of(camera: str) -> Mapping[str, ArrayRule]:
    """Arrays of a path for the keys of a camera, ``M camera`` of them in all: there are none, or all three."""
    many = f"M {camera}"
    return {
        f"keys/{camera}/counts": ArrayRule("i4", ("V",), low=0, high=MOST, optional=True),
        f"keys/{camera}/points": ArrayRule("u2", (many, 2), low=0, optional=True),
        f"keys/{camera}/packed": ArrayRule("u1", (many, PACKED_SIZE), low=0, optional=True),
    }


Rules = Mapping[str, tuple[ArrayRule, Mapping[str, int]]]
"""Rules by the names of arrays in the file, each with the sizes that the file's header gives."""


def rules_of(header: MapHeader) -> Rules:
    """Rules for all arrays that a map of this header has."""
    found: dict[str, tuple[ArrayRule, Mapping[str, int]]] = {}
    for number, table in enumerate(header.sequences):
        stem = f"sequences/{number}"
        its = {**SEQUENCE, **EXPERIENCES}
        found |= {f"{stem}/{name}": (rule, {"N1": table.features + 1}) for name, rule in its.items()}
        for key, size in table.blocks.items():
            if rule := WORDS.get(feature_of(key)):
                found[f"{stem}/features/{key}/words"] = rule, {"W": size}
    words = {key for table in header.sequences for key in table.blocks if key.startswith("sift/")}
    rules = dict(PATH)
    for key in sorted(words):
        rules |= keys_of(key.removeprefix("sift/"))
    for number in range(len(header.paths)):
        found |= {f"paths/{number}/{name}": (rule, {}) for name, rule in rules.items()}
    return found


def check_declared(rules: Rules, declared: Mapping[str, DeclaredArray]) -> None:
    """Raise ``ValueError`` where arrays are missing, unknown, or of another type or shape than their rules say."""
    if unknown := [name for name in declared if name not in rules]:
        raise ValueError(f"array {unknown[0]!r:.80} is not known here")
    sizes: dict[str, dict[str, int]] = {}
    for name, (rule, given) in rules.items():
        array = declared.get(name)
        if array is None:
            if rule.optional:
                continue
            raise ValueError(f"array {name} is missing")
        known = sizes.setdefault("/".join(name.split("/")[:2]), {})
        if array.type != rule.type or not _fits(array.shape, rule, {**known, **given}):
            raise ValueError(f"array {name} is {array}; valid is {_told(rule, {**known, **given})}")
        known |= {
            size: found
            for size, found in zip(rule.shape, array.shape, strict=True)
            if isinstance(size, str) and size not in given and not (rule.or_empty and found == 0)
        }


def _fits(shape: tuple[int, ...], rule: ArrayRule, sizes: Mapping[str, int]) -> bool:
    if len(shape) != len(rule.shape):
        return False
    pairs = zip(rule.shape, shape, strict=True)
    wanted = [sizes.get(size, found) if isinstance(size, str) else size for size, found in pairs]
    if rule.or_empty and shape[0] == 0:
        return list(shape[1:]) == wanted[1:]
    return list(shape) == wanted


def _told(rule: ArrayRule, sizes: Mapping[str, int]) -> str:
    """A rule in words, with the sizes that are known."""
    shape = ", ".join(str(sizes.get(size, size) if isinstance(size, str) else size) for size in rule.shape)
    return f"{rule.type} of shape ({shape}{',' * (len(rule.shape) == 1)})"


def check_values(name: str, rule: ArrayRule, array: NDArray[Any]) -> None:
    """Raise ``ValueError`` where a number of an array is not finite, or not from its rule's least to its largest."""
    if rule.gaps:
        array = array[~np.isnan(array).all(axis=-1)]
    if not array.size:
        return
    low, high = array.min(), array.max()
    if not (low >= rule.low and high <= rule.high):
        outside = high if low >= rule.low else low
        raise ValueError(f"array {name} holds {outside}; valid are numbers from {rule.low:g} to {rule.high:g}")
