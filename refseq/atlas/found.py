"""An overlap that was found between two paths of a map, by their numbers and views."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.consistency import CandidateJoin, LaidPairs
from refseq.atlas.overlap import Overlap


@dataclass(frozen=True)
class FoundOverlap:
    """An overlap of two paths by their numbers, with the ``views`` (n, 2) of its places.

    ``one`` keeps the places, and is the path that had fewer of them when it was learnt; ``other`` gives them away. Of a
    loop both are the same path, which keeps all its places.
    """

    one: int
    other: int
    views: NDArray[np.intp]
    overlap: Overlap
    laid: LaidPairs | None = None
    """Relative poses of some of its views by their scans, of a loop."""
    scale: float = 1.0
    """Scale of the odometer of ``other`` by which its scans lie best on those of ``one``."""

    @property
    def is_loop(self) -> bool:
        """True where a path comes back to itself."""
        return self.one == self.other

    @property
    def join(self) -> CandidateJoin:
        """The overlap as a join to be decided about."""
        alone = not self.overlap.doubt
        return CandidateJoin(self.one, self.other, self.views, self.overlap.evidence, alone, laid=self.laid)
