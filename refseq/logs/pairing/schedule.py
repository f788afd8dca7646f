"""Moments of a log with the odometer's pose, the true pose and the behaviour at each."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.behaviours import behaviours_kept
from refseq.dead_reckoning import way_along
from refseq.errors import LogError
from refseq.logs.pairing.moments import NONE, Moments, default_tolerance, numbered, paired, period, sample_of, slowest
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.sensors import Choice, PoseTrack
from refseq.logs.pairing.survey import Survey
from refseq.logs.recording import TimedData, views_of
from refseq.logs.source import Role
from refseq.planar import Pose

MOST_REACH = 0.5
"""The longest time for which the first or last pose of an odometer stands [s]."""


@dataclass(frozen=True, slots=True)
class Schedule:
    """Moments and their data, one each, without what sensors see.

    ``leading`` is the topic that leads, empty where the log numbers its moments itself. ``without_odometry`` counts
    the moments that went because the odometry does not reach them.
    """

    moments: Moments
    data: tuple[TimedData, ...]
    leading: str = ""
    tolerance: float = 0.0
    without_odometry: int = 0

    def without(self, lost: Mapping[str, Sequence[int]]) -> "Schedule":
        """The schedule without some samples, topic → their numbers; a moment of which nothing else was seen is gone.

        A behaviour told there is told at the one before, so many metres behind it.
        """
        samples = {
            topic: np.where(np.isin(numbers, lost.get(topic, ())), NONE, numbers)
            for topic, numbers in self.moments.samples.items()
        }
        seen = np.any([numbers != NONE for numbers in samples.values()], axis=0)
        moments = replace(self.moments, samples=samples).chosen(seen)
        return replace(self, moments=moments, data=_with_behaviours(self.data, np.flatnonzero(seen).tolist()))


def _with_behaviours(data: Sequence[TimedData], kept: Sequence[int]) -> tuple[TimedData, ...]:
    """The data of the moments that are ``kept``, with the behaviours told at all of them."""
    told = [one.behaviour for one in data]
    if any(told):
        told = behaviours_kept(told, way_along(list(views_of(data))), kept)
        return tuple(replace(data[number], behaviour=words) for number, words in zip(kept, told, strict=True))
    return tuple(data[number] for number in kept)


def schedule(found: Survey, choice: Choice, options: PairingOptions) -> Schedule:
    """Find the moments at which there is a view. Raises ``LogError`` for options that do not fit the log."""
    if not found.source.has_moments:
        return _by_time(found, choice, options)
    motion = choice.odometry or choice.truth
    if set(options.late) - {Role.TRUTH} and (len(choice.sensors) > 1 or motion is None or motion.topic):
        raise LogError(
            f"{found.source.path}: tells itself what belongs to one view; valid is a late sensor that is the only one, "
            "where odometry is given from elsewhere, or a late truth"
        )
    return _by_number(found, choice)


def _by_number(found: Survey, choice: Choice) -> Schedule:
    """The moments that the log knows; a pose is that of its own moment. Without odometry it is the true one."""
    ids = {topic: found.stamps[topic].moments for topic in choice.sensors}
    times = {
        topic: [time - choice.late.get(topic, 0.0) for time in found.stamps[topic].times] for topic in choice.sensors
    }
    moments = numbered(ids, times)
    odometry = _of_moments(found, moments, choice.odometry)
    truth = _of_moments(found, moments, choice.truth)
    told = [""] * len(moments)
    for stamps in found.of_role(Role.BEHAVIOUR):
        for row, number in enumerate(sample_of(moments.numbers, stamps.moments)):
            told[row] = found.behaviours[number] if number != NONE else told[row]
    # One frame alone: a step from the odometry's to the truth's is no motion.
    poses = truth if choice.odometry is None else odometry
    return Schedule(moments, _data(moments, poses, truth, told))


def _of_moments(found: Survey, moments: Moments, track: PoseTrack | None) -> list[Pose | None]:
    if track is None or not track.topic:
        return _at(track, moments.times, 0.0)
    poses = found.poses[track.topic]
    numbers = sample_of(moments.numbers, found.stamps[track.topic].moments)
    return [None if number == NONE else poses[number] for number in numbers]


def _by_time(found: Survey, choice: Choice, options: PairingOptions) -> Schedule:
    """Moments of the leading sensor; odometry and truth are interpolated at their times."""
    stamps = {topic: np.array(found.stamps[topic].times) - choice.late.get(topic, 0.0) for topic in choice.sensors}
    if options.tolerance is not None and not 0 <= options.tolerance < math.inf:
        raise LogError(
            f"{found.source.path}: tolerance {options.tolerance} s is not valid; "
            "it should be a number of seconds, 0 or more"
        )
    leading = _leading(found, choice, stamps, options.leading)
    tolerance = default_tolerance(stamps[leading]) if options.tolerance is None else options.tolerance
    moments = paired(stamps, leading, tolerance)
    motion = choice.odometry or choice.truth
    odometry = _at(motion, moments.times, tolerance)
    reached = np.array([motion is None or pose is not None for pose in odometry], bool)
    if not reached.any():
        assert motion is not None, "else all are reached"
        raise LogError(
            f"{found.source.path}: {motion.origin} lies at {_span(motion.poses.times)}, the views at "
            f"{_span(moments.times)}; valid is odometry at their times"
        )
    moments = moments.chosen(reached)
    poses = [pose for pose, there in zip(odometry, reached, strict=True) if there]
    truth = _at(choice.truth, moments.times, tolerance)
    told = _behaviours(found, moments.times)
    return Schedule(moments, _data(moments, poses, truth, told), leading, tolerance, int((~reached).sum()))


def _span(times: NDArray[np.float64]) -> str:
    return f"{times.min():.3f} to {times.max():.3f} s" if len(times) else "no time at all"


def _leading(found: Survey, choice: Choice, stamps: Mapping[str, NDArray[np.float64]], asked: str | None) -> str:
    if asked is None:
        return slowest(stamps)
    topics = [topic for topic, name in choice.sensors.items() if asked in (topic, name)]
    if not topics:
        valid = ", ".join(sorted(choice.sensors.values()))
        raise LogError(f"{found.source.path}: leading sensor {asked!r} is not in it; valid are {valid}")
    return topics[0]


def _at(track: PoseTrack | None, times: NDArray[np.float64], tolerance: float) -> list[Pose | None]:
    """Poses of a trajectory at the moments, None where it does not reach."""
    if track is None:
        return [None] * len(times)
    reach = min(MOST_REACH, max(tolerance, period(track.poses.times)))
    return [None if np.isnan(row[0]) else Pose(*row.tolist()) for row in track.poses.at(times, reach)]


def _behaviours(found: Survey, times: NDArray[np.float64]) -> list[str]:
    """The behaviour told at each moment, or since the one before."""
    told = [""] * len(times)
    for stamps in found.of_role(Role.BEHAVIOUR):
        for time, text in zip(stamps.times, found.behaviours, strict=True):
            at = int(np.searchsorted(times, time))
            if at < len(times):
                told[at] = text
    return told


def _data(
    moments: Moments, odometry: list[Pose | None], truth: list[Pose | None], told: list[str]
) -> tuple[TimedData, ...]:
    return tuple(
        TimedData(time, odometry=pose, truth=true, behaviour=text)
        for time, pose, true, text in zip(moments.times.tolist(), odometry, truth, told, strict=True)
    )
