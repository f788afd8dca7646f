"""Features: what turns a view into active binary features (card V3 to V9).

To add one, write a class that fits ``Extractor`` in a file of its own and name it in
``refseq.map.extractors.FEATURES``.
"""

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
