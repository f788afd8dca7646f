"""The Bayes filter over places that takes odometry, and knows that the robot may be off the map."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr

from refseq.dead_reckoning import reckoned_poses
from refseq.planar import Pose, after_motion
from refseq.view import View
from refseq_bench.scenarios.methods.baselines.likelihood import SimilarityLikelihood
from refseq_bench.scenarios.methods.baselines.place_filter import PlaceFilter, neighbours
from refseq_bench.scenarios.methods.baselines.vlad import Likeness, VladMap, as_vlad

if TYPE_CHECKING:
    from refseq_bench.scenarios.methods.reference import Reference

FREEDOMS = 3
"""Degrees of freedom of a motion in the plane."""


@dataclass(frozen=True, slots=True)
class TopometricSettings:
    """Parameters of the filter.

    From view to view the robot goes on by ``least`` to ``most`` places. A motion's standard deviation is ``slack`` [m]
    along and across plus ``drift`` of its length, and ``turn_slack`` [rad]; a place that lies more than ``reach``
    standard deviations from where odometry leads is as unlikely as one at ``reach``. ``contrast`` is that of
    ``SimilarityLikelihood``. Off the map a view is as likely as at the place that stands at the quantile
    ``off_quantile`` of all places. The robot is off the map at first with probability ``off_first``, leaves it with at
    least ``off_least``, and stays off with ``off_stays``.
    """

    least: int = -1
    most: int = 5
    slack: float = 0.08
    drift: float = 0.1
    turn_slack: float = 0.3
    reach: float = 4.0
    contrast: float = 4.0
    off_quantile: float = 0.85
    off_first: float = 0.3
    off_least: float = 0.005
    off_stays: float = 0.99


class TopometricFilter(PlaceFilter[Likeness]):
    """Where the robot is, from how its views look and from odometry, or that it is off the map.

    M. Xu, T. Fischer, N. Sünderhauf, M. Milford, "Probabilistic appearance-invariant topometric localization with new
    place awareness", RA-L 6(4), 2021.

    The states are the places and one that means off the map. How likely a step from place j to k is, follows from how
    far the query's motion is from the reference drive's own between the two, in Mahalanobis' sense. Where it fits no
    place within reach, the robot has left the path. Chosen here: steps backwards are as possible as steps ahead, and
    what is said in ``SimilarityLikelihood``.
    """

    def __init__(self, places: VladMap, views: Sequence[View], settings: TopometricSettings | None = None) -> None:
        super().__init__()
        self._places = places
        self._settings = settings or TopometricSettings()
        self._similarity = SimilarityLikelihood(self._settings.contrast)
        self._steps = Steps(views, self._settings)

    def reset(self) -> None:
        """Forget all views seen."""
        super().reset()
        self._similarity.reset()

    def _observe(self, view: View) -> Likeness:
        return self._places.compare(view)

    def _predict(self, belief: NDArray[np.float64] | None, view: View) -> NDArray[np.float64]:
        """The belief after the motion that led to a view, (K + 1,), off the map last; at first any place alike."""
        K, settings = len(self._places), self._settings
        if belief is None:
            return np.append(np.full(K, (1 - settings.off_first) / K), settings.off_first)
        targets, onward, off = self._steps.probabilities(view.distance, view.turn)
        shares = belief[:-1, None] * onward
        moved = np.asarray(np.bincount(targets.ravel(), shares.ravel(), minlength=K + 1), np.float64)
        moved[:K] += belief[-1] * (1 - settings.off_stays) / K
        moved[K] += belief[-1] * settings.off_stays + belief[:-1] @ off
        return moved

    def _likelihood(self, seen: Likeness) -> NDArray[np.float64]:
        """Likelihood of a view in each state, (K + 1,)."""
        if seen.values is None:
            return np.ones(len(self._places) + 1)
        at_places = self._similarity(seen.values)
        return np.append(at_places, np.quantile(at_places, self._settings.off_quantile))


class Steps:
    """The reference drive's own motions from each place to those around it, which a motion is compared with.

    A place k stands for the stretch from half-way to the place before it to half-way to the one behind it, so from
    place j it is reached by any motion (x, y, heading), in the frame of j, that leads to a point of that stretch. At
    both ends of the path it goes on by half a step.
    """

    def __init__(self, views: Sequence[View], settings: TopometricSettings) -> None:
        self._settings = settings
        poses = np.array([(pose.x, pose.y, pose.heading) for pose in reckoned_poses(views)])
        K = len(poses)
        self._targets, self._there = neighbours(K, settings.least, settings.most)
        before = poses[1] - poses[0] if K > 1 else np.zeros(3)
        behind = poses[-1] - poses[-2] if K > 1 else np.zeros(3)
        half_way = np.concatenate([poses[:1] - before / 2, (poses[1:] + poses[:-1]) / 2, poses[-1:] + behind / 2])
        self._middle, begin, end = (
            _seen_from(poses[:, None, :], table[self._targets]) for table in (poses, half_way[:-1], half_way[1:])
        )
        self._legs = begin - self._middle, end - self._middle

    def probabilities(
        self, distance: float, turn: float
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        """Places reached from each (K, W), with what probability (K, W), and that of leaving the map (K,).

        Rows of the second with the third sum to 1. The chance of leaving is that a motion's error is as small as the
        one seen, at the place that fits best: small where one fits, near 1 where none does.
        """
        s = self._settings
        end = after_motion(Pose(0.0, 0.0, 0.0), distance, turn)
        deviation = s.slack + s.drift * abs(distance)
        precision = 1 / np.array([deviation, deviation, s.turn_slack]) ** 2
        point = np.array([end.x, end.y, end.heading])
        squared = np.minimum(*(_squared_misses(point, self._middle, leg, precision) for leg in self._legs))
        squared = np.where(self._there, np.minimum(squared, s.reach**2), np.inf)
        weights = np.exp(-squared / 2)
        off = np.maximum(chdtr(FREEDOMS, squared.min(axis=1)), s.off_least)
        return self._targets, weights / weights.sum(axis=1, keepdims=True) * (1 - off)[:, None], off


def _seen_from(origin: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (…, 3) in the frames of others (…, 3)."""
    difference = poses - origin
    cos, sin = np.cos(origin[..., 2]), np.sin(origin[..., 2])
    x = cos * difference[..., 0] + sin * difference[..., 1]
    y = cos * difference[..., 1] - sin * difference[..., 0]
    return np.stack([x, y, difference[..., 2]], axis=-1)


def _squared_misses(
    point: NDArray[np.float64], begin: NDArray[np.float64], leg: NDArray[np.float64], precision: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Squared Mahalanobis distance from a point (3,) to the nearest point of each line begin + t · leg, 0 ≤ t ≤ 1."""
    offset = point - begin
    length = (leg * leg * precision).sum(axis=-1)
    t = np.clip((offset * leg * precision).sum(axis=-1) / np.maximum(length, 1e-12), 0, 1)
    miss = offset - t[..., None] * leg
    squared: NDArray[np.float64] = (miss * miss * precision).sum(axis=-1)
    return squared


def learnt(reference: "Reference") -> TopometricFilter:
    """The method, once it has learnt a reference drive."""
    return TopometricFilter(reference.once(as_vlad), reference.views)
