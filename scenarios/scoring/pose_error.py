"""Errors of poses beside places: how far the scan's pose is from the truth, and the place itself."""

import math
from dataclasses import dataclass

import numpy as np

from refseq.belief import PoseBeside
from refseq.planar import relative_pose, wrap
from refseq_bench.scenarios.scoring.comparison import Comparison
from refseq_bench.scenarios.scoring.path_geometry import WIDE

UNITS = {"along": ("m", 1.0), "aside": ("m", 1.0), "heading": ("°", 180 / math.pi)}


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """Errors of ``told`` poses out of those of all ``views``, at places within 1.5 m of the robot and looking its way.

    Medians of absolute errors along, aside [m] and of heading [rad]: ``poses`` of the poses, ``places`` of the places
    themselves at the same views. ``squares`` is the mean squared error in units of the covariance, over the three
    degrees of freedom: 1 where covariances say what errors are, more where they are too small.
    """

    views: int
    told: int
    poses: tuple[float, float, float]
    places: tuple[float, float, float]
    squares: float

    @property
    def record(self) -> dict[str, object]:
        """All of it for JSON, errors to a millimetre."""
        poses, places = ([round(one, 3) for one in errors] for errors in (self.poses, self.places))
        return {
            "views": self.views,
            "told": self.told,
            "poses": poses,
            "places": places,
            "squares": round(self.squares, 2),
        }

    def __str__(self) -> str:
        parts = [
            f"{name} {scale * pose:.3f} {unit} (the place itself {scale * place:.3f})"
            for (name, (unit, scale)), pose, place in zip(UNITS.items(), self.poses, self.places, strict=True)
        ]
        return f"pose beside the place at {self.told} of {self.views} views, median error {', '.join(parts)}"


def pose_errors(comparison: Comparison, method: str) -> PoseErrors | None:
    """Errors of a method's poses; None where it tells none at a place that is right, or nobody knows the truth."""
    found = []
    for view, belief in zip(comparison.query_views, comparison.beliefs[method], strict=True):
        place = comparison.reference_views[belief.best].truth
        if belief.pose is None or view.truth is None or place is None:
            continue
        seen = relative_pose(view.truth, place)
        true = np.array([seen.x, seen.y, wrap(seen.heading)])
        if math.hypot(seen.x, seen.y) <= WIDE.distance and abs(true[2]) <= WIDE.heading:
            found.append((true, *_error(belief.pose, true)))
    if not found:
        return None
    places, errors, squares = (np.array(part) for part in zip(*found, strict=True))
    medians = [tuple(np.median(np.abs(part), axis=0).tolist()) for part in (errors, places)]
    return PoseErrors(len(comparison.query_views), len(found), medians[0], medians[1], float(squares.mean()) / 3)


def _error(pose: PoseBeside, true: np.ndarray) -> tuple[np.ndarray, float]:
    error = np.array(pose.motion) - true
    error[2] = wrap(error[2])
    return error, float(error @ np.linalg.solve(pose.covariance, error))
