"""Scans as a map keeps them: one range a degree of the whole turn, in centimetres."""

import numpy as np
from numpy.typing import NDArray

from refseq.view import Scan, View

DEGREES = 360
FARTHEST = 65000
"""No range is kept beyond [cm]: it is as good as no return."""


def panorama(scan: Scan) -> NDArray[np.uint16]:
    """Ranges by whole degrees from straight ahead, counter-clockwise, (360,) [cm]; 0 where nothing came back.

    A degree has the range of the beam nearest to it, if that is within half a degree or half the step of the beams.
    """
    kept = np.zeros(DEGREES, np.uint16)
    bearings = np.degrees(scan.bearings)
    off = np.abs(bearings - np.round(bearings))
    beams = np.flatnonzero(off <= max(0.5, np.degrees(abs(scan.step)) / 2))
    beams = beams[np.argsort(-off[beams], kind="stable")]  # of several beams the nearest is written last
    ranges = np.asarray(scan.ranges, np.float64)[beams]
    there = scan.returned[beams] & (100 * ranges <= FARTHEST)
    kept[np.round(bearings[beams]).astype(np.intp) % DEGREES] = np.where(there, np.round(100 * ranges), 0)
    return kept


def panoramas(views: list[View]) -> NDArray[np.uint16]:
    """Those of all views, (K, 360), zeros for a view without a scan; (0, 360) where no view has one."""
    if not any(view.scan is not None for view in views):
        return np.zeros((0, DEGREES), np.uint16)
    nothing = np.zeros(DEGREES, np.uint16)
    return np.stack([nothing if view.scan is None else panorama(view.scan) for view in views])
