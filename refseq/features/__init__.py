"""Features: what turns a view into active binary features (card V3 to V9)."""

from refseq.features.boundary import ScanBoundary
from refseq.features.extractor import Extractor
from refseq.features.sift import SiftWords
from refseq.features.vocabulary import Vocabulary
from refseq.features.walls import WallLines

__all__ = ["Extractor", "ScanBoundary", "SiftWords", "Vocabulary", "WallLines"]
