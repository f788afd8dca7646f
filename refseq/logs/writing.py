"""Formats in which drives are written, and what of a drive a file can hold."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from refseq.errors import LogError
from refseq.intake import usable
from refseq.limits import METRES
from refseq.logs.closing import DriveWriter
from refseq.logs.rig import SensorRig
from refseq.planar import Pose
from refseq.view import View

LATEST = 2**31
"""Messages have their seconds in 32 bits, those of ROS 2 with a sign."""


def writable(view: View, odometry: Pose) -> View:
    """The view as a file can hold it, with grey pictures.

    Raises ``ViewError`` for one that is not ``usable``, and ``LogError`` for one without a finite pose of the odometer,
    from before the year 1970, when all clocks of logs begin, or from after 2038, when those of messages end.
    """
    if not isinstance(odometry, Pose):
        raise LogError(f"the odometer's pose is a {type(odometry).__name__}; valid is refseq.Pose")
    view = usable(view)
    if not 0 <= view.time < LATEST:
        raise LogError(f"a view is at {view.time:g} s; valid are seconds from 0 to {LATEST}")
    numbers = (odometry.x, odometry.y, odometry.heading)
    if not all(math.isfinite(number) and abs(number) <= METRES for number in numbers):
        where = f"view at {view.time:g} s: the odometer's pose"
        raise LogError(f"{where} is {numbers}; valid are numbers from {-METRES:g} to {METRES:g}")
    return view


def words_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """Metadata of a drive, as a file can hold them. Raises ``LogError`` for what is no text, or none in UTF-8."""
    for key, value in metadata.items():
        if not (isinstance(key, str) and isinstance(value, str)):
            raise LogError(f"metadata {key!r:.60} is {value!r:.60}; valid are texts, by names that are texts")
        try:
            f"{key}{value}".encode()
        except UnicodeEncodeError as error:  # half of a pair: a byte of a file's name that is no UTF-8
            raise LogError(f"metadata {key!r:.60} is {value!r:.60}; valid are texts that UTF-8 can hold") from error
    return dict(metadata)


class OutputFormat(Protocol):
    """A format in which drives are written."""

    def check(self, path: Path) -> None:
        """Raise ``LogError`` where a drive of this format cannot lie."""
        ...

    def open(self, path: Path, metadata: Mapping[str, str], rig: SensorRig | None = None) -> DriveWriter:
        """Begin a drive at ``path``; ``rig`` tells of mounts and calibrations where the format has a place for them.

        Raises ``LogError`` where it cannot be written.
        """
        ...
