"""Finder of a scene in a camera's pictures: SIFT keys that match and agree on one homography."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import SceneError
from refseq.features.sift import SiftSettings, SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq.scenes.scene import Scene
from refseq.view import View

SCENE_SIFT = SiftSettings(cap=1200, contrast=0.02, first_octave=-1, last_octave=7, root=True)
"""Keys of scenes: more than places have, and weaker ones, for a patch is small and all of it has to be known again."""


@dataclass(frozen=True, slots=True)
class SceneSettings:
    """When a scene is seen; chosen on drives of two worlds, judged on others (docs/missions.md).

    A key of the scene matches the nearest one of the picture, where that is nearer than ``ratio`` times the second
    (Lowe 2004). ``inliers`` matches at least agree on a homography within ``reprojection`` [pixels], and are that many
    times ``distinct`` different keys of the picture. The scene appears between ``smallest`` and ``largest`` times as
    large as it was cut, and its edges turned by ``tilt`` [rad] at most: a robot's camera does not roll. A scene has
    ``keys`` at least.
    """

    ratio: float = 0.8
    reprojection: float = 4.0
    inliers: int = 25
    distinct: float = 0.7
    smallest: float = 0.2
    largest: float = 4.0
    tilt: float = 0.45
    keys: int = 40
    sift: SiftSettings = field(default=SCENE_SIFT)


@dataclass(frozen=True, slots=True, eq=False)
class SceneSighting:
    """A scene that was found: ``homography`` (3, 3) leads from the picture it was cut from to that it was found in.

    ``inliers`` is how many keys agree, ``corners`` (4, 2) where those of its box appear [pixels].
    """

    homography: NDArray[np.float64]
    inliers: int
    corners: NDArray[np.float64]


class SceneFinder:
    """Looks for one ``scene``, by so many ``keys``. Raises ``SceneError`` where they are too few to know it again."""

    def __init__(self, scene: Scene, settings: SceneSettings | None = None) -> None:
        self.scene, self.settings = scene, settings or SceneSettings()
        self._words = SiftWords(scene.camera, self.settings.sift)
        points, self._descriptors = self._words.keys(scene.patch)
        self.keys = len(points)
        if self.keys < self.settings.keys:
            raise SceneError(
                f"the scene has {self.keys} keys to know it by; valid are {self.settings.keys} or more: cut where "
                "there is more to see"
            )
        self._points = points + np.array(scene.box[:2], np.float32)
        self._matcher = cv2.BFMatcher.create(cv2.NORM_L2)

    def find(self, view: View) -> SceneSighting | None:
        """The scene in a view, None where it is not seen. Raises ``SceneError`` for a view of other cameras."""
        self.scene.check_camera(view)
        keys = self._words.keys(view.images[self.scene.camera])
        ours, theirs = self._matches(keys)
        if len(ours) < self.settings.inliers:
            return None
        here, there = self._points[ours], keys.points[theirs]
        found, mask = cv2.findHomography(here, there, cv2.USAC_MAGSAC, self.settings.reprojection)
        if found is None:
            return None
        homography = np.asarray(found, np.float64)
        agreed = mask.ravel() > 0
        distinct = len(np.unique(theirs[agreed]))
        if agreed.sum() < self.settings.inliers or distinct < self.settings.distinct * self.settings.inliers:
            return None
        corners = projected(homography, self.scene.box.corners)
        if corners is None or not self._plausible(corners):
            return None
        return SceneSighting(homography, int(agreed.sum()), corners)

    def _matches(self, keys: PictureKeys) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Numbers of the scene's keys and of those of a picture that match them, (m,) each."""
        if len(keys.points) < 2:
            return np.zeros(0, np.intp), np.zeros(0, np.intp)
        described = self._descriptors.astype(np.float32), keys.descriptors.astype(np.float32)
        pairs, ratio = self._matcher.knnMatch(*described, k=2), self.settings.ratio
        found = [(one.queryIdx, one.trainIdx) for one, two in pairs if one.distance < ratio * two.distance]
        ours, theirs = np.array(found, np.intp).reshape(-1, 2).T
        return ours, theirs

    def _plausible(self, corners: NDArray[np.float64]) -> bool:
        """True where the box appears as a camera that stands upright may see it."""
        box = self.scene.box
        area = cv2.contourArea(corners.astype(np.float32), oriented=True) / (box.width * box.height)
        top, left = corners[1] - corners[0], corners[3] - corners[0]
        tilts = np.arctan2(top[1], top[0]), np.arctan2(-left[0], left[1])
        settings = self.settings
        return (
            settings.smallest**2 <= area <= settings.largest**2
            and bool(cv2.isContourConvex(corners.astype(np.float32)))
            and max(map(abs, tilts)) <= settings.tilt
        )


def projected(homography: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Points (n, 2) through a homography, None where one of them lies behind the camera."""
    raised = np.c_[points, np.ones(len(points))] @ homography.T
    return raised[:, :2] / raised[:, 2:] if (raised[:, 2] > 1e-6).all() else None
