"""Warnings about a log: clocks, pauses, offsets and samples that nothing is made of, each in a sentence."""

import math
from collections.abc import Iterator, Mapping

from refseq.logs.findings import Findings
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.source import EMPTY, NO_VALUE, Role
from refseq.view import LASER
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset
from refseq_bench.scenarios.log_tools.survey import LogSurvey, TopicSurvey, motion_origin, scans_of, topic_of
from refseq_bench.scenarios.log_tools.units import unit_doubts

OTHER_CLOCK = 0.25
"""Stamps whose delay differs so much from that of the odometry's come from another clock [s]."""

MUCH_UNPAIRED = 0.1
"""Share of a sensor's samples without a view from which on it is told."""

FALSE_GAIN = 0.3
"""The laser's turns may differ from the odometer's by this share."""


def warnings_of(found: LogSurvey, plan: ViewPlan | None, offsets: Mapping[str, ClockOffset | None]) -> tuple[str, ...]:
    """Everything about a log that its owner should look at, in the order of weight."""
    lines: list[str] = []
    if not found.source.complete:
        lines.append(f"the log is incomplete: {found.source.damage}; what lies before is read")
    lines += _of_clocks(found)
    lines += _of_empty(found)
    if plan is not None:
        lines += _of_other_clocks(found, plan.findings)
        lines += _of_offsets(plan.findings, offsets)
        lines += _of_pairing(found, plan.findings)
        lines += unit_doubts(found, plan)
        lines += _of_layouts(found, plan.findings)
    return tuple(lines)


def _of_empty(found: LogSurvey) -> Iterator[str]:
    """Warnings about messages that tell nothing, which ``LogSource.skipped`` counts by kind."""
    for kind, count in found.source.skipped.items():
        if kind.endswith(EMPTY):
            why = "before a key frame" if "Video" in kind else NO_VALUE
            yield f"{times(count, 'message')} of {kind}: {why}"


def _of_layouts(found: LogSurvey, findings: Findings) -> Iterator[str]:
    """A warning about a laser whose scans look another way from some time on."""
    for topic in found.topics:
        scans = scans_of(topic) if findings.sensors.get(topic.name) == LASER else []
        layouts = {f"{len(one.ranges)} beams from {math.degrees(one.start):.0f}°": None for one in scans}
        if len(layouts) > 1:
            yield f"{topic.name}: its scans have {' and '.join(layouts)}: what one layout does not see is not matched"


def _of_clocks(found: LogSurvey) -> Iterator[str]:
    """Warnings about the clock of each topic; topics of which the same is to be told share a line."""
    told: dict[str, list[str]] = {}
    for topic in found.topics:
        for line in _of_clock(topic, found.start):
            told.setdefault(line, []).append(topic.name)
    for line, topics in told.items():
        yield f"{', '.join(topics)}: {line}"


def _of_clock(topic: TopicSurvey, start: float) -> Iterator[str]:
    timing = topic.timing
    if timing.zeros:
        whole = "all stamps" if timing.zeros == timing.count else times(timing.zeros, "stamp")
        yield f"{whole} of zero: the time of logging stands for them"
    if topic.channel.role is Role.TRANSFORMS:  # of many clocks, and only when something moves
        return
    if timing.backwards:
        yield f"the clock jumps back {times(timing.backwards, 'time')}"
    if timing.duplicates:
        yield f"{times(timing.duplicates, 'message')} with the stamp of the one before"
    if (gap := timing.longest_gap) is not None:
        yield (f"{times(len(timing.gaps), 'pause')}, the longest of {gap.length:.1f} s at {gap.start - start:.1f} s")


def _of_other_clocks(found: LogSurvey, findings: Findings) -> Iterator[str]:
    topics = {topic.name: topic for topic in found.topics}
    motion = topic_of(motion_origin(findings))
    own = topics[motion].timing.delay if motion in topics else math.nan
    for topic, sensor in findings.sensors.items():
        apart = topics[topic].timing.delay - own
        if abs(apart) > OTHER_CLOCK:
            yield (
                f"{topic}: stamped by another clock than {motion}: {-apart:+.2f} s by the times of logging; "
                f"--late {sensor}={-apart:.2f} sets them right"
            )


def _of_offsets(findings: Findings, offsets: Mapping[str, ClockOffset | None]) -> Iterator[str]:
    motion = motion_origin(findings)
    for topic, sensor in findings.sensors.items():
        offset = offsets.get(sensor)
        if offset is None:
            continue
        if offset.correlation < 0:
            yield (
                f"{topic}: sees the robot turn the other way than {motion} tells (correlation "
                f"{offset.correlation:.2f}): upside down, mirrored, or odometry of the wrong sign"
            )
        elif offset.differs():
            word = "late" if offset.lag > 0 else "early"
            yield (
                f"{topic}: its stamps are {abs(offset.lag):.2f} s {word} against {motion}, by the turns that "
                f"both see (correlation {offset.correlation:.2f}); --late {sensor}={offset.lag:.2f} sets them right"
            )
        if offset.correlation > 0 and abs(offset.gain - 1) > FALSE_GAIN:
            yield f"{topic}: sees {100 * offset.gain:.0f} % of the turns that {motion} tells"


def _of_pairing(found: LogSurvey, findings: Findings) -> Iterator[str]:
    yield from findings.notes
    yield from findings.losses()
    if findings.without_odometry:
        yield f"{times(findings.without_odometry, 'moment')} without odometry: no view"
    counts = {topic.name: topic.timing.count for topic in found.topics}
    for topic, sensor in findings.sensors.items():
        left = findings.unpaired.get(sensor, 0)
        if topic != findings.leading and left > MUCH_UNPAIRED * counts[topic] and not _faster(found, findings, topic):
            yield f"{topic}: {left} of {counts[topic]} messages are within {findings.tolerance:.3f} s of no view"


def _faster(found: LogSurvey, findings: Findings, topic: str) -> bool:
    """A sensor of a higher rate than the leading one has samples between views: nothing is wrong with that."""
    rates = {one.name: one.timing.rate for one in found.topics}
    return bool(findings.leading) and rates[topic] > 1.1 * rates[findings.leading]


def times(count: int, word: str) -> str:
    """A count and its word, in the plural where it needs one."""
    return f"{count} {word}{'' if count == 1 else 's'}"
