"""Choice of topics: which cameras, which laser, whose odometry and truth, and the names that sensors get."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from refseq.errors import LogError
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.survey import Survey, TopicStamps
from refseq.logs.source import Role
from refseq.logs.trajectories.table import PoseTable
from refseq.logs.trajectory import Trajectory
from refseq.view import ASSUMED, LASER

TAILS = frozenset(
    {"image", "image_raw", "image_color", "image_mono", "image_rect", "image_rect_color", "compressed", "video", "raw"}
)
"""Last words of a camera's topic that name its messages and not the camera."""

BASES = ("base_link", "base_footprint", "base", "robot")
ODOMETRY_FRAME, MAP_FRAMES = "odom", ("map", "world")


GivenPoses = str | Trajectory | PoseTable | None
"""A topic, or poses from elsewhere; None: those that the log has."""


@dataclass(frozen=True, slots=True)
class PoseTrack:
    """A trajectory, and where it comes from for messages.

    ``topic`` is that of the poses; it is empty where they have none, and where their times were set back.
    """

    origin: str
    poses: Trajectory
    topic: str = ""


@dataclass(frozen=True, slots=True)
class Choice:
    """Topics that views are made of (topic → sensor), odometry, truth, the robot's frame, and what was decided.

    ``late`` is how much later than the odometry's a topic's stamps are [s], of those that are.
    """

    sensors: dict[str, str]
    odometry: PoseTrack | None
    truth: PoseTrack | None
    base: str
    notes: tuple[str, ...]
    late: Mapping[str, float] = field(default_factory=dict)


def choose(found: Survey, options: PairingOptions) -> Choice:
    """Decide what is taken as what. Raises ``LogError`` for topics asked for that are not there."""
    _check_topics(found, options)
    notes: list[str] = []
    sensors = _sensors(found, options, notes)
    base = options.base or _base(found)
    late = _late(found, sensors, options.late)
    odometry = _odometry(found, options.odometry, base, late, notes)
    truth = _truth(found, options, base, late, notes)
    if truth is None and Role.TRUTH in options.late:
        raise LogError(f"{found.source.path}: has no true poses to be late; valid is a truth from elsewhere beside it")
    if odometry is None and truth is not None:
        notes.append(f"no odometry: motion is taken from the true poses of {truth.origin}")
    return Choice(sensors, odometry, truth, base, tuple(notes), late)


def _late(found: Survey, sensors: Mapping[str, str], asked: Mapping[str, float]) -> Mapping[str, float]:
    """Delay: how much later than the odometry's each sensor's stamps are [s], by topic; the truth's is at its track.

    Raises ``LogError`` for what is not in the log, and for no number.
    """
    for sensor, seconds in asked.items():
        if sensor not in {*sensors, *sensors.values(), Role.TRUTH}:
            valid = ", ".join((*sorted(sensors.values()), Role.TRUTH))
            raise LogError(f"{found.source.path}: late sensor {sensor!r} is not in it; valid are {valid}")
        if not math.isfinite(seconds):
            raise LogError(f"{found.source.path}: {sensor} late by {seconds} s is not valid; it should be finite")
    return {topic: asked.get(topic, asked.get(name, 0.0)) for topic, name in sensors.items()}


def _check_topics(found: Survey, options: PairingOptions) -> None:
    valid = {role: [s.channel.topic for s in found.of_role(role)] for role in Role}
    sensors = valid[Role.CAMERA] + valid[Role.LASER]
    for topic in (*options.names, *(options.topics or ())):
        _check(found, topic, "of a sensor", sensors)
    for poses in (options.odometry, options.truth):
        if isinstance(poses, str):
            _check(found, poses, "of poses", valid[Role.ODOMETRY] + valid[Role.TRUTH])


def _check(found: Survey, topic: str, what: str, valid: Sequence[str]) -> None:
    if topic in valid:
        return
    there = next((channel for channel in found.source.channels if channel.topic == topic), None)
    seen = f"holds {there.count} {there.schema}" if there else "is not in it"
    raise LogError(f"{found.source.path}: topic {topic!r} {what} {seen}; valid are {', '.join(valid) or 'none'}")


def _sensors(found: Survey, options: PairingOptions, notes: list[str]) -> dict[str, str]:
    cameras = [stamps.channel.topic for stamps in _cameras(found, notes)]
    lasers = [stamps.channel.topic for stamps in found.of_role(Role.LASER)]
    if options.topics is not None:
        cameras = [topic for topic in cameras if topic in options.topics]
        lasers = [topic for topic in lasers if topic in options.topics]
    told = {topic: found.stamps[topic].channel.sensor or sensor_name(topic) for topic in cameras}
    sensors = {topic: options.names.get(topic) or told[topic] for topic in sorted(cameras)}
    for topic in lasers:
        if options.names.get(topic, LASER) != LASER:
            name = options.names[topic]
            raise LogError(f"{found.source.path}: laser {topic} is named {name!r}; valid is {LASER!r}")
    if lasers:
        taken = _front(lasers, options)
        sensors[taken] = LASER
        if len(lasers) > 1:
            notes.append(f"laser {taken} is taken; {', '.join(one for one in lasers if one != taken)} is not")
    twice = sorted({name for name in sensors.values() if list(sensors.values()).count(name) > 1})
    if twice:
        topics = [topic for topic, name in sensors.items() if name == twice[0]]
        raise LogError(
            f"{found.source.path}: {', '.join(topics)} are both named {twice[0]!r}; valid is a name for each"
        )
    return sensors


def _cameras(found: Survey, notes: list[str]) -> Iterator[TopicStamps]:
    for stamps in found.of_role(Role.CAMERA):
        if stamps.depth:
            notes.append(f"topic {stamps.channel.topic}: depth ({stamps.depth}), not used")
        else:
            yield stamps


def _front(lasers: Sequence[str], options: PairingOptions) -> str:
    """The laser asked for by name, else one that says front, else the most frequent."""
    asked = [topic for topic in lasers if options.names.get(topic) == LASER]
    front = [topic for topic in lasers if "front" in topic.lower()]
    return (asked or front or list(lasers))[0]


def sensor_name(topic: str) -> str:
    """A camera's name by its topic: without the words that name messages, parts joined by '-'."""
    parts = [part for part in topic.split("/") if part]
    while len(parts) > 1 and parts[-1].lower() in TAILS:
        parts.pop()
    return "-".join(parts)


def _base(found: Survey) -> str:
    """The robot's frame: as the odometry names it, else by the names in use."""
    children = [stamps.child for stamps in found.of_role(Role.ODOMETRY) if stamps.child]
    known = [name for name in BASES if name in found.tree.frames]
    return (children + known + [""])[0]


def _odometry(
    found: Survey, asked: GivenPoses, base: str, late: Mapping[str, float], notes: list[str]
) -> PoseTrack | None:
    if asked is not None:
        return _given(found, asked, late, notes)
    topics = [stamps.channel.topic for stamps in found.of_role(Role.ODOMETRY)]
    if topics:
        if len(topics) > 1:
            notes.append(f"odometry {topics[0]} is taken; {', '.join(topics[1:])} is not")
        return _of_topic(found, topics[0])
    return _from_tree(found, base, (ODOMETRY_FRAME,))


def _truth(
    found: Survey, options: PairingOptions, base: str, late: Mapping[str, float], notes: list[str]
) -> PoseTrack | None:
    own = options.late.get(Role.TRUTH, 0.0)
    if options.truth is not None:
        return _given(found, options.truth, late, notes, own)
    topics = [stamps.channel.topic for stamps in found.of_role(Role.TRUTH)]
    return _of_topic(found, topics[0], own) if topics else _from_tree(found, base, MAP_FRAMES, own)


def _given(
    found: Survey,
    asked: str | Trajectory | PoseTable,
    late: Mapping[str, float],
    notes: list[str],
    own: float = 0.0,
) -> PoseTrack:
    """A topic, or poses from elsewhere, set back by what their ``own`` clock is late [s].

    Raises ``LogError`` for poses that do not belong to the log's time: that is the sensors', with clocks set right that
    are ``late`` [s], by topic.
    """
    if isinstance(asked, str):
        return _of_topic(found, asked, own)
    if isinstance(asked, Trajectory):
        return PoseTrack("a trajectory given", asked.earlier(own))
    sensors = [*found.of_role(Role.CAMERA), *found.of_role(Role.LASER)]
    right = [[time - late.get(stamps.channel.topic, 0.0) for time in stamps.times] for stamps in sensors]
    times = [time for stamps in right for time in stamps] or [0.0]
    if asked.numbered and sensors:
        notes.append(f"{asked.source.name}: its poses are numbered as the samples of {sensors[0].channel.topic}")
    notes.extend(f"{asked.source.name}: {note}" for note in asked.notes)
    numbered = right[0] if right else []
    try:
        poses = asked.within(min(times), max(times), found.source.path, numbered, own)
    except LogError as error:
        if (told := found.source.metadata.get("times", "")).startswith(ASSUMED):
            raise LogError(f"{error}; the log's times are {told}") from error
        raise
    return PoseTrack(str(asked.source), poses)


def _of_topic(found: Survey, topic: str, late: float = 0.0) -> PoseTrack:
    return PoseTrack(f"topic {topic}", found.trajectory(topic).earlier(late), "" if late else topic)


def _from_tree(found: Survey, base: str, frames: Sequence[str], late: float = 0.0) -> PoseTrack | None:
    for frame in frames:
        way = found.tree.trajectory(base, frame)
        if way is not None:
            return PoseTrack(f"transforms {frame} → {base}", way.earlier(late))
    return None
