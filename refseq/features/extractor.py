"""The one interface of all features."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from refseq.features.memory import clock
from refseq.view import View


class Extractor(Protocol):
    """Turns one sensor's part of a view into the ids of active binary features (2.2.1).

    ``key`` names it in the map (``"sift/camera-1"``), ``sensor`` is the sensor that it needs. Ids run from 0 to
    ``size`` − 1; ``size`` grows while learning and is fixed afterwards.
    """

    key: str
    sensor: str

    @property
    def size(self) -> int:
        """Number of known features."""

    def prepare(self) -> None:
        """Open what describing a view needs, before the first one. Raises ``MapError`` where that is missing."""

    def learn(self, view: View) -> NDArray[np.intp]:
        """Ids of the features in a view of the reference drive; what was never seen becomes a new feature."""

    def describe(self, view: View) -> Any:
        """Describe a view, known features or not; alike for all extractors of this kind and these settings."""

    def recognise(self, described: Any) -> NDArray[np.intp]:
        """Ids of the known features in what was described, rising."""

    def observe(self, view: View) -> "Observed":
        """Describe a view and recognise what is known of it."""

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Arrays that, with the profile, make this extractor again."""

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """Number here of each of the ``size`` features of another such extractor, of another drive, (size,).

        ``state`` is the other's; −1 stands for what is not known here.
        """


class Observed(NamedTuple):
    """Known features seen in a view, and how long extraction and matching took [s]."""

    ids: NDArray[np.intp]
    extraction: float
    matching: float = 0.0


class BaseExtractor(ABC):
    """Base of all extractors: to observe is to describe and to recognise."""

    def prepare(self) -> None:  # noqa: B027 - most need nothing
        """Open what describing a view needs: nothing."""

    @abstractmethod
    def describe(self, view: View) -> Any:
        """Describe a view, known features or not."""

    @abstractmethod
    def recognise(self, described: Any) -> NDArray[np.intp]:
        """Ids of the known features in it."""

    def observe(self, view: View) -> Observed:
        """Ids of the known features in a view, and what finding them took."""
        start = clock()
        described = self.describe(view)
        middle = clock()
        ids = self.recognise(described)
        return Observed(ids, middle - start, clock() - middle)
