"""SeqSLAM: short sequences of thumbnails, compared place by place along lines of nearly the same speed."""

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, Timings
from refseq.errors import MapError
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.answer import answer
from refseq_bench.scenarios.methods.baselines.place_filter import neighbours

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference


@dataclass(frozen=True, slots=True)
class SeqSlamSettings:
    """Parameters of the method, as published but for the last two.

    Images are shrunk to ``width`` × ``height`` [pixels] and normalised in squares ``patch`` [pixels] wide. Differences
    are enhanced among ``around`` places, half of them to each side. A sequence is ``views`` long; a trajectory goes on
    by ``slowest`` to ``fastest`` places a view, tried every ``step``. Here a view is taken every so many metres, on the
    reference drive and on the query drive alike: the true speed is 1 but for what odometry errs and drives differ, and
    ten views are a longer way than ten pictures of a video.

    ``worth`` is the score that makes a place e times as likely; it shapes the belief, not the answer. Where the best
    place scores −``needed`` it is even odds that the robot is on the path. These two were set in the annex.
    """

    width: int = 64
    height: int = 32
    patch: int = 8
    around: int = 10
    views: int = 10
    slowest: float = 0.8
    fastest: float = 1.2
    step: float = 0.1
    worth: float = 0.1
    needed: float = 1.0


class SeqSlam:
    """Where the last views look like a stretch of the path.

    M. Milford, G. Wyeth, "SeqSLAM: visual route-based navigation for sunny summer days and stormy winter nights", ICRA
    2012. All cameras' thumbnails lie side by side.

    The sequence ends at the present view, and has fewer views as long as there are no more: no answer waits for views
    to come, and a drive may start anywhere. Where a trajectory begins before the path, and for a view without images,
    the difference is 0, which after enhancement is that of a place like those around it.

    P(lost) falls with the best score and is ½ at −``needed``. The paper accepts a match by the quotient of its score
    and the best one elsewhere on the path, which means nothing for scores around 0; in the annex their difference told
    less of being off the path (AUROC 0.75) than the score itself (0.83).
    """

    def __init__(self, views: Sequence[View], settings: SeqSlamSettings | None = None) -> None:
        self._settings = settings or SeqSlamSettings()
        cameras = sorted({camera for view in views for camera in view.images})
        if not cameras:
            raise MapError(f"{len(views)} views show nothing to compare; valid is a drive with images")
        self._places = {camera: np.stack([self._thumbnail(view, camera) for view in views]) for camera in cameras}
        self._lags = trajectories(self._settings)
        self._rows: deque[NDArray[np.float64]] = deque(maxlen=self._settings.views)

    def reset(self) -> None:
        """Forget all views seen."""
        self._rows.clear()

    def update(self, view: View) -> Belief:
        """Compare a view with all places, then the last views with all stretches."""
        start = time.perf_counter()
        thumbnails = {camera: self._thumbnail(view, camera) for camera in self._places if camera in view.images}
        middle = time.perf_counter()
        self._rows.append(self._enhanced(thumbnails))
        matched = time.perf_counter()
        scores = sequence_scores(list(self._rows)[::-1], self._lags)
        found = max(0.0, -float(scores.min()))
        lost = self._settings.needed / (self._settings.needed + found)
        weights = np.exp((scores.min() - scores) / self._settings.worth)
        return answer(weights, lost, Timings(middle - start, matched - middle), matched)

    def _enhanced(self, thumbnails: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
        """Difference to each place, enhanced, (K,)."""
        if not thumbnails:
            return np.zeros(len(next(iter(self._places.values()))))
        differences = [np.abs(self._places[camera] - seen).mean(axis=(1, 2)) for camera, seen in thumbnails.items()]
        return enhance(np.mean(differences, axis=0), self._settings.around // 2)

    def _thumbnail(self, view: View, camera: str) -> NDArray[np.float64]:
        """A camera's thumbnail, (height, width); one without contrast where the view lacks the camera."""
        settings = self._settings
        if camera not in view.images:
            return np.zeros((settings.height, settings.width))
        size = (settings.width, settings.height)
        small = cv2.resize(view.images[camera].astype(np.float32), size, interpolation=cv2.INTER_AREA)
        return normalise_patches(small.astype(np.float64), settings.patch)


def normalise_patches(image: NDArray[np.float64], patch: int) -> NDArray[np.float64]:
    """Each square of an image, (height, width), less its mean and divided by its standard deviation.

    Both sides are multiples of ``patch``. A square of one grey is 0.
    """
    height, width = image.shape
    squares = image.reshape(height // patch, patch, width // patch, patch)
    excess = squares - squares.mean(axis=(1, 3), keepdims=True)
    deviation = squares.std(axis=(1, 3), keepdims=True)
    # What remains of equal numbers less their mean is rounding, which must not be blown up.
    normal = np.where(deviation > 1e-9, excess / np.maximum(deviation, 1e-9), 0.0)
    return normal.reshape(height, width)


def enhance(differences: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """Differences (K,) less the mean of those up to ``reach`` places away, divided by their standard deviation.

    Equation (2) of the paper. At both ends of the path there are fewer; where all are equal it is 0.
    """
    around, there = neighbours(len(differences), -reach, reach)
    near = np.where(there, differences[around], np.nan)
    deviation = np.nanstd(near, axis=1)
    excess = differences - np.nanmean(near, axis=1)
    enhanced: NDArray[np.float64] = np.where(deviation > 0, excess / np.maximum(deviation, 1e-12), 0.0)
    return enhanced


def trajectories(settings: SeqSlamSettings) -> NDArray[np.intp]:
    """Places by which each trajectory lags behind the last one, (trajectories, views), the present view first."""
    count = round((settings.fastest - settings.slowest) / settings.step) + 1
    speeds = settings.slowest + settings.step * np.arange(count)
    lags = np.rint(speeds[:, None] * np.arange(settings.views)).astype(np.intp)
    return np.unique(lags, axis=0)


def sequence_scores(rows: Sequence[NDArray[np.float64]], lags: NDArray[np.intp]) -> NDArray[np.float64]:
    """Mean difference along the best trajectory that ends at each place, (K,).

    ``rows`` are the enhanced differences (K,) of the last views, the present one first; before the path they are 0.
    """
    K, most = len(rows[0]), int(lags.max())
    padded = np.concatenate([np.zeros((len(rows), most)), np.array(rows)], axis=1)
    columns = np.arange(K) + most - lags[:, : len(rows), None]
    along = padded[np.arange(len(rows))[:, None], columns]
    scores: NDArray[np.float64] = along.mean(axis=1).min(axis=0)
    return scores


def learnt(reference: "Reference") -> SeqSlam:
    """The method, once it has learnt a reference drive."""
    return SeqSlam(reference.views)
