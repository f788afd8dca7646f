"""Offsets of all sensors of a log to its odometer, told by the stretch in which the robot turns most."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.pairing.plan import ViewPlan
from refseq.logs.scans import mounted
from refseq.logs.source import Sample
from refseq.logs.transforms import Mount
from refseq.view import Scan
from refseq_bench.scenarios.log_tools.clocks.offsets import ClockOffset, clock_offset
from refseq_bench.scenarios.log_tools.clocks.shifts import picture_turns, scan_turns
from refseq_bench.scenarios.log_tools.survey import is_picture, motion_origin

STRETCH = 60.0
"""Length of the stretch that is looked at [s]: all of an hour would be decoded for a tenth of a second."""

MOST_SAMPLES = 500
"""Scans or pictures of a sensor that are looked at."""

COLUMNS = 160
"""Pictures are made so wide before they are compared [pixels]."""


@dataclass(slots=True)
class _Seen:
    """A sensor's stamps and scans, or rows of column means, in the stretch."""

    stamps: list[float] = field(default_factory=list)
    scans: list[Scan] = field(default_factory=list)
    profiles: list[NDArray[np.float32]] = field(default_factory=list)

    def add(self, sample: Sample, mount: Mount | None) -> None:
        if isinstance(sample.content, Scan):
            self.scans.append(mounted(sample.content, mount))
        elif is_picture(sample.content):
            image = sample.content.decode()
            height = max(1, round(len(image) * COLUMNS / image.shape[1]))
            small = cv2.resize(image, (COLUMNS, height), interpolation=cv2.INTER_AREA).astype(np.float32)
            profile = small.mean(axis=0)
            self.profiles.append(np.asarray(profile - profile.mean(), np.float32))
        self.stamps.append(sample.time)


def sensor_offsets(plan: ViewPlan, late: Mapping[str, float]) -> dict[str, ClockOffset | None]:
    """The offset of each sensor's clock to the odometer's, by its name; None where none can be told.

    It is looked for beside what the plan takes sensors to be ``late`` by [s], by their names.
    """
    times = np.array([view.time for view in plan.views])
    turns = np.array([view.turn for view in plan.views])
    findings, sensors = plan.findings, plan.findings.sensors
    # Where a clock was set back, views have other times than their samples' stamps.
    set_back = any("jump" in note for note in findings.notes)
    motion = motion_origin(findings)
    # A log that tells its moments has one clock for all, unless its motion comes from elsewhere.
    timed = findings.leading or not motion.startswith("topic ")
    if not motion or len(times) < 2 or not timed or set_back:
        return dict.fromkeys(sensors.values())
    begin = _most_turning(times, turns)
    seen = _samples(plan, {topic: late.get(name, 0.0) for topic, name in sensors.items()}, begin, begin + STRETCH)
    found = {name: _offset(seen.get(topic), times, np.cumsum(turns)) for topic, name in sensors.items()}
    return {name: one and replace(one, lag=one.lag + late.get(name, 0.0)) for name, one in found.items()}


def _most_turning(times: NDArray[np.float64], turns: NDArray[np.float64]) -> float:
    """The time from which on the robot turns most within ``STRETCH`` [s]."""
    total = np.concatenate([[0.0], np.cumsum(np.abs(turns))])
    ends = np.searchsorted(times, times + STRETCH)
    return float(times[(total[ends] - total[:-1]).argmax()])


def _samples(plan: ViewPlan, late: Mapping[str, float], begin: float, end: float) -> Mapping[str, _Seen]:
    """The samples of sensors in a stretch of time, set back by what their topics are ``late`` [s].

    A picture that cannot be decoded ends what is told of its topic.
    """
    seen: dict[str, _Seen] = {}
    over: set[str] = set()
    # As the views will have them: a laser that hangs upside down, and says so, sees no turn the other way.
    mount = cache(lambda frame: plan.tree.mount(frame, plan.base) if plan.base else None)
    for sample in plan.source.samples(tuple(late)):
        time = sample.time - late[sample.topic]
        if sample.topic in over or not begin <= time <= end:
            if time > end + 5.0:  # logs are written in order, but for a few seconds
                over.add(sample.topic)
            if len(over) == len(late):
                break
            continue
        found = seen.setdefault(sample.topic, _Seen())
        if len(found.stamps) < MOST_SAMPLES:
            try:
                found.add(replace(sample, time=time), mount(sample.frame))
            except LogError:
                over.add(sample.topic)
    return seen


def _offset(seen: _Seen | None, times: NDArray[np.float64], headings: NDArray[np.float64]) -> ClockOffset | None:
    if seen is None or len(seen.stamps) < 2:
        return None
    turns = scan_turns(seen.scans) if seen.scans else picture_turns(seen.profiles)
    found = clock_offset(np.array(seen.stamps), turns, times, headings)
    return found if found is None or seen.scans else ClockOffset(found.lag, found.correlation, error=found.error)
