"""Views as a caller brings them, made into what the localiser works on, or refused in one line."""

import math
from collections.abc import Collection, Iterable
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import ViewError
from refseq.view import Scan, View

VALID_IMAGE = "(height, width) of uint8, or (height, width, 3) in the order red, green, blue"
VALID_RANGES = "(n,) of float32 [m], inf or NaN where nothing came back"


def usable(view: View, sensors: Collection[str] | None = None) -> View:
    """The view with grey images, of these ``sensors`` alone where they are given; a scan stays.

    Colour images, (height, width, 3 or 4) uint8 in the order red, green, blue, become grey. Raises ``ViewError`` for
    images of other numbers or shapes, for ranges that are no row of numbers, and for a time that is not finite. A
    motion that is not finite stays: a localiser takes it as not measured.
    """
    if not math.isfinite(view.time):
        raise ViewError(f"a view's time is {view.time} s; valid is a finite number")
    cameras = view.images if sensors is None else [name for name in view.images if name in sensors]
    images = {name: _grey(view.images[name], name, view.time) for name in cameras}
    return replace(view, images=images, scan=None if view.scan is None else _scan(view.scan, view.time))


def check_motions(views: Iterable[View]) -> None:
    """Raise ``ViewError`` for a motion that is not finite: a map lies along its drive's odometry."""
    for number, view in enumerate(views):
        for name, value, unit in (("distance", view.distance, "m"), ("turn", view.turn, "rad")):
            if not math.isfinite(value):
                raise ViewError(f"view {number} at {view.time:g} s: {name} {value} {unit}; valid is a finite number")


def _grey(image: NDArray[np.uint8], camera: str, time: float) -> NDArray[np.uint8]:
    found = np.asarray(image)
    channels = found.shape[2] if found.ndim == 3 else 1
    if found.dtype != np.uint8 or found.ndim not in (2, 3) or not found.size or channels not in (1, 3, 4):
        raise ViewError(f"view at {time:g} s: {camera}: an image of {_described(found)}; valid is {VALID_IMAGE}")
    if found.ndim == 2:
        return image
    if channels == 1:
        return found[:, :, 0]
    return np.asarray(cv2.cvtColor(found, cv2.COLOR_RGB2GRAY if channels == 3 else cv2.COLOR_RGBA2GRAY), np.uint8)


def _scan(scan: Scan, time: float) -> Scan:
    ranges = np.asarray(scan.ranges)
    if ranges.ndim != 1 or ranges.dtype.kind not in "fiu":
        raise ViewError(f"view at {time:g} s: laser: ranges of {_described(ranges)}; valid is {VALID_RANGES}")
    return (
        scan if ranges is scan.ranges and ranges.dtype.kind == "f" else replace(scan, ranges=ranges.astype(np.float32))
    )


def _described(array: NDArray[np.generic]) -> str:
    return f"{array.shape} {array.dtype}"
