"""Doubts about a log's lengths: a robot or a laser that no one has, as where millimetres stand for metres."""

from collections.abc import Iterator

from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.scans import range_doubt
from refseq.view import LASER
from refseq_bench.scenarios.drives.odometry_doubts import odometry_doubts, size_doubts
from refseq_bench.scenarios.log_tools.survey import LogSurvey, is_assumed, motion_origin, scans_of


def unit_doubts(found: LogSurvey, plan: ViewPlan) -> Iterator[str]:
    """A sentence for what is as long as nothing is."""
    motion = motion_origin(plan.findings)
    if motion and not is_assumed(plan):
        yield from (f"{motion}: {told}" for told in odometry_doubts(plan.views, found.start))
    yield from size_doubts(plan)
    for topic in found.topics:
        if plan.findings.sensors.get(topic.name) == LASER and (told := range_doubt(scans_of(topic))):
            yield f"{topic.name}: {told}"
