"""First pass over a log: stamps of all sensors, odometry, truth and transforms; no picture is decoded."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from refseq.errors import LogError
from refseq.logs.findings import ChannelFindings
from refseq.logs.source import Channel, LogSource, Role, Sample
from refseq.logs.trajectory import Trajectory
from refseq.logs.transforms import TransformTree
from refseq.planar import Pose


@dataclass(slots=True)
class TopicStamps:
    """Times of one topic's samples in the order of the log [s], and the frame that the first one names."""

    channel: Channel
    times: list[float] = field(default_factory=list)
    logged: list[float] = field(default_factory=list)
    moments: list[int] = field(default_factory=list)
    unstamped: int = 0
    frame: str = ""
    child: str = ""
    depth: str = ""
    """Encoding of the pictures if they are distances."""

    def findings(self) -> ChannelFindings:
        """Rate, gaps and the like."""
        times, logged = np.array(self.times), np.array(self.logged)
        rising = np.unique(times)
        steps = np.diff(rising)
        longest = int(steps.argmax()) if len(steps) else 0
        return ChannelFindings(
            self.channel,
            float(rising[0]),
            float(rising[-1]),
            1 / float(np.median(steps)) if len(steps) else 0.0,
            float(steps[longest]) if len(steps) else 0.0,
            float(rising[longest]),
            int((np.diff(times) < 0).sum()),
            len(times) - len(rising),
            self.unstamped,
            float(np.median(logged - times)),
        )


@dataclass(slots=True)
class Survey:
    """All that the first pass found; ``poses`` by topic, ``behaviours`` in the order of the log."""

    source: LogSource
    stamps: dict[str, TopicStamps] = field(default_factory=dict)
    poses: dict[str, list[Pose]] = field(default_factory=dict)
    behaviours: list[str] = field(default_factory=list)
    tree: TransformTree = field(default_factory=TransformTree)

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
    for sample in source.samples():
        channel = roles.get(sample.topic)
        if channel is None:  # a damaged log may name topics that it never declared
            continue
        stamps = found.stamps.setdefault(sample.topic, TopicStamps(channel, frame=sample.frame, child=sample.child))
        stamps.times.append(sample.time)
        stamps.logged.append(sample.logged)
        stamps.moments.append(sample.moment)
        stamps.unstamped += sample.unstamped
        _take(found, channel.role, sample)
    return found


def _take(found: Survey, role: Role, sample: Sample) -> None:
    """Keep what is small of one sample."""
    match role, sample.content:
        case ((Role.ODOMETRY | Role.TRUTH), Pose() as pose):
            found.poses.setdefault(sample.topic, []).append(pose)
        case Role.TRANSFORMS, tuple() as transforms:
            try:
                found.tree.add(transforms, sample.time)
            except LogError as error:
                raise LogError(f"{found.source.path}: topic {sample.topic}: {error}") from error
        case Role.BEHAVIOUR, str() as told:
            found.behaviours.append(told)
        case Role.CAMERA, content if getattr(content, "is_depth", False):
            found.stamps[sample.topic].depth = str(getattr(content, "encoding", ""))
