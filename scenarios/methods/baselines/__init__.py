"""Other people's methods, made small, as yardsticks on the very same views.

Each fits ``refseq.belief.LocaliserProtocol`` and is learnt from the views of a reference drive. Their parameters were
chosen in the world ``annex``, which is not scored, and stay as they are.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from refseq.belief import LocaliserProtocol
from refseq.map.map import Map
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.fabmap import FabMap
from refseq_bench.scenarios.methods.baselines.fabmap_words import WordMap
from refseq_bench.scenarios.methods.baselines.hamming import NearestColumn
from refseq_bench.scenarios.methods.baselines.ransac import RansacInliers
from refseq_bench.scenarios.methods.baselines.seqslam import SeqSlam
from refseq_bench.scenarios.methods.baselines.sequence_graph import SequenceGraph
from refseq_bench.scenarios.methods.baselines.single import SingleBest
from refseq_bench.scenarios.methods.baselines.topological import TopologicalFilter
from refseq_bench.scenarios.methods.baselines.topometric import TopometricFilter
from refseq_bench.scenarios.methods.baselines.vlad import VladMap
from refseq_bench.scenarios.methods.shelf import Shelf, learn_map

CODEBOOK_SEED = 1
"""Any number will do: it keeps the codebook the same for the same views."""


@dataclass(frozen=True)
class Reference:
    """The drive to learn from. What several baselines build on is made once, when it is first asked for."""

    views: Sequence[View]
    shelf: Shelf = learn_map

    @cached_property
    def vlad(self) -> VladMap:
        """The views as VLAD."""
        return VladMap.learn(self.views, np.random.default_rng(CODEBOOK_SEED))

    def map(self, profile: str) -> Map:
        """The views as our own localiser's map with a profile."""
        return self.shelf(profile, self.views)

    @cached_property
    def words(self) -> WordMap:
        """The views as bags of words."""
        return WordMap(self.views)


BASELINES: Mapping[str, Callable[[Reference], LocaliserProtocol]] = {
    "hamming": lambda reference: NearestColumn(reference.map("thesis").sequence, reference.views),
    "vlad": lambda reference: SingleBest(reference.vlad),
    "ransac": lambda reference: RansacInliers.learn(reference.views),
    "fabmap-naive": lambda reference: FabMap(reference.words, tree=False),
    "fabmap": lambda reference: FabMap(reference.words),
    "seqslam": lambda reference: SeqSlam(reference.views),
    "sequence-graph": lambda reference: SequenceGraph(reference.vlad),
    "topological": lambda reference: TopologicalFilter(reference.vlad),
    "topometric": lambda reference: TopometricFilter(reference.vlad, reference.views),
}
"""Baselines by name: each learns a reference drive and gives a localiser for others."""
