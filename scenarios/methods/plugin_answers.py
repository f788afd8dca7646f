"""Check the answers of a user's localiser, part by part."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.belief import LOST, Belief, PoseBeside, Timings, pose_beside
from refseq.errors import RefseqError

SLACK = 1e-5
"""Deviation from 1 that a sum of probabilities may have: those that were summed in single precision are no mistake."""

LONGEST_TIME = 86_400.0
"""Longest time that a step on one view can take [s]: a localiser that takes a day is ended before."""
SCALES = (1e-6, 1e6)
"""Metres of a map that a metre of an odometer can be taken for."""


class NoAnswerError(Exception):
    """An answer is no belief; the message says why."""


def checked(belief: object, places: int, seconds: float) -> Belief:
    """An answer about so many ``places`` that took ``seconds``, as the bench keeps it.

    It is a copy, for who made it may go on to use the array. Raises ``NoAnswerError``, and whatever the answer's own
    code raises on being looked at.
    """
    if not isinstance(belief, Belief):
        raise NoAnswerError(f"answered {type(belief).__name__}; valid is refseq.belief.Belief")
    lost = _number("lost", belief.lost, 0, 1)
    return Belief(
        places=_probabilities(belief.places, places),
        lost=lost,
        best=_whole("best", belief.best, 0, places),
        path=tuple(_whole("path", place, LOST, places) for place in _sequence(belief.path)),
        entropy=_number("entropy", belief.entropy, -SLACK, np.inf),
        timings=_timings(belief.timings, seconds),
        lost_after=None if belief.lost_after is None else _lost_after(belief.lost_after, places, lost),
        pose=None if belief.pose is None else _pose(belief.pose),
        odometer_scale=_number("odometer_scale", belief.odometer_scale, *SCALES),
    )


def _pose(given: object) -> PoseBeside:
    if not isinstance(given, PoseBeside):
        raise NoAnswerError(f"pose is {type(given).__name__}; valid is refseq.belief.PoseBeside")
    try:
        return pose_beside(given.motion, given.covariance)
    except RefseqError as error:
        raise NoAnswerError(str(error)) from None


def _probabilities(given: object, places: int) -> NDArray[np.float64]:
    found = _shares("places", given, places)
    if abs(float(found.sum()) - 1) > SLACK:
        raise NoAnswerError(f"places sums to {float(found.sum()):.6g}; valid is 1")
    return found


def _lost_after(given: object, places: int, lost: float) -> NDArray[np.float64]:
    found = _shares("lost_after", given, places)
    if float(found.sum()) > lost + SLACK:
        raise NoAnswerError(f"lost_after sums to {float(found.sum()):.6g}; valid is at most lost, {lost:.6g}")
    return found


def _shares(name: str, given: object, places: int) -> NDArray[np.float64]:
    """An array of numbers from 0, one a place."""
    try:
        found = np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise NoAnswerError(f"{name} is {type(given).__name__}; valid is an array ({places},) of numbers") from None
    if found.shape != (places,):
        raise NoAnswerError(f"{name} has shape {found.shape}; valid is ({places},), one a reference view")
    if not (np.isfinite(found).all() and (found >= 0).all()):
        raise NoAnswerError(f"{name} holds what is no probability (nan, infinite or negative)")
    return found


def _number(name: str, given: object, low: float, high: float) -> float:
    """A number, or an array that holds one."""
    try:
        # Python makes numbers of texts and truth values.
        found = None if isinstance(given, str | bytes | bool | np.bool_) else float(given)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        found = None
    if found is None:
        raise NoAnswerError(f"{name} is {given!r:.40}; valid is a number")
    if not low <= found <= high or found == np.inf:
        upwards = "or more" if high == np.inf else f"to {high:g}"
        raise NoAnswerError(f"{name} is {found}; valid is {max(low, 0):g} {upwards}")
    return found


def _whole(name: str, given: object, low: int, places: int) -> int:
    if not isinstance(given, int | np.integer) or isinstance(given, bool) or not low <= given < places:
        lost = f", or {LOST} where it is lost" if low < 0 else ""
        raise NoAnswerError(f"{name} is {given!r:.40}; valid is a whole number from 0 to {places - 1}{lost}")
    return int(given)


def _sequence(given: object) -> Sequence[object]:
    if not isinstance(given, tuple | list | np.ndarray):
        raise NoAnswerError(f"path is {given!r:.40}; valid is a tuple of places")
    return list(given)


def _timings(given: object, seconds: float) -> Timings:
    """Its own times where it tells any; else all that it took counts as matching, which costs are told of."""
    if not isinstance(given, Timings):
        raise NoAnswerError(f"timings is {type(given).__name__}; valid is refseq.belief.Timings")
    told = [
        _number("timings", one, 0, LONGEST_TIME) for one in (given.features, given.matching, given.mixture, given.chain)
    ]
    return Timings(*told) if any(told) else Timings(matching=seconds)
