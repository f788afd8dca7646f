"""Doubts about a log's lengths: a robot or a laser that no one has, as where millimetres stand for metres."""

from collections.abc import Iterator

import numpy as np

from refseq.logs.pairing.plan import ViewPlan
from refseq.view import LASER
from refseq_bench.scenarios.log_tools.survey import LogSurvey, motion_origin, scans_of

FASTEST = 30.0
"""No robot of this kind goes faster [m/s]."""
SAME = 0.01
"""Views so near to each other in time tell no speed [s]."""
FARTHEST = 250.0
"""No laser has half of its ranges beyond [m]."""


def unit_doubts(found: LogSurvey, plan: ViewPlan) -> Iterator[str]:
    """A sentence for what is as long as nothing is."""
    yield from _of_speed(plan, found.start)
    for topic in found.topics:
        scans = scans_of(topic) if plan.findings.sensors.get(topic.name) == LASER else []
        ranges = np.concatenate([np.zeros(0), *(scan.ranges[scan.returned] for scan in scans)])
        if len(ranges) and (usual := float(np.median(ranges))) > FARTHEST:
            yield f"{topic.name}: half of its ranges are beyond {usual:.0f} m: are they in metres?"


def _of_speed(plan: ViewPlan, start: float) -> Iterator[str]:
    """The way from view to view by the odometer, where there is one."""
    motion = motion_origin(plan.findings)
    if not motion or len(plan.views) < 2:
        return
    times = np.array([view.time for view in plan.views])
    ways, lasts = np.abs([view.distance for view in plan.views][1:]), np.diff(times)
    apart = lasts > SAME  # stamps of a log that was made of another one may stand still
    ways, lasts, begins = ways[apart], lasts[apart], times[:-1][apart]
    fast = np.flatnonzero(ways > FASTEST * lasts)
    if 2 * len(fast) > len(ways):
        yield f"{motion}: the robot goes {np.median(ways / lasts):.0f} m/s: are its poses in metres?"
    elif len(fast):
        at = int(fast[0])
        yield (
            f"{motion}: {len(fast)} of {len(ways)} steps are faster than {FASTEST:g} m/s, the first of {ways[at]:.1f} "
            f"m in {lasts[at]:.2f} s at {begins[at] - start:.1f} s"
        )
