"""Approach of a scene: from several sightings, how far it still is to where the scene was cut."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refseq.scenes.finder import SceneSighting, projected
from refseq.scenes.scene import Scene


@dataclass(frozen=True, slots=True)
class ApproachSettings:
    """When sightings are believed; chosen as ``SceneSettings`` are.

    Two sightings at least, ``apart`` [m] or more from each other and none farther back than ``span`` [m]. They agree
    where the box's corners move evenly with the odometer, within ``uneven`` of the picture's width, pass where the
    scene was cut within ``aside`` of it (another heading or lane shifts them), and lead there within ``reach`` [m].
    """

    apart: float = 0.3
    span: float = 4.0
    uneven: float = 0.1
    aside: float = 0.1
    reach: float = 6.0


@dataclass
class SceneApproach:
    """Sightings of one ``scene``, each with the odometer's reading [m].

    Seen through the inverse of its homography, a plane's picture moves evenly while a camera moves straight: a shift
    ``t`` from where the scene was cut gives I + t nᵀ / d, n the plane's normal and d its distance (Hartley and
    Zisserman, 13.1). The line through the corners' displacements is zero where the scene was cut, whether the camera
    looks ahead (the box grows) or aside (it wanders): neither d nor the camera's calibration has to be known.
    """

    scene: Scene
    settings: ApproachSettings = field(default_factory=ApproachSettings)
    _seen: list[tuple[float, NDArray[np.float64]]] = field(default_factory=list)

    def update(self, sighting: SceneSighting | None, travelled: float) -> float | None:
        """The way left to where the scene was cut [m], negative behind it; None while sightings do not tell.

        ``travelled`` is the odometer's reading [m] at the view, ``sighting`` None where the scene was not seen in it.
        """
        self._seen = [one for one in self._seen if abs(travelled - one[0]) <= self.settings.span]
        if sighting is None:
            return None
        corners = self.scene.box.corners
        back = projected(np.linalg.inv(sighting.homography / sighting.homography[2, 2]), corners)
        if back is None:
            return None
        self._seen.append((travelled, (back - corners).ravel()))
        return self._left(travelled)

    def _left(self, travelled: float) -> float | None:
        """The zero of the line through the displacements."""
        readings = np.array([reading for reading, _ in self._seen]) - travelled
        if len(readings) < 2 or np.ptp(readings) < self.settings.apart:
            return None
        moved = np.array([displacement for _, displacement in self._seen])
        design = np.c_[readings, np.ones(len(readings))]
        (rate, now), *_ = np.linalg.lstsq(design, moved)
        left = -float(now @ rate) / max(float(rate @ rate), 1e-9)
        uneven, aside = (_rms(one) / self.scene.width for one in (moved - design @ (rate, now), now + left * rate))
        agree = uneven <= self.settings.uneven and aside <= self.settings.aside
        return left if agree and abs(left) <= self.settings.reach else None


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
