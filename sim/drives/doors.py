"""Doors as behaviours look for them: the features' finder, set for a robot that wants to go through one."""

import math
from collections.abc import Sequence

from refseq.features.doors import DetectedDoor, DoorSettings, find_doors
from refseq.view import Scan
from refseq_bench.robots.signals import LaserScan

TO_CROSS = DoorSettings(edge=0.04, recess=0.0, probability=0.5, tilt=math.radians(20))
"""Settings of the door finder for doors that are to be crossed; all are choices.

A closed door counts, too, so that it can be refused: its leaf lies more than ``edge`` behind the wall's face, and
beams that it stops need no ``recess`` more. The robot has been sent to a door: one is as good as found at even odds,
where 0.4 m of wall beside it are seen, and a leaf that has swung to this side past the square may hide the wall."""


def doors_to_cross(scan: Scan) -> list[DetectedDoor]:
    """Openings and closed doors of a scan, most probable first, in the scanner's frame."""
    return find_doors(scan, TO_CROSS)


def doors_seen(scan: LaserScan) -> Sequence[DetectedDoor]:
    """The same for what the bench's laser sees; it gives whole scans, of which behaviours ask for less."""
    if not isinstance(scan, Scan):
        raise TypeError(f"scan is {type(scan).__name__}; valid is the {Scan.__name__} of a bench")
    return doors_to_cross(scan)
