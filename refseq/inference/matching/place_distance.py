"""Distance of two places of a reference sequence by what their features tell them apart (6.4.5).

The measure is that of B.-H. Juang and L. R. Rabiner, "A probabilistic distance measure for hidden Markov models", AT&T
Technical Journal 64, 1985: D(i, j) is how many nats an observation of place i loses when it is explained by place j.
For places whose features are independent coins it has a closed form. A feature that only one of the two has counts
d(p‖q) one way and d(q‖p) the other, where p is the rate at which its extractor's features are seen again, q that of
false alarms; their mean, of the symmetric measure, is (p − q) ln (p (1 − q) / (q (1 − p))) / 2.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.inference.matching.incidence import IncidenceMatrix
from refseq.inference.matching.information import Noise, neighbour_noise
from refseq.inference.matching.neighbours import Neighbours

SAMPLE = 200
"""Pairs of places far apart that the scale is taken from: the median of so many moves by a few per cent at most."""


class PlaceDistances:
    """Symmetric distances of the places of one matrix, as shares of what tells places far apart from each other.

    ``neighbours`` tell which places lie beside each other, by whom the rates of features are learnt.
    """

    def __init__(self, matrix: IncidenceMatrix, neighbours: Neighbours | None = None) -> None:
        self.columns: Sequence[NDArray[np.intp]] = matrix.columns()
        self._weights = np.zeros(matrix.N)
        for block in matrix.blocks.values():
            noise = neighbour_noise(matrix, block, neighbours)
            self._weights[block.start : block.stop] = nats_a_difference(noise)
        self._scale = self._far()

    def nats(self, one: int, other: int) -> float:
        """The distance itself [nats]."""
        differing = np.setxor1d(self.columns[one], self.columns[other], assume_unique=True)
        return float(self._weights[differing].sum())

    def between(self, one: int, other: int) -> float:
        """The distance as a share: 0 for equal columns, 1 for what two places half a sequence apart have at the median.

        Where most places that far apart do not differ, as in a sequence that sees next to nothing, those that do are
        infinitely far from each other.
        """
        nats = self.nats(one, other)
        if self._scale > 0:
            return nats / self._scale
        return math.inf if nats > 0 else 0.0

    def _far(self) -> float:
        K = len(self.columns)
        places = np.unique(np.linspace(0, K - 1, min(K, SAMPLE)).round().astype(int)).tolist()
        return float(np.median([self.nats(place, (place + K // 2) % K) for place in places]))


def nats_a_difference(noise: Noise) -> float:
    """Share of a feature that only one of two places has in their distance [nats], by the rates of its extractor."""
    p, q = noise.detection, noise.false_alarm
    return (p - q) * math.log(p * (1 - q) / (q * (1 - p))) / 2
