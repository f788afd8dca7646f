"""Sensors of a log that no map can be learnt with, by the samples that the survey kept."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from refseq.dead_reckoning import way_along
from refseq.errors import LogError
from refseq.health.pictures import picture_doubt
from refseq.logs.pairing.plan import ViewPlan
from refseq.view import LASER, Scan
from refseq_bench.scenarios.drives.inputs import SHORT
from refseq_bench.scenarios.drives.odometry_doubts import laser_doubt
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
    told = {name: sizes.get(topic) or _trouble(topics[topic], found, plan) for topic, name in sensors}
    return {name: why for name, why in told.items() if why}


def _trouble(topic: TopicSurvey, found: LogSurvey, plan: ViewPlan) -> str:
    if scans := scans_of(topic):
        if not any(np.isfinite(scan.ranges).any() for scan in scans):
            return f"no beam came back in {len(scans)} scans"
        return laser_doubt(scans, plan.views, lambda numbers: _scans_at(plan, numbers))
    sizes, spreads, images = set[str](), [0.0], list[NDArray[np.uint8]]()
    for time, picture in pictures_of(topic, KEPT):
        try:
            image = picture.decode()
        except LogError as error:
            return f"at {time - found.zero(topic):.1f} s {error}"
        sizes.add(f"{image.shape[1]} × {image.shape[0]}")
        spreads.append(float(image.std()))
        images.append(image)
    if sizes and max(spreads) < UNIFORM:
        return f"its pictures are of one grey level, {image.mean():.0f} of 255: it sees nothing"
    if way_along(plan.views)[-1] > SHORT and (told := picture_doubt(images)):
        return told
    return f"its pictures are {' and '.join(sorted(sizes))} pixels; valid is one size" if len(sizes) > 1 else ""


def _scans_at(plan: ViewPlan, numbers: Sequence[int]) -> list[Scan | None]:
    """Scans of some of a plan's views; the log is read up to the last of them."""
    if not numbers:
        return []
    wanted = plan.seen_by([LASER]).at([plan.views[number].time for number in numbers])
    return [view.scan for _, view in zip(numbers, wanted.read(), strict=False)]
