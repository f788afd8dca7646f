"""The shape of the free space by its Hu moments, matched against a vocabulary of stored ones, like SIFT (B.4)."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.features.boundary import outline
from refseq.features.vocabulary import Vocabulary
from refseq.features.word_extractor import WordExtractor
from refseq.view import LASER, Scan, View

MOMENTS = 7


@dataclass(frozen=True, slots=True)
class HuSettings:
    """Moments that are small against ``floor`` count as none; ``alias_distance`` is between logarithms (decades).

    Both are choices: on two real office logs most scans of the same place (0.4 m, 11°) are aliases with these, and of
    scans 3 m apart and more one in a hundred.
    """

    floor: float = 1e-4
    alias_distance: float = 0.4


def hu_moments(scan: Scan) -> NDArray[np.float64]:
    """The seven moments of the scan's filled outline, (1, 7); (0, 7) for an outline without area.

    They do not change when the outline is moved, turned or scaled; its mirror image has the seventh's sign changed.
    OpenCV integrates over the polygon's inside by its corners (Green's theorem), so nothing is drawn in pixels.
    """
    moments = cv2.moments(outline(scan).astype(np.float32)[:, None])
    found = [cv2.HuMoments(moments).ravel()] if moments["m00"] > 0 else []
    return np.array(found, np.float64).reshape(-1, MOMENTS)


def log_scaled(moments: NDArray[np.float64], floor: float) -> NDArray[np.float64]:
    """sign(h) · log₁₀(1 + |h| / floor): decades above the floor, with the sign, and steady where the sign changes."""
    return np.sign(moments) * np.log10(1 + np.abs(moments) / floor)


class HuMoments(WordExtractor):
    """At most one bit a scan: the stored moments that its own are nearest to, if they are near enough."""

    key = "hu/laser"
    sensor = LASER

    def __init__(self, settings: HuSettings, words: NDArray[np.float64] | None = None) -> None:
        self.settings = settings
        self.vocabulary = Vocabulary(settings.alias_distance, np.zeros((0, MOMENTS)) if words is None else words)

    def describe(self, view: View) -> NDArray[np.float64]:
        """The moments of a view's scan, (1, 7), or none, (0, 7)."""
        assert view.scan is not None, "the localiser asks only where the sensor is there"
        return log_scaled(hu_moments(view.scan), self.settings.floor)
