"""Figures of a log in words: rows of its topics, and of the drive that it holds."""

import math
from typing import TYPE_CHECKING, NamedTuple

from refseq.view import ASSUMED
from refseq_bench.scenarios.log_tools.survey import LogSurvey, TopicSurvey, motion_origin
from refseq_bench.scenarios.report.words import IN_DAYS, duration_text, size_text
from refseq_bench.scenarios.tables import plural

if TYPE_CHECKING:  # a list of topics needs none of them
    from refseq_bench.scenarios.log_tools.checkup import LogCheckup
    from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset
    from refseq_bench.scenarios.log_tools.drift import OdometryDrift
    from refseq_bench.scenarios.log_tools.scan_statistics import ScanStatistics

NONE = "–"

TOPIC_HEADINGS = ("topic", "schema", ">messages", ">rate", ">jitter", ">pauses", "taken as")
DRIFT_HEADINGS = ("log", ">way", ">heading a metre", ">of a turn", ">by chance", ">length", ">farthest off")
LASER_HEADINGS = (
    "log", ">scans", ">beams", ">walls", ">off walls, median", ">90 %", ">no return", ">edges", ">median range",
)  # fmt: skip
INFO_HEADINGS = ("topic", "schema", "encoding", ">messages", ">rate", "role")


class Fact(NamedTuple):
    """A line about a log: what it is about, and what is so."""

    about: str
    text: str


def head_line(found: LogSurvey) -> str:
    """Kind, duration and completeness of a log."""
    whole = "complete" if found.source.complete else f"incomplete: {found.source.damage}"
    return f"{found.source.path}: {found.source.kind}, {_span_text(found.duration)}, {whole}"


def _span_text(seconds: float) -> str:
    """Time that a log lasts; no drive takes days, but a clock may jump by them."""
    if math.isnan(seconds):
        return NONE
    return f"{seconds:.1f} s" if seconds < IN_DAYS else f"{duration_text(seconds)} by its stamps"


def rate_text(topic: TopicSurvey) -> str:
    """A topic's rate [Hz]."""
    return NONE if math.isnan(topic.timing.rate) else f"{topic.timing.rate:.1f} Hz"


def topic_row(topic: TopicSurvey, taken: str) -> tuple[str, ...]:
    """Cells of a topic under ``TOPIC_HEADINGS``."""
    timing = topic.timing
    jitter = NONE if math.isnan(timing.jitter) else f"± {1000 * timing.jitter:.0f} ms"
    longest = timing.longest_gap
    pauses = f"{len(timing.gaps)}, {longest.length:.1f} s" if longest else NONE
    return (topic.name, topic.channel.schema, str(timing.count), rate_text(topic), jitter, pauses, taken)


def drift_row(name: str, drift: "OdometryDrift") -> tuple[str, ...]:
    """Cells of a log under ``DRIFT_HEADINGS``."""
    return (
        name,
        f"{drift.way:.0f} m",
        f"{math.degrees(drift.bend):+.2f}°",
        f"{100 * drift.turn:+.1f} %",
        f"{math.degrees(drift.walk):.2f}°/√m",
        f"{100 * drift.length:+.1f} %",
        f"{drift.off:.1f} m, {100 * drift.off / drift.way:.0f} %",
    )


def laser_row(name: str, scans: "ScanStatistics") -> tuple[str, ...]:
    """Cells of a log under ``LASER_HEADINGS``."""
    counts = (str(scans.scans), str(scans.beams), str(scans.walls))
    off = (f"{1000 * value:.1f} mm" if scans.walls else "–" for value in (scans.residual_median, scans.residual_p90))
    shares = (f"{100 * scans.none:.1f} %", f"{100 * scans.edges:.1f} %")
    return (name, *counts, *off, *shares, f"{scans.median_range:.1f} m")


def info_row(topic: TopicSurvey) -> tuple[str, ...]:
    """Cells of a topic under ``INFO_HEADINGS``."""
    channel = topic.channel
    return (topic.name, channel.schema, channel.encoding, str(channel.count), rate_text(topic), str(channel.role))


def facts_of(checkup: "LogCheckup") -> list[Fact]:
    """The drive in a few lines: how far, how many views, the sensors' clocks, the cost of learning."""
    plan = checkup.plan
    if plan is None:
        return []
    found = [Fact("drive", _drive(checkup)), Fact("views", _views(checkup))]
    if told := [f"{name} {_lag(offset)}" for name, offset in checkup.offsets.items() if offset is not None]:
        found.append(Fact("clocks", f"{', '.join(told)}, by the turns that sensors and odometry see"))
    if checkup.cost is not None:
        size, seconds = size_text(checkup.cost.memory), duration_text(checkup.cost.learning)
        found.append(Fact("cost", f"{size} of pictures and scans; learning about {seconds} on this machine"))
    return found


def _drive(checkup: "LogCheckup") -> str:
    way, findings = checkup.travel, checkup.plan.findings if checkup.plan else None
    if findings is None or not motion_origin(findings):
        return "unknown: the log has no odometry"
    turns = f"{plural(way.left_turns, 'turn')} to the left, {way.right_turns} to the right"
    twice = f"; {100 * way.revisited:.0f} % of it driven twice" if way.revisited else ""
    return (
        f"{way.length:.1f} m by {motion_origin(findings)} in {_side(way.width)} × {_side(way.height)} m; {turns}{twice}"
    )


def _side(metres: float) -> str:
    return f"{metres:.0f}" if metres >= 1 else f"{metres:.1f}"


def _views(checkup: "LogCheckup") -> str:
    plan, thin = checkup.plan, checkup.selection.thin
    whole = plural(len(plan) if plan else 0, "view")
    if plan and plan.findings.leading:
        whole += f" at the times of {plan.findings.leading}, others within {1000 * plan.findings.tolerance:.0f} ms"
    if checkup.selection.late:
        whole += f", with --late {checkup.selection.late}"
    if (times := checkup.survey.source.metadata.get("times", "")).startswith(ASSUMED):
        whole += f", times {times}"
    return f"{whole}; {checkup.views} of them with --thin {thin:g}" if thin else whole


def _lag(offset: "ClockOffset") -> str:
    within = f"(± {max(offset.error, 0.01):.2f} s)"
    if not offset.differs():
        return f"on time {within}"
    return f"{abs(offset.lag):.2f} s {'late' if offset.lag > 0 else 'early'} {within}"
