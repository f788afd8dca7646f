"""Survey of a log: one pass over its samples, which keeps clocks and a few pictures and scans."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from refseq.logs.decoding.picture import LazyPicture, damage
from refseq.logs.findings import Findings
from refseq.logs.source import Channel, Content, LogSource, Role, Sample
from refseq.view import ASSUMED, Scan
from refseq_bench.scenarios.log_tools.timing import Timing, TopicClock

if TYPE_CHECKING:  # a list of topics plans no views
    from refseq.logs.pairing.plan import ViewPlan

KEPT = 8
"""Most samples that are kept of a camera or laser, spread over the log."""

APART = 60.0
"""Topics that lie nearer in time are of one drive [s], as where a camera is switched on late."""


@dataclass(frozen=True, slots=True)
class TopicSurvey:
    """A topic: its channel, its clock, and the frame of its messages.

    ``timing`` has the counts of the channel alone where nothing is read from it. ``samples`` are some of a camera's or
    a laser's, evenly spread.
    """

    channel: Channel
    timing: Timing
    frame: str = ""
    samples: tuple[Sample, ...] = ()

    @property
    def name(self) -> str:
        """The topic."""
        return self.channel.topic


@dataclass(frozen=True, slots=True)
class LogSurvey:
    """A log as one pass over it has found it."""

    source: LogSource
    topics: tuple[TopicSurvey, ...]

    @property
    def start(self) -> float:
        """Earliest time of a message that is read [s]; NaN without any. Topics of ``other_times`` do not count."""
        return min((topic.timing.first for topic in self._common), default=math.nan)

    @property
    def duration(self) -> float:
        """Time from ``start`` to the latest message that is read [s]; NaN without any."""
        return max((topic.timing.last for topic in self._common), default=math.nan) - self.start

    @property
    def other_times(self) -> tuple[TopicSurvey, ...]:
        """Topics whose stamps lie so far from those of the others that no drive has both: their clock is another."""
        return tuple(topic for topic in self._driven if topic not in self._common)

    def zero(self, topic: TopicSurvey) -> float:
        """The stamp from which a topic's times are told [s]: the log's start, or its own if its times are others."""
        return topic.timing.first if topic in self.other_times else self.start

    @property
    def _driven(self) -> list[TopicSurvey]:
        """Topics that have a time; mounts and calibrations may be stamped long before the drive."""
        timed = [topic for topic in self.topics if not math.isnan(topic.timing.first)]
        return [topic for topic in timed if topic.channel.role not in (Role.TRANSFORMS, Role.CALIBRATION)] or timed

    @property
    def _common(self) -> list[TopicSurvey]:
        """Topics of one clock: those of the odometry, or of most messages where none has odometry."""
        groups = _by_times(self._driven)
        return max(groups, key=lambda group: (_has_odometry(group), sum(one.timing.count for one in group)), default=[])


def _by_times(topics: Sequence[TopicSurvey]) -> list[list[TopicSurvey]]:
    """Topics in groups that lie apart by more than ``APART``, and than the longest of them lasts."""
    limit = max(APART, max((topic.timing.duration for topic in topics), default=0.0))
    groups: list[list[TopicSurvey]] = []
    end = -math.inf
    for topic in sorted(topics, key=lambda one: one.timing.first):
        if topic.timing.first - end > limit:
            groups.append([])
        groups[-1].append(topic)
        end = max(end, topic.timing.last)
    return groups


def _has_odometry(topics: Sequence[TopicSurvey]) -> bool:
    return any(topic.channel.role is Role.ODOMETRY for topic in topics)


@dataclass(slots=True)
class _Spread:
    """Keeps at most ``KEPT`` of a stream of unknown length, evenly spread over it."""

    stride: int = 1
    seen: int = 0
    kept: list[Sample] = field(default_factory=list)

    def add(self, sample: Sample) -> None:
        if self.seen % self.stride == 0:
            self.kept.append(sample)
            if len(self.kept) > KEPT:
                del self.kept[1::2]
                self.stride *= 2
        self.seen += 1


@dataclass(slots=True)
class _TopicPass:
    """All that is collected of one topic on the way."""

    clock: TopicClock = field(default_factory=TopicClock)
    spread: _Spread = field(default_factory=_Spread)
    frame: str = ""

    def add(self, sample: Sample) -> None:
        self.clock.add(math.nan if sample.unstamped and sample.logged else sample.time, sample.logged)
        self.frame = self.frame or sample.frame
        if isinstance(sample.content, Scan) or is_picture(sample.content):
            self.spread.add(sample)

    def survey(self, channel: Channel) -> TopicSurvey:
        return TopicSurvey(channel, self.clock.timing(), self.frame, tuple(self.spread.kept))


def is_picture(content: Content) -> TypeGuard[LazyPicture]:
    """Tell pictures from all else that a sample may hold."""
    return hasattr(content, "decode")


def survey(source: LogSource, topics: Collection[str] | None = None) -> LogSurvey:
    """Read a log once, by default all topics that the bench has a use for. No picture is decoded."""
    passes: dict[str, _TopicPass] = {}
    for sample in source.samples(topics):
        passes.setdefault(sample.topic, _TopicPass()).add(sample)
    found = [
        passes[channel.topic].survey(channel)
        if channel.topic in passes
        else TopicSurvey(channel, Timing(channel.count if channel.role is Role.IGNORED else 0))
        for channel in source.channels
    ]
    return LogSurvey(source, tuple(found))


def motion_origin(findings: Findings) -> str:
    """Origin of the views' motion: the odometry, the truth where there is none, empty without both."""
    return findings.odometry or findings.truth


def is_assumed(plan: "ViewPlan") -> bool:
    """Tell whether the views' motion is assumed, as that from picture to picture: it tells nothing of units."""
    of_log = plan.findings.odometry.startswith("topic ")
    return of_log and plan.source.metadata.get("odometry", "").startswith(ASSUMED)


def topic_of(origin: str) -> str:
    """The topic that odometry or truth comes from; a text that is no topic's where it comes from elsewhere."""
    return origin.removeprefix("topic ")


def pictures_of(topic: TopicSurvey, count: int) -> tuple[tuple[float, LazyPicture], ...]:
    """Times [s] and pictures of at most ``count`` of a camera's samples, spread over the log; none of a laser.

    Damaged ones are left out, as views leave them out, where there are others.
    """
    every = [(one.time, one.content) for one in topic.samples if is_picture(one.content)]
    found = [(time, picture) for time, picture in every if not damage(picture)] or every
    chosen = np.unique(np.linspace(0, len(found) - 1, count).round().astype(int)).tolist() if found else []
    return tuple((found[k][0], found[k][1]) for k in chosen)


def scans_of(topic: TopicSurvey) -> list[Scan]:
    """Scans among a laser's samples, spread over the log; none of a camera."""
    return [one.content for one in topic.samples if isinstance(one.content, Scan)]


def scan_of(topic: TopicSurvey) -> Scan | None:
    """A scan from the middle of the log."""
    found = topic.samples[len(topic.samples) // 2].content if topic.samples else None
    return found if isinstance(found, Scan) else None
