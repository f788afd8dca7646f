"""Surveys and checkups as plain values, for other programs."""

import math
from typing import TYPE_CHECKING

from refseq_bench.scenarios.log_tools.survey import LogSurvey, TopicSurvey

if TYPE_CHECKING:  # a list of topics needs none
    from refseq_bench.scenarios.log_tools.checkup import LogCheckup

Record = dict[str, object]


def info_record(found: LogSurvey) -> Record:
    """A log as ``refseq log info --json`` prints it; times in [s], rates in [Hz]."""
    source = found.source
    return {
        "path": source.path,
        "kind": source.kind,
        "start_s": found.start,
        "duration_s": found.duration,
        "complete": source.complete,
        "damage": source.damage,
        "topics": [_topic_record(topic) for topic in found.topics],
        "skipped": source.skipped,
        "unreadable": {topic: lost.told for topic, lost in source.unreadable.items()},
        "metadata": source.metadata,
    }


def _topic_record(topic: TopicSurvey) -> Record:
    channel, timing = topic.channel, topic.timing
    return {
        "topic": topic.name,
        "schema": channel.schema,
        "encoding": channel.encoding,
        "role": channel.role,
        "frame": topic.frame,
        "messages": channel.count,
        "rate_hz": timing.rate,
        "jitter_s": timing.jitter,
        "delay_s": timing.delay,
        "stamps_of_zero": timing.zeros,
        "duplicates": timing.duplicates,
        "clock_back": timing.backwards,
        "pauses": [{"at_s": gap.start, "length_s": gap.length} for gap in timing.gaps],
    }


def check_record(checkup: "LogCheckup") -> Record:
    """A checkup as ``refseq log check --json`` prints it; lengths in [m], times in [s], memory in [bytes]."""
    way, cost = checkup.travel, checkup.cost
    topics = [{**_topic_record(topic), "taken_as": checkup.taken[topic.name]} for topic in checkup.survey.topics]
    return {
        **info_record(checkup.survey),
        "topics": topics,
        "usable": checkup.usable,
        "verdicts": checkup.verdicts,
        "warnings": checkup.warnings,
        "views": len(checkup.plan) if checkup.plan else 0,
        "thin_m": checkup.selection.thin,
        "views_after_thinning": checkup.views,
        "length_m": way.length,
        "width_m": way.width,
        "height_m": way.height,
        "left_turns": way.left_turns,
        "right_turns": way.right_turns,
        "driven_twice": way.revisited,
        "clock_offsets_s": {name: one.lag if one else math.nan for name, one in checkup.offsets.items()},
        "memory_bytes": cost.memory if cost else None,
        "learning_s": cost.learning if cost else None,
    }
