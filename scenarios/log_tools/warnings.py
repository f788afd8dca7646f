"""Warnings about a log: clocks, pauses, offsets and samples that nothing is made of, each in a sentence."""

import math
from collections.abc import Iterator, Mapping

from refseq.logs.findings import Findings
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.source import EMPTY, NO_VALUE, Role
from refseq.logs.unreadable import sentences
from refseq.view import LASER
from refseq_bench.scenarios.log_tools.clocks.late import SensorClock, late_words
from refseq_bench.scenarios.log_tools.survey import LogSurvey, TopicSurvey, motion_origin, scans_of, topic_of
from refseq_bench.scenarios.log_tools.units import unit_doubts
from refseq_bench.scenarios.report.words import duration_text
from refseq_bench.scenarios.tables import plural

MUCH_UNPAIRED = 0.1
"""Share of a sensor's samples without a view from which on it is told."""

FALSE_GAIN = 0.3
"""The laser's turns may differ from the odometer's by this share."""


def warnings_of(found: LogSurvey, plan: ViewPlan | None, clocks: Mapping[str, SensorClock]) -> tuple[str, ...]:
    """Everything about a log that its owner should look at, in the order of weight."""
    lines: list[str] = []
    if not found.source.complete:
        lines.append(f"the log is incomplete: {found.source.damage}; what lies before is read")
    lines += _of_clocks(found)
    lines += _of_empty(found)
    if plan is None:
        lines += sentences(found.source.unreadable)
    else:
        lines += _of_sensor_clocks(plan.findings, clocks)
        lines += _of_pairing(found, plan.findings)
        lines += unit_doubts(found, plan)
        lines += _of_layouts(found, plan.findings)
    return tuple(lines)


def _of_empty(found: LogSurvey) -> Iterator[str]:
    """Warnings about messages that tell nothing, which ``LogSource.skipped`` counts by kind."""
    for kind, count in found.source.skipped.items():
        if kind.endswith(EMPTY):
            why = "before a key frame" if "Video" in kind else NO_VALUE
            yield f"{plural(count, 'message')} of {kind}: {why}"


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
        for line in (*_of_other_times(topic, found), *_of_clock(topic, found.zero(topic))):
            told.setdefault(line, []).append(topic.name)
    for line, topics in told.items():
        yield f"{', '.join(topics)}: {line}"


def _of_other_times(topic: TopicSurvey, found: LogSurvey) -> Iterator[str]:
    if topic in found.other_times:
        away = topic.timing.first - found.start
        lie = f"{duration_text(abs(away))} {'behind' if away > 0 else 'before'}"
        yield f"its stamps lie {lie} those of the others; its times are told from its own first message on"


def _of_clock(topic: TopicSurvey, start: float) -> Iterator[str]:
    timing = topic.timing
    if timing.zeros:
        whole = "all stamps" if timing.zeros == timing.count else plural(timing.zeros, "stamp")
        yield f"{whole} of zero: the time of logging stands for them"
    if topic.channel.role is Role.TRANSFORMS:  # of many clocks, and only when something moves
        return
    if timing.backwards:
        yield f"the clock jumps back {plural(timing.backwards, 'time')}"
    if timing.duplicates:
        yield f"{plural(timing.duplicates, 'message')} with the stamp of the one before"
    if (gap := timing.longest_gap) is not None:
        yield (f"{plural(len(timing.gaps), 'pause')}, the longest of {gap.length:.1f} s at {gap.start - start:.1f} s")


def _of_sensor_clocks(findings: Findings, clocks: Mapping[str, SensorClock]) -> Iterator[str]:
    """Warnings about sensors' clocks, and about turns that a sensor sees in another way than the odometry."""
    motion = motion_origin(findings)
    for topic, sensor in findings.sensors.items():
        clock = clocks.get(sensor, SensorClock())
        if (late := clock.found) is not None:
            yield f"{topic}: {_of_delay(clock, motion)}; --late {late_words({sensor: late})[0]} sets them right"
        if (offset := clock.offset) is None:
            continue
        if not clock.agrees:
            yield (
                f"{topic}: sees the robot turn the other way than {motion} tells (correlation "
                f"{offset.correlation:.2f}): upside down, mirrored, or odometry of the wrong sign"
            )
        elif abs(offset.gain - 1) > FALSE_GAIN:
            yield f"{topic}: sees {100 * offset.gain:.0f} % of the turns that {motion} tells"


def _of_delay(clock: SensorClock, motion: str) -> str:
    """By how much a clock is off, and what tells it."""
    offset = clock.offset if clock.agrees else None
    if clock.other:
        turns = f", {offset.lag:+.2f} s by the turns that both see" if offset else ""
        return f"stamped by another clock than {topic_of(motion)}: {clock.logged:+.2f} s by the times of logging{turns}"
    assert offset is not None, "nothing else tells a delay"
    word = "late" if offset.lag > 0 else "early"
    return (
        f"its stamps are {abs(offset.lag):.2f} s {word} against {motion}, by the turns that both see (correlation "
        f"{offset.correlation:.2f})"
    )


def _of_pairing(found: LogSurvey, findings: Findings) -> Iterator[str]:
    yield from findings.notes
    yield from findings.losses()
    if findings.without_odometry:
        yield f"{plural(findings.without_odometry, 'moment')} without odometry: no view"
    counts = {topic.name: topic.timing.count for topic in found.topics}
    for topic, sensor in findings.sensors.items():
        left = findings.unpaired.get(sensor, 0)
        if topic != findings.leading and left > MUCH_UNPAIRED * counts[topic] and not _faster(found, findings, topic):
            yield f"{topic}: {left} of {counts[topic]} messages are within {findings.tolerance:.3f} s of no view"


def _faster(found: LogSurvey, findings: Findings, topic: str) -> bool:
    """A sensor of a higher rate than the leading one has samples between views: nothing is wrong with that."""
    rates = {one.name: one.timing.rate for one in found.topics}
    return bool(findings.leading) and rates[topic] > 1.1 * rates[findings.leading]
