"""Delays of sensors' clocks by all that tells of them, and the views of a drive with clocks set right."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from refseq.errors import LogError
from refseq.logs.findings import ChannelFindings
from refseq.logs.pairing import survey as stamps
from refseq.logs.pairing.moments import NONE
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.pairing.sensors import choose
from refseq.logs.source import LogSource, Role
from refseq_bench.scenarios.drives.inputs import DriveSelection, delays, pairing_options, plan_drive
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset
from refseq_bench.scenarios.log_tools.clocks.turns import sensor_offsets
from refseq_bench.scenarios.log_tools.survey import motion_origin, topic_of

OTHER_CLOCK = 0.25
"""Stamps whose delay differs so much from that of the odometry's come from another clock [s]."""

STILL_SEEN = 0.9
"""Share of its views that a sensor keeps when its clock is set right; at the log's ends there may be no odometry."""

Delays = dict[str, float]
"""Sensors' names, and by how much their stamps are late [s]."""


@dataclass(frozen=True, slots=True)
class SensorClock:
    """A sensor's clock against the odometer's.

    ``given`` [s] is the delay that the user tells, None without; ``logged`` [s] that by the times of logging, NaN where
    they tell none; ``offset`` the one by turns, None where they tell none.
    """

    given: float | None = None
    logged: float = math.nan
    offset: ClockOffset | None = None

    @property
    def other(self) -> bool:
        """By the times of logging it is another clock, and not set right by what the user tells."""
        return abs(self.logged - (self.given or 0.0)) > OTHER_CLOCK

    @property
    def agrees(self) -> bool:
        """The sensor sees the turns that the odometer tells, and not the other way round."""
        return self.offset is not None and self.offset.correlation > 0

    @property
    def found(self) -> float | None:
        """The delay that sets the clock right, to a hundredth [s]; None where it is as right as can be told.

        Turns outweigh the times of logging: a picture may be logged late by what its making took.
        """
        if self.offset is not None and self.agrees:
            return round(self.offset.lag, 2) if self.offset.differs(self.given or 0.0) else None
        return round(self.logged, 2) if self.other else None


@dataclass(frozen=True, slots=True)
class ClockedDrive:
    """Views of a drive with sensors' clocks set right, the ``selection`` that reads them so, and what was ``found``."""

    plan: ViewPlan
    selection: DriveSelection
    clocks: Mapping[str, SensorClock]
    found: Mapping[str, float]


def clocked_drive(source: LogSource, selection: DriveSelection) -> ClockedDrive:
    """Plan the views of a drive by what is told of its clocks; what the user tells of one is left as it is.

    Raises ``LogError`` where there is no view, however clocks are set.
    """
    plan, logged, given = _by_given(source, selection)
    other = {
        name: round(late, 2) for name, late in logged.items() if name not in given and SensorClock(None, late).other
    }
    plan, disbelieved = _by_logging(source, selection, plan, other)
    other, logged = ({name: one[name] for name in one if name not in disbelieved} for one in (other, logged))
    offsets = sensor_offsets(plan, {**other, **given})
    clocks = {name: SensorClock(given.get(name), logged.get(name, math.nan), one) for name, one in offsets.items()}
    found = {name: late for name, clock in clocks.items() if clock.given is None and (late := clock.found) is not None}
    if found != other or disbelieved:
        plan = plan_drive(source, with_late(selection, found))
    return ClockedDrive(plan, with_late(selection, found), clocks, found)


def _by_logging(
    source: LogSource, selection: DriveSelection, plan: ViewPlan | None, other: Delays
) -> tuple[ViewPlan, Collection[str]]:
    """The plan with clocks set right by the times of logging, and sensors of which they are not believed.

    A log may have been written long after the drive: then sensors set right by it are in fewer views than before.
    """
    if plan is not None and not other:
        return plan, ()
    try:
        right = plan_drive(source, with_late(selection, other))
    except LogError:
        if plan is None:
            raise
        return plan, other
    return right, [name for name in other if plan and _seen(right, name) < STILL_SEEN * _seen(plan, name)]


def _seen(plan: ViewPlan, sensor: str) -> int:
    """Number of views in which a sensor is."""
    topics = [topic for topic, name in plan.findings.sensors.items() if name == sensor]
    return sum(int((plan.moments.samples[topic] != NONE).sum()) for topic in topics)


def _by_given(source: LogSource, selection: DriveSelection) -> tuple[ViewPlan | None, Delays, Delays]:
    """The plan as the user tells clocks; delays by the times of logging, and those that the user tells.

    The plan is None where there is no view, but a clock that may be the reason. Raises ``LogError`` for any other.
    """
    try:
        plan = plan_drive(source, selection)
    except LogError:
        logged, given = _before_planning(source, selection)
        if not any(SensorClock(given.get(name), late).other for name, late in logged.items()):
            raise
        return None, logged, given
    found = plan.findings
    logged = _logged(found.channels, found.sensors, motion_origin(found)) if found.leading else {}
    return plan, logged, _given(selection, found.sensors)


def _before_planning(source: LogSource, selection: DriveSelection) -> tuple[Delays, Delays]:
    """Delays by the times of logging, and those that the user tells, of a log of which no view comes."""
    if source.has_moments:
        return {}, {}
    found = stamps.survey(source)
    choice = choose(found, pairing_options(selection))
    motion = choice.odometry or choice.truth
    channels = {topic: one.findings() for topic, one in found.stamps.items()}
    logged = _logged(channels, choice.sensors, motion.origin if motion else "")
    return logged, _given(selection, choice.sensors)


def _logged(channels: Mapping[str, ChannelFindings], sensors: Mapping[str, str], motion: str) -> Delays:
    """Delays of ``sensors``, topic → name, against where the ``motion`` comes from, by the times of logging [s]."""
    topic = topic_of(motion)
    if motion.startswith("transforms"):  # those that move are the most frequent ones
        moving = [one for one in channels.values() if one.channel.role is Role.TRANSFORMS]
        topic = max(moving, key=lambda one: one.channel.count).channel.topic if moving else ""
    if topic not in channels:
        return {}
    return {name: channels[topic].offset - channels[one].offset for one, name in sensors.items() if one in channels}


def _given(selection: DriveSelection, sensors: Mapping[str, str]) -> Delays:
    """Delays that the user tells, by the names of ``sensors``, topic → name."""
    return {sensors.get(key, key): late for key, late in delays(selection).items()}


def with_late(selection: DriveSelection, late: Mapping[str, float]) -> DriveSelection:
    """The selection, and some more sensors that are ``late`` [s]."""
    told = ([selection.late] if selection.late else []) + late_words(late)
    return replace(selection, late=",".join(told) or None)


def late_words(late: Mapping[str, float]) -> list[str]:
    """Delays as they are typed, one word a sensor."""
    return [f"{name}={seconds:.2f}" for name, seconds in late.items()]
