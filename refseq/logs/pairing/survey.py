"""First pass over a log: stamps of all sensors, odometry, truth and transforms; no picture is decoded."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from refseq.errors import LogError
from refseq.logs.decoding.picture import CheckedPicture, DepthPictureError
from refseq.logs.findings import ChannelFindings
from refseq.logs.source import Channel, LogSource, Role, Sample
from refseq.logs.trajectory import Trajectory
from refseq.logs.transforms import TransformTree
from refseq.planar import Pose

JUMP = 1.0
"""A clock that falls by more than so much was set back [s]; by less, messages overtook each other."""
MOST_JUMPS = 100
"""More often no clock is set back: such a log has no order."""


@dataclass(slots=True)
class TopicStamps:
    """Times of one topic's samples in the order of the log [s], and the frame that the first one names."""

    channel: Channel
    times: list[float] = field(default_factory=list)
    logged: list[float] = field(default_factory=list)
    moments: list[int] = field(default_factory=list)
    unstamped: int = 0
    backward: int = 0
    frame: str = ""
    child: str = ""
    depth: str = ""
    """Encoding of the pictures if they are distances."""
    damaged: list[int] = field(default_factory=list)
    """Numbers of the pictures that cannot be decoded, as far as that is told without decoding."""
    deep: set[int] = field(default_factory=set)
    """Those of them that are whole, but of 16 bits."""
    sizes: dict[tuple[int, int], list[int]] = field(default_factory=dict)
    """Width and height of the others [pixels], as their heads have it, and the numbers of those that have it."""
    names: dict[int, str] = field(default_factory=dict)
    """Names of the pictures that are files of their own, by their numbers."""

    @property
    def lost(self) -> Sequence[int]:
        """The damaged pictures of a topic that has others: one that has none is not damaged, it is not read."""
        return self.damaged if len(self.damaged) < len(self.times) else ()

    @property
    def whole(self) -> int:
        """Number of samples that are not lost."""
        return len(self.times) - len(self.lost)

    def lost_at(self) -> tuple[str, ...]:
        """The damaged pictures in words."""
        return tuple(map(self.told, self.lost))

    def deep_at(self) -> tuple[str, ...]:
        """Those of them that are of 16 bits, in words."""
        return tuple(self.told(number) for number in self.lost if number in self.deep)

    def told(self, number: int) -> str:
        """A picture in words: the name of its file, or its time."""
        return self.names.get(number) or f"at {self.times[number]:.3f} s"

    def look_at(self, number: int, picture: CheckedPicture) -> None:
        """Note size and name of a picture, or that it is damaged."""
        if picture.name:
            self.names[number] = picture.name
        try:
            self.sizes.setdefault(picture.check(), []).append(number)
        except LogError as error:
            self.damaged.append(number)
            if isinstance(error, DepthPictureError):
                self.deep.add(number)

    @property
    def usual_size(self) -> tuple[int, int] | None:
        """Width and height of most pictures [pixels], as their heads have it; None without one."""
        return max(self.sizes, key=lambda size: len(self.sizes[size]), default=None)

    def other_sizes(self, taken: Collection[int]) -> str:
        """A sentence on those of the pictures ``taken`` that are not of the size of most; empty where all are."""
        wanted = set(taken)
        found = {size: kept for size, numbers in self.sizes.items() if (kept := wanted.intersection(numbers))}
        if len(found) < 2:
            return ""
        usual = max(found, key=lambda size: (len(found[size]), -min(found[size])))
        others = {min(numbers): size for size, numbers in found.items() if size != usual}
        first, count = min(others), sum(map(len, found.values())) - len(found[usual])
        return (
            f"{len(found[usual])} of its pictures are {usual[0]} × {usual[1]} pixels, {count} "
            f"{'is' if count == 1 else 'are'} not, the first {self.told(first)}: {others[first][0]} × "
            f"{others[first][1]}; valid is one size a camera"
        )

    def findings(self) -> ChannelFindings:
        """Rate, gaps and the like."""
        times, logged = np.array(self.times), np.array(self.logged)
        rising = np.unique(times)
        steps = np.diff(rising)
        longest = int(steps.argmax()) if len(steps) else 0
        return ChannelFindings(
            self.channel,
            first=float(rising[0]),
            last=float(rising[-1]),
            rate=1 / float(np.median(steps)) if len(steps) else 0.0,
            longest_gap=float(steps[longest]) if len(steps) else 0.0,
            gap_at=float(rising[longest]),
            backward=self.backward,
            duplicates=len(times) - len(rising),
            unstamped=self.unstamped,
            offset=float(np.median(logged - times)),
        )


@dataclass(slots=True)
class Survey:
    """All that the first pass found.

    ``poses`` by topic, ``behaviours`` in the order of the log, ``notes`` on its clocks.
    """

    source: LogSource
    stamps: dict[str, TopicStamps] = field(default_factory=dict)
    poses: dict[str, list[Pose]] = field(default_factory=dict)
    behaviours: list[str] = field(default_factory=list)
    tree: TransformTree = field(default_factory=TransformTree)
    notes: list[str] = field(default_factory=list)

    def of_role(self, role: Role) -> Iterator[TopicStamps]:
        """Topics of a role that have samples, the most frequent first."""
        found = [stamps for stamps in self.stamps.values() if stamps.channel.role is role]
        return iter(sorted(found, key=lambda stamps: (-len(stamps.times), stamps.channel.topic)))

    def trajectory(self, topic: str) -> Trajectory:
        """Poses of one topic."""
        return Trajectory.of(self.stamps[topic].times, self.poses[topic])


def survey(source: LogSource) -> Survey:
    """Read a log once. Raises ``LogError`` where the source does, and for transforms that form a cycle."""
    found = Survey(source)
    roles = {channel.topic: channel for channel in source.channels}
    clock = _LogClock()
    for sample in source.samples():
        channel = roles.get(sample.topic)
        if channel is None:  # a damaged log may name topics that it never declared
            continue
        stamps = found.stamps.setdefault(sample.topic, TopicStamps(channel, frame=sample.frame, child=sample.child))
        shift = 0.0 if source.has_moments else clock.shift(source.path, sample.topic, sample.logged)
        time = sample.time + shift
        stamps.backward += bool(stamps.times) and time < stamps.times[-1]
        stamps.times.append(time)
        stamps.logged.append(sample.logged + shift)
        stamps.moments.append(sample.moment)
        stamps.unstamped += sample.unstamped
        _take(found, channel.role, sample, time, sample.logged + shift)
    if not source.has_moments:
        found.notes += clock.notes
        _settle_clocks(found)
    return found


class _LogClock:
    """Log time that goes on where the clock was set back or another run was appended.

    A clock that is set back turns a topic's own times back. Where only those of one topic lie before another's, the
    topics were written one behind the other, as converters do, and no clock jumped.
    """

    def __init__(self) -> None:
        self._shift, self._last = 0.0, -np.inf
        self._last_of: dict[str, float] = {}
        self.notes: list[str] = []

    def shift(self, path: Path, topic: str, logged: float) -> float:
        """Seconds to add to the times of a topic's sample that was logged at ``logged`` [s].

        Raises ``LogError`` for a log at ``path`` in no order at all.
        """
        if self._last_of.get(topic, -np.inf) - (logged + self._shift) > JUMP:
            fall = self._last - (logged + self._shift)
            self.notes.append(f"the log's clock jumps back by {fall:.3f} s to {logged:.3f} s; later times are shifted")
            self._shift += fall
            if len(self.notes) > MOST_JUMPS:
                raise LogError(
                    f"{path}: its clock jumps back {len(self.notes)} times and more; valid is a log in order of time"
                )
        self._last_of[topic] = logged + self._shift
        self._last = max(self._last, logged + self._shift)
        return self._shift


def _settle_clocks(found: Survey) -> None:
    """Take log times for stamps throughout, where a sensor's own clock was set back."""
    used = [one for role in (Role.CAMERA, Role.LASER, Role.ODOMETRY, Role.TRUTH) for one in found.of_role(role)]
    falls = {one.channel.topic: float(-np.diff(one.times).min(initial=0.0)) for one in used}
    topic = max(falls, key=lambda one: falls[one], default="")
    if topic and falls[topic] > JUMP:
        found.notes.append(f"the stamps of {topic} jump back by {falls[topic]:.3f} s; the times of logging are used")
        for stamps in found.stamps.values():
            stamps.times = list(stamps.logged)
        found.tree.take_logged_times()


def _take(found: Survey, role: Role, sample: Sample, time: float, logged: float) -> None:
    """Keep what is small of one sample."""
    match role, sample.content:
        case ((Role.ODOMETRY | Role.TRUTH), Pose() as pose):
            found.poses.setdefault(sample.topic, []).append(pose)
        case Role.TRANSFORMS, tuple() as transforms:
            try:
                found.tree.add(transforms, time, logged)
            except LogError as error:
                raise LogError(f"{found.source.path}: topic {sample.topic}: {error}") from error
        case Role.BEHAVIOUR, str() as told:
            found.behaviours.append(told)
        case Role.CAMERA, content if getattr(content, "is_depth", False):
            found.stamps[sample.topic].depth = str(getattr(content, "encoding", ""))
        case Role.CAMERA, CheckedPicture() as picture:
            stamps = found.stamps[sample.topic]
            stamps.look_at(len(stamps.times) - 1, picture)
