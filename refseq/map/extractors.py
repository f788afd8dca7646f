"""Extractors by the names of features, with the settings of a profile.

To add a feature, write a class that fits ``Extractor`` in a file of ``refseq.features`` and name it in ``FEATURES``.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.features import (
    CornerCounts,
    DenseWords,
    DoorCounts,
    Extractor,
    HuMoments,
    NeuralWords,
    ScanBoundary,
    SectorRanges,
    SiftWords,
    WallLines,
)
from refseq.inference.matching.incidence import feature_of, sensor_of
from refseq.map.profile import Profile
from refseq.view import LASER

FEATURES: Mapping[str, Callable[[str, Profile, Mapping[str, NDArray[Any]]], Extractor | None]] = {
    "sift": lambda sensor, p, state: SiftWords(sensor, p.sift, state.get("words")) if sensor != LASER else None,
    "neural": lambda sensor, p, state: NeuralWords(sensor, p.neural, state.get("words")) if sensor != LASER else None,
    "dense": lambda sensor, p, state: DenseWords(sensor, p.dense, state.get("words")) if sensor != LASER else None,
    "walls": lambda sensor, p, state: WallLines(p.walls) if sensor == LASER else None,
    "doors": lambda sensor, p, state: DoorCounts(p.doors, p.walls) if sensor == LASER else None,
    "corners": lambda sensor, p, state: CornerCounts(p.walls) if sensor == LASER else None,
    "boundary": lambda sensor, p, state: ScanBoundary() if sensor == LASER else None,
    "hu": lambda sensor, p, state: HuMoments(p.hu, state.get("words")) if sensor == LASER else None,
    "sectors": lambda sensor, p, state: SectorRanges(p.sectors) if sensor == LASER else None,
}
"""Every feature by name: makes its extractor for a sensor, a profile and saved arrays, or None if it is not for it."""


def make_extractors(features: Iterable[str], sensors: Sequence[str], profile: Profile) -> tuple[Extractor, ...]:
    """Fresh extractors for every fitting pair of feature and sensor; ``MapError`` when one is unknown or none fits."""
    if not sensors:
        raise MapError("no view has a picture or a scan; valid are views of at least one camera or laser")
    names = list(features)
    for name in names:
        if name not in FEATURES:
            raise MapError(f"feature {name!r} is unknown; valid are {', '.join(FEATURES)}")
    pairs = [(name, sensor) for sensor in sensors for name in names]
    made = [FEATURES[name](sensor, profile, {}) for name, sensor in pairs]
    extractors = tuple(extractor for extractor in made if extractor is not None)
    if not extractors:
        fitting = ", ".join(name for name in FEATURES if any(FEATURES[name](sensor, profile, {}) for sensor in sensors))
        raise MapError(f"features {', '.join(names)} do not fit sensors {', '.join(sensors)}; valid are {fitting}")
    return extractors


def check_feature(key: str) -> None:
    """Raise ``MapError`` for the key of an extractor, ``feature/sensor``, whose feature is not known."""
    if feature_of(key) not in FEATURES:
        raise _unknown(key)


def make_extractor(key: str, profile: Profile, state: Mapping[str, NDArray[Any]]) -> Extractor:
    """The extractor of a saved map by its key, ``feature/sensor``. Raises ``MapError`` for one that is not known."""
    name = feature_of(key)
    extractor = FEATURES[name](sensor_of(key), profile, state) if name in FEATURES else None
    if extractor is None:
        raise _unknown(key)
    return extractor


def _unknown(key: str) -> MapError:
    return MapError(f"feature {key!r:.80} is unknown; valid are {', '.join(FEATURES)}, a slash and a fitting sensor")
