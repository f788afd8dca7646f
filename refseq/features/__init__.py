"""Features: what turns a view into active binary features (card V3 to V9).

To add one, write a class that fits ``Extractor`` in a file of its own and name it in
``refseq.map.extractors.FEATURES``. Names are imported when they are first asked for: who only looks for doors in a
scan, as the robot's behaviours do, loads no SIFT, and no key of a drive follows it.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from refseq.features.boundary import ScanBoundary
    from refseq.features.corners import CornerCounts
    from refseq.features.dense import DenseWords
    from refseq.features.doors import DoorCounts
    from refseq.features.extractor import Extractor, Observed
    from refseq.features.hu import HuMoments
    from refseq.features.neural.words import NeuralWords
    from refseq.features.sectors import SectorRanges
    from refseq.features.sift import SiftWords
    from refseq.features.vocabulary import Vocabulary
    from refseq.features.walls import WallLines

__all__ = [
    "CornerCounts",
    "DenseWords",
    "DoorCounts",
    "Extractor",
    "HuMoments",
    "NeuralWords",
    "Observed",
    "ScanBoundary",
    "SectorRanges",
    "SiftWords",
    "Vocabulary",
    "WallLines",
]

_HOMES = {
    "boundary": ("ScanBoundary",),
    "corners": ("CornerCounts",),
    "dense": ("DenseWords",),
    "doors": ("DoorCounts",),
    "extractor": ("Extractor", "Observed"),
    "hu": ("HuMoments",),
    "neural.words": ("NeuralWords",),
    "sectors": ("SectorRanges",),
    "sift": ("SiftWords",),
    "vocabulary": ("Vocabulary",),
    "walls": ("WallLines",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
