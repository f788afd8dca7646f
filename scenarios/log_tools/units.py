"""Doubts about a log's lengths: a robot or a laser that no one has, as where millimetres stand for metres."""

from collections.abc import Iterator

import numpy as np

from refseq.logs.pairing.plan import ViewPlan
from refseq.view import LASER
from refseq_bench.scenarios.drives.odometry_doubts import odometry_doubts
from refseq_bench.scenarios.log_tools.survey import LogSurvey, is_assumed, motion_origin, scans_of

FARTHEST = 250.0
"""No laser has half of its ranges beyond [m]."""


def unit_doubts(found: LogSurvey, plan: ViewPlan) -> Iterator[str]:
    """A sentence for what is as long as nothing is."""
    motion = motion_origin(plan.findings)
    if motion and not is_assumed(plan):
        yield from (f"{motion}: {told}" for told in odometry_doubts(plan.views, found.start))
    for topic in found.topics:
        scans = scans_of(topic) if plan.findings.sensors.get(topic.name) == LASER else []
        ranges = np.concatenate([np.zeros(0), *(scan.ranges[scan.returned] for scan in scans)])
        if len(ranges) and (usual := float(np.median(ranges))) > FARTHEST:
            yield f"{topic.name}: half of its ranges are beyond {usual:.0f} m: are they in metres?"
