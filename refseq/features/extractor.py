"""The one interface of all features."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

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
        """How many features it knows."""

    def learn(self, view: View) -> NDArray[np.intp]:
        """Ids of the features in a view of the reference drive; what was never seen becomes a new feature."""

    def observe(self, view: View) -> "Observed":
        """Ids of the known features in a view."""

    def state(self) -> Mapping[str, NDArray[Any]]:
        """Arrays that, with the profile, make this extractor again."""

    def translated(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """What each of the ``size`` features of another such extractor, of another drive, is here, (size,).

        ``state`` is the other's; −1 stands for what is not known here.
        """

    def adopted(self, state: Mapping[str, NDArray[Any]], size: int) -> NDArray[np.intp]:
        """The same, after what is not known here has become a new feature."""


class Observed:
    """Known features seen in a view, and how long extraction and matching took [s]."""

    __slots__ = ("extraction", "ids", "matching")

    def __init__(self, ids: NDArray[np.intp], extraction: float, matching: float = 0.0) -> None:
        self.ids = ids
        self.extraction = extraction
        self.matching = matching
