"""Doubts about a drive: odometry that no robot has, a laser in other units than it, pictures too small for places."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from refseq.health.pictures import size_doubt
from refseq.health.range_unit import Scans, range_unit_doubt
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.scans import range_doubt, return_doubt
from refseq.logs.trajectories.course import HeadingDoubt, HeadingFault, heading_doubt
from refseq.view import FASTEST, Scan, View

SAME = 0.01
"""Views so near to each other in time tell no speed [s]."""
JUMP = 3.0
"""A shorter step is a jump only where no robot is so fast [m]."""
FASTER, USUAL, FEWEST = 5.0, 75, 10
"""A step has jumped that is so many times faster than this percentile of those on which the robot moved, where there
are so many."""
STANDS, SOBER = 0.05, 2.0
"""A robot of less speed stands, and any may go as fast as this for once [m/s]."""


class OdometryJump(NamedTuple):
    """A step of ``way`` [m] within ``seconds`` to view ``view``, counted before thinning, at ``time`` [s].

    ``steps`` are more than one where a view lies within the jump: its pose is one between both sides.
    """

    view: int
    way: float
    seconds: float
    time: float
    steps: int = 1


def odometry_jumps(views: Sequence[View]) -> list[OdometryJump]:
    """Steps that are faster than any robot, or far faster than this one goes; none where most of them are."""
    times, ways, lasts, speeds = _steps(views)
    moving = speeds[speeds > STANDS]
    usual = float(np.percentile(moving, USUAL)) if len(moving) >= FEWEST else np.inf
    fast = speeds > np.clip(FASTER * usual, SOBER, FASTEST)
    jumped = (fast & (ways > JUMP)) | (speeds > FASTEST)
    if 2 * jumped.sum() > len(speeds):
        return []
    found, over = [], 0
    for k in np.flatnonzero(jumped).tolist():
        begin = k - 1 if k > over and fast[k - 1] and not jumped[k - 1] else k
        over = k + 2 if k + 1 < len(fast) and fast[k + 1] and not jumped[k + 1] else k + 1
        step = slice(begin, over)
        found.append(
            OdometryJump(over, float(ways[step].sum()), float(lasts[step].sum()), float(times[begin]), over - begin)
        )
    return found


def without_jumps(views: Sequence[View]) -> list[View]:
    """The same views, at rest on each step that jumped: the robot was carried nowhere, its odometry began anew."""
    jumped = {view for jump in odometry_jumps(views) for view in range(jump.view - jump.steps + 1, jump.view + 1)}
    return [replace(view, distance=0.0, turn=0.0) if k in jumped else view for k, view in enumerate(views)]


def speed_doubt(views: Sequence[View]) -> str:
    """A sentence for poses that are no robot's in metres; empty for others."""
    *_, speeds = _steps(views)
    if 2 * (speeds > FASTEST).sum() <= len(speeds):
        return ""
    return f"the robot goes {np.median(speeds):.0f} m/s: are its poses in metres?"


def odometry_doubts(views: Sequence[View], start: float) -> Iterator[str]:
    """A sentence for poses that are no robot's in metres, or for those that jump; times from ``start`` [s] on."""
    if doubt := speed_doubt(views):
        yield doubt
    elif jumps := odometry_jumps(views):
        first = jumps[0]
        more = {1: "", 2: ", and once more"}.get(len(jumps), f", and {len(jumps) - 1} times more")
        yield (
            f"poses jump by {first.way:.1f} m within {first.seconds:.2f} s at {first.time - start:.1f} s{more}: "
            "read what lies before or behind (--views)"
        )


def course_doubts(plan: ViewPlan) -> Iterator[str]:
    """A sentence for headings that contradict the path of the same poses, over the views planned."""
    if plan.motion is None or not plan.views:
        return
    doubt = heading_doubt(plan.motion.between(plan.views[0].time, plan.views[-1].time))
    if doubt is not None:
        yield f"{plan.findings.odometry or plan.findings.truth}: {_of_headings(doubt)}"


def laser_doubt(some: Sequence[Scan], views: Sequence[View], scans: Scans) -> str:
    """A sentence for a laser that is in no metres, by ``some`` of its scans or by the way of ``views``; else empty.

    ``scans`` gives those of views, and is asked for a few.
    """
    return range_doubt(some) or range_unit_doubt(views, scans) or return_doubt(some)


def size_doubts(plan: ViewPlan) -> Iterator[str]:
    """A sentence for each camera whose pictures are too small to tell places apart."""
    for topic, sensor in plan.findings.sensors.items():
        size = plan.stamps[topic].usual_size
        if size is not None and (told := size_doubt(*size)):
            yield f"{sensor}: {told}"


def _of_headings(doubt: HeadingDoubt) -> str:
    share, way = f"{100 * doubt.share:.0f} %", f"{doubt.way:.0f} m"
    match doubt.fault:
        case HeadingFault.TURNED:
            side = "right" if doubt.angle > 0 else "left"
            turned = f"its headings point {abs(math.degrees(doubt.angle)):.0f}° to the {side} of its way"
            return f"{turned} throughout: a frame that is turned, as a camera's, or a robot that drives sideways"
        case HeadingFault.MIRRORED if abs(doubt.angle) > math.pi / 4:
            return "its headings turn against its path: x and y are swapped, or headings are bearings from north"
        case HeadingFault.MIRRORED:
            return "its headings turn against its path: they count clockwise, or one axis is mirrored"
        case HeadingFault.CONSTANT:
            return f"its heading stays the same while its path of {way} turns: poses without a heading"
        case HeadingFault.BACKWARD:
            back = f"by its headings the robot drives straight back over {share} of {way}"
            return f"{back}: if it does not, they are 180° off"
        case HeadingFault.ASIDE:
            return f"{share} of its way of {way} goes aside of its headings, as only a robot that drives sideways does"


def _steps(views: Sequence[View]) -> tuple[NDArray[np.float64], ...]:
    """Of each step from view to view its begin [s], way [m], time taken [s] and speed [m/s], 0 where nothing tells."""
    times = np.array([view.time for view in views], np.float64)
    ways = np.abs(np.array([view.distance for view in views], np.float64))[1:]
    lasts = np.diff(times)
    # Stamps of a log that was made of another one may stand still.
    speeds = np.divide(ways, lasts, out=np.zeros_like(ways), where=lasts > SAME)
    return times[:-1], ways, lasts, speeds
