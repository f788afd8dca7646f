"""Sensors of a log that no map can be learnt with, by the samples that the survey kept."""

from collections.abc import Mapping

from refseq.errors import LogError
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.scans import range_doubt
from refseq_bench.scenarios.log_tools.survey import KEPT, LogSurvey, TopicSurvey, pictures_of, scans_of

UNIFORM = 1.0
"""Pictures whose grey levels all deviate less than this show nothing: a covered lens, or a driver that sends blanks."""


def troubles_of(found: LogSurvey, plan: ViewPlan | None) -> Mapping[str, str]:
    """Trouble of each sensor of the plan, by its name; sensors that are well are not named."""
    topics = {topic.name: topic for topic in found.topics}
    if plan is None:
        return {}
    sizes = plan.other_sizes()
    sensors = plan.findings.sensors.items()
    told = {name: sizes.get(topic) or _trouble(topics[topic], found) for topic, name in sensors}
    return {name: why for name, why in told.items() if why}


def _trouble(topic: TopicSurvey, found: LogSurvey) -> str:
    if scans := scans_of(topic):
        seeing = any(scan.returned.any() for scan in scans)
        return range_doubt(scans) if seeing else f"no beam came back in {len(scans)} scans"
    sizes, spreads = set(), [0.0]
    for time, picture in pictures_of(topic, KEPT):
        try:
            image = picture.decode()
        except LogError as error:
            return f"at {time - found.zero(topic):.1f} s {error}"
        sizes.add(f"{image.shape[1]} × {image.shape[0]}")
        spreads.append(float(image.std()))
    if sizes and max(spreads) < UNIFORM:
        return f"its pictures are of one grey level, {image.mean():.0f} of 255: it sees nothing"
    return f"its pictures are {' and '.join(sorted(sizes))} pixels; valid is one size" if len(sizes) > 1 else ""
