"""Keypoints of an image told apart by the words that the map has seen at a place."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.features.word_extractor import KeyWords
from refseq.map.sequence import ReferenceSequence
from refseq.view import View
from refseq.viewer.places import Places


class MarkedKeypoints(NamedTuple):
    """Points of a picture [pixels]: ``matched`` (m, 2) are words of the place, ``unmatched`` (n, 2) are not."""

    matched: NDArray[np.float32]
    unmatched: NDArray[np.float32]


@dataclass
class Keypoints:
    """Keys of pictures, SIFT's or a network's, told apart by the words of a place."""

    places: Places
    _columns: dict[int, list[NDArray[np.intp]]] = field(default_factory=dict)

    def cameras(self) -> frozenset[str]:
        """Cameras whose words the map knows."""
        return frozenset(e.sensor for s in self.places.sequences for e in s.extractors if isinstance(e, KeyWords))

    def marked(self, view: View, camera: str, place: int) -> MarkedKeypoints | None:
        """The keys of a view's picture, by the words of ``place``; ``None`` without picture or words.

        If the map's own extractor has looked at this very picture, as when a localiser of this map was at work, its
        keys are used and not found again.
        """
        sequence, number = self.places.held(place)
        image = view.images.get(camera)
        words = next((e for e in sequence.extractors if isinstance(e, KeyWords) and e.sensor == camera), None)
        if image is None or words is None:
            return None
        points, descriptors = words.drawn(image)
        block = sequence.matrix.blocks[words.key]
        there = np.isin(words.vocabulary.find(descriptors) + block.start, self._words(sequence)[number])
        return MarkedKeypoints(points[there], points[~there])

    def _words(self, sequence: ReferenceSequence) -> list[NDArray[np.intp]]:
        """Features of each place of a sequence, unpacked when one is first asked for."""
        if id(sequence) not in self._columns:
            self._columns[id(sequence)] = sequence.matrix.columns()
        return self._columns[id(sequence)]
