"""Views as a caller brings them, made into what the localiser works on, or refused in one line."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from numbers import Real

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError, ViewError
from refseq.limits import BEAMS, METRES, PIXELS
from refseq.planar import Pose
from refseq.view import LASER, Scan, View, facing, measures

VALID_IMAGE = "(height, width) of uint8, or (height, width, 3) in the order red, green, blue"
VALID_RANGES = "(n,) of float32 [m], inf or NaN where nothing came back"
VALID_VIEWS = "refseq.View, one after the other, as read_recording(file).views are"

FARTHEST_START = 4 * math.pi
"""The largest angle at which a scan is believed to start, either side of forwards [rad]."""


def each_view(views: Iterable[View]) -> Iterator[View]:
    """The views of a drive, each of them ``sound``, from a list, a generator or anything else that gives them in turn.

    Raises ``ViewError`` for what gives no views, and as ``sound`` does.
    """
    if isinstance(views, str) or not isinstance(views, Iterable):
        raise ViewError(f"the views are a {type(views).__name__}; valid are {VALID_VIEWS}")
    for number, view in enumerate(views):
        if not isinstance(view, View):
            raise ViewError(f"view {number} is a {type(view).__name__}; valid are {VALID_VIEWS}")
        yield sound(view)


def sound(view: View) -> View:
    """The view after a look at all but its pictures, which may not be decoded yet.

    Ranges become a row of floats, counter-clockwise, ``inf`` where nothing came back; a scan without beams is left out,
    and a motion that is None, not measured, becomes NaN. Raises ``ViewError`` for what is no view, for a time or motion
    that is no number, for names of cameras that none can have, for a behaviour that is no text, and for a scan whose
    ranges are no row of numbers or whose angles or range no scanner has.
    """
    if not isinstance(view, View):
        raise ViewError(f"a view is a {type(view).__name__}; valid is refseq.View")
    if not _is_number(view.time) or not math.isfinite(view.time):
        raise ViewError(f"a view's time is {_told(view.time)} s; valid is a finite number")
    _check_names(view.images, view.time)
    if not isinstance(view.behaviour, str):
        raise ViewError(f"view at {view.time:g} s: behaviour is {_told(view.behaviour)}; valid is a text")
    distance, turn = _motion(view.distance, "distance", view.time), _motion(view.turn, "turn", view.time)
    scan = None if view.scan is None or _has_no_beams(view.scan) else _scan(view.scan, view.time)
    same = scan is view.scan and distance is view.distance and turn is view.turn
    return view if same else replace(view, scan=scan, distance=distance, turn=turn)


def usable(view: View, sensors: Collection[str] | None = None) -> View:
    """The view ``sound`` and with grey images, of these ``sensors`` alone where they are given; a scan stays.

    Colour images, (height, width, 3 or 4) uint8 in the order red, green, blue, become grey. A motion that is not finite
    was not measured: ``has_odometry`` is False then. Raises ``ViewError`` as ``sound`` does, and for images of other
    numbers or shapes.
    """
    view = sound(view)
    cameras = view.images if sensors is None else [name for name in view.images if name in sensors]
    view = replace(view, images={name: _grey(view.images[name], name, view.time) for name in cameras})
    return view if measures(view) else replace(view, distance=0.0, turn=0.0, has_odometry=False)


def names_in(names: Sequence[str] | str | None) -> Sequence[str] | None:
    """Names as a caller gives them: one alone as a text too. None where there are none, so that all are meant."""
    return ((names,) if isinstance(names, str) else names) or None


def check_motions(views: Iterable[View]) -> None:
    """Raise ``ViewError`` for a motion or a true pose that a map along its drive cannot hold."""
    for number, view in enumerate(views):
        numbers = [("distance", view.distance, "m"), ("turn", view.turn, "rad")]
        if view.truth is not None:
            if not isinstance(view.truth, Pose):
                told = f"{type(view.truth).__name__}; valid is refseq.Pose, or None"
                raise ViewError(f"view {number} at {view.time:g} s: truth is a {told}")
            x, y, heading = view.truth.x, view.truth.y, view.truth.heading
            numbers += [("true x", x, "m"), ("true y", y, "m"), ("true heading", heading, "rad")]
        for name, value, unit in numbers:
            where = f"view {number} at {view.time:g} s: {name} {value} {unit}"
            if not math.isfinite(value):
                raise ViewError(f"{where}; valid is a finite number")
            if abs(value) > METRES:
                raise ViewError(f"{where}; valid are numbers from {-METRES:g} to {METRES:g}")


def check_angles(count: int, start: float, step: float, error: type[ViewError | LogError] = ViewError) -> None:
    """Raise ``error`` for a number of beams, or for angles [rad], that no scanner has."""
    BEAMS.check(count, "a message has" if error is LogError else "it has", error)
    asked = ": are they in degrees?" if _are_degrees(count, start, step) else ""
    if not (abs(start) <= FARTHEST_START and math.isfinite(step)) or (step == 0 and count > 1):
        raise error(
            f"a scan starts at {start} rad with steps of {step} rad{asked}; valid are angles within two turns, and "
            "steps not of 0"
        )
    if abs(step) * (count - 1) > 2 * math.pi + abs(step) + 1e-3:
        told = f"a scan of {count} beams with steps of {step:g} rad is more than one turn{asked}"
        raise error(f"{told}; valid is one turn at most")


def _are_degrees(count: int, start: float, step: float) -> bool:
    """True of angles that are a scanner's in degrees, and none in radians."""
    begins = start == 0 or 2 * math.pi < abs(start) <= 360
    return begins and 4 * math.pi < abs(step) * (count - 1) <= 360 + abs(step)


def _check_names(images: object, time: float) -> None:
    """Raise ``ViewError`` for images without names, and for names that are none or the laser's."""
    if not isinstance(images, Mapping):
        told = f"images are a {type(images).__name__}; valid are pictures by the names of their cameras, as a dict"
        raise ViewError(f"view at {time:g} s: {told}")
    for name in images:
        if not isinstance(name, str) or name in ("", LASER):
            raise ViewError(f"view at {time:g} s: a camera's name is {name!r:.60}; valid is any text but {LASER!r}")


def _grey(image: NDArray[np.uint8], camera: str, time: float) -> NDArray[np.uint8]:
    found = np.asarray(image)
    channels = found.shape[2] if found.ndim == 3 else 1
    if found.dtype != np.uint8 or found.ndim not in (2, 3) or not found.size or channels not in (1, 3, 4):
        raise ViewError(f"view at {time:g} s: {camera}: an image of {_described(found)}; valid is {VALID_IMAGE}")
    PIXELS.check(found.shape[0] * found.shape[1], f"view at {time:g} s: {camera}: an image has", ViewError)
    if found.ndim == 2:
        return image
    if channels == 1:
        return found[:, :, 0]
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_RGB2GRAY if channels == 3 else cv2.COLOR_RGBA2GRAY), np.uint8)


def _motion(value: float | None, name: str, time: float) -> float:
    if value is None:
        return math.nan
    if not _is_number(value):
        raise ViewError(f"view at {time:g} s: {name} is {_told(value)}; valid is a number, or None: not measured")
    return value


def _scan(scan: Scan, time: float) -> Scan:
    where = f"view at {time:g} s: laser"
    if not isinstance(scan, Scan):
        raise ViewError(f"{where}: a scan is a {type(scan).__name__}; valid is refseq.Scan, or None")
    ranges = np.asarray(scan.ranges)
    if ranges.ndim != 1 or ranges.dtype.kind not in "fiu":
        raise ViewError(f"{where}: ranges of {_described(ranges)}; valid is {VALID_RANGES}")
    for name in ("start", "step", "max_range"):
        if not _is_number(value := getattr(scan, name)):
            raise ViewError(f"{where}: {name} is {_told(value)}; valid is a number")
    if not 0 < scan.max_range < math.inf:
        raise ViewError(f"{where}: max_range is {scan.max_range} m; valid is a finite number above 0")
    try:
        check_angles(len(ranges), scan.start, scan.step)
    except ViewError as error:
        raise ViewError(f"{where}: {error}") from None
    if ranges is not scan.ranges or ranges.dtype.kind != "f":
        scan = replace(scan, ranges=ranges.astype(np.float32))
    told = np.where(scan.returned, scan.ranges, np.float32(np.inf))  # as a log is read
    if not np.array_equal(told, scan.ranges):
        scan = replace(scan, ranges=told)
    return facing(scan)


def _has_no_beams(scan: object) -> bool:
    return isinstance(scan, Scan) and np.shape(scan.ranges) == (0,)


def _is_number(value: object) -> bool:
    return isinstance(value, Real)


def _told(value: object) -> str:
    """A value in an error, numbers as they are."""
    return str(value) if _is_number(value) else f"{value!r:.60}"


def _described(array: NDArray[np.generic]) -> str:
    return f"{array.shape} {array.dtype}"
