"""A small localiser to begin with: views as little pictures, compared one by one, and odometry to carry what is known.

It keeps a probability for each place of the reference drive, and one for being nowhere near it. With each view these
move along the path as far as the wheels say, then count for more where the place looked like the view does. Try what
you like better: all the bench asks for are the three methods of ``MyLocaliser``.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, belief_from
from refseq.view import View

SIZE = (32, 24)
"""Size that an image is shrunk to [pixels]: small enough to care little where exactly the robot stands."""
BEAMS, FAR = 30, 10.0
"""Parts that a scan is shrunk to: means of so many stretches, nothing counted farther away than this [m]."""
SLACK = 0.7
"""Standard deviation of how far the robot went along the path, beside what odometry says [m]."""
STRAY, RETURN = 0.01, 0.1
"""Chance, from one view to the next, to leave the path and to come back to it."""
SHARPNESS = 1.0
"""Weight of a place that looks one standard deviation more alike than places do on average, as exp(...)."""
USUAL = 1.0
"""By how many standard deviations the right place stands out; a robot that is lost sees places stand out less."""


class MyLocaliser:
    """Learns the views of a reference drive, then answers where along it each view of another drive was taken.

    Views come without their true pose (``truth`` is None), and their arrays cannot be written to: copy what you change.
    """

    def __init__(self, reference: Sequence[View]) -> None:
        self._looks = [_look(view) for view in reference]
        self._along = np.cumsum([view.distance for view in reference])  # (K,) [m]
        self.reset()

    def reset(self) -> None:
        """Forget all views seen: another drive begins."""
        K = len(self._looks)
        self._places, self._lost = np.full(K, 1 / (K + 1)), 1 / (K + 1)

    def update(self, view: View) -> Belief:
        """Take the next view of the drive and answer where it is, from the views up to now."""
        self._move(view.distance)
        self._weigh(self._likeness(_look(view)))
        return belief_from(self._places, self._lost)

    def _move(self, distance: float) -> None:
        """Let the robot go ``distance`` [m] along the path, or stray from it, or come back anywhere."""
        step = self._along[None, :] - self._along[:, None]  # (K, K) from row to column
        chances = np.exp(-(((step - distance) / SLACK) ** 2) / 2) + 1e-9
        chances /= chances.sum(axis=1, keepdims=True)
        arrived = (1 - STRAY) * self._places @ chances + RETURN * self._lost / len(self._places)
        self._lost = (1 - RETURN) * self._lost + STRAY * self._places.sum()
        self._places = arrived

    def _weigh(self, likeness: NDArray[np.float64]) -> None:
        """Let places count for more that look more like the view, by how far they stand out from the others."""
        spread = float(likeness.std())
        if spread > 0:  # a view without any sensor is like all places
            standing_out = (likeness - likeness.mean()) / spread
            self._places = self._places * np.exp(SHARPNESS * standing_out)
            self._lost *= float(np.exp(SHARPNESS * USUAL))
        total = self._places.sum() + self._lost
        self._places, self._lost = self._places / total, float(self._lost / total)

    def _likeness(self, look: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Likeness of a view and each place, (K,): the mean correlation over the sensors that both have."""
        alike = [[look[name] @ place[name] for name in look if name in place] for place in self._looks]
        return np.array([float(np.mean(each)) if each else 0.0 for each in alike])


def _look(view: View) -> dict[str, NDArray[np.float64]]:
    """Describe what each sensor shows as a vector of length 1 and mean 0, so that brighter light changes nothing."""
    found = {}
    for camera, image in view.images.items():
        small = cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA).astype(np.float64)
        # Each pixel less its surroundings: edges stay, shading goes.
        found[camera] = _unit(small - cv2.GaussianBlur(small, (0, 0), 4.0))
    if view.scan is not None:
        near = np.minimum(view.scan.ranges, FAR)
        found["laser"] = _unit(np.array([part.mean() for part in np.array_split(near, BEAMS)]))
    return found


def _unit(values: NDArray[np.float64]) -> NDArray[np.float64]:
    vector: NDArray[np.float64] = values.ravel() - values.mean()
    return vector / max(float(np.linalg.norm(vector)), 1e-9)
