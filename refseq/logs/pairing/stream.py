"""Views of a source that does not end: paired, placed by odometry and thinned while samples arrive.

The rules are those of a log (``paired``, ``Trajectory.at``, ``Thinner``), over a window of the last samples. What
differs, as the future is not known: the leading sensor and the tolerance come from the first samples; a moment is
decided as soon as every sensor has told of a time behind it, or has kept silent for ``PATIENCE`` seconds (one that is
silent for twice as long is not waited for until it sends again); and of each transform the first alone is kept, which
tells how a sensor is mounted.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.decoding.picture import CheckedPicture, damage
from refseq.logs.pairing.moments import NONE, default_tolerance, paired, period, slowest
from refseq.logs.pairing.schedule import MOST_REACH
from refseq.logs.pairing.sensors import BASES, sensor_name
from refseq.logs.scans import mounted
from refseq.logs.source import Role, Sample
from refseq.logs.thin import Thinner
from refseq.logs.trajectory import Trajectory
from refseq.logs.transforms import TransformTree
from refseq.planar import Pose, motion_between
from refseq.view import LASER, Scan, View

PATIENCE = 1.0
"""A sensor that has been silent for so long is not waited for [s], or for two periods of the leading one if that is
longer. A smaller number pairs less where the line stutters, a larger one answers later where a sensor has died."""
FIRST_SAMPLES = 3
"""Samples of each topic from which its rate is taken; ``PATIENCE`` after the first sample those that came count."""
STANDSTILL = 5
"""Messages in a row with one stamp by which a topic's clock stands still; drivers send one twice now and then."""
BACKWARD = 1.0
"""A stamp that lies so far before the last one of its topic begins a new drive [s]: the log that is played begins
again, or the clock was set."""
MOST_WAITING = 20_000
"""The most samples that wait for their moment. More wait only where stamps stand still or odometry never comes."""
MOST_BYTES = 1 << 28
"""The most bytes of pictures and ranges among them."""


class ClockSetBackError(LogError):
    """Stamps went back: what comes now is another drive."""


@dataclass(frozen=True, slots=True)
class StreamTopics:
    """Topics to take: ``sensors`` maps a topic to its sensor's name; ``odometry`` is None where there is none.

    ``base`` is the robot's frame, empty: as the odometry names it.
    """

    sensors: Mapping[str, str]
    odometry: str | None = None
    base: str = ""


@dataclass(frozen=True, slots=True)
class _Pace:
    """Choices made from the first samples.

    ``leading`` leads, others are paired within ``tolerance``, stand in for it if they are ``apart`` from its samples,
    and are waited for with ``patience``; ``reach`` is that of odometry [s]. A sensor that is silent for its
    ``silence``, topic → [s], is not waited for until it sends again.
    """

    leading: str
    tolerance: float
    apart: float
    reach: float
    patience: float
    silence: Mapping[str, float]


@dataclass(slots=True)
class _Window:
    """The last samples of each topic, in the order of their stamps."""

    samples: dict[str, list[Sample]] = field(default_factory=dict)

    def add(self, sample: Sample) -> None:
        """Put a sample in its place; of several with one stamp the last counts, as in a log."""
        there = self.samples[sample.topic]
        at = len(there)
        while at and there[at - 1].time > sample.time:
            at -= 1
        there.insert(at, sample)

    def times(self, topic: str) -> NDArray[np.float64]:
        """Stamps of a topic [s]."""
        return np.array([sample.time for sample in self.samples[topic]])

    def newest(self, topic: str) -> float:
        """The latest stamp of a topic [s]."""
        there = self.samples[topic]
        return there[-1].time if there else -np.inf

    def forget(self, before: float) -> None:
        """Drop what lies before a time, but the last one of each topic."""
        for there in self.samples.values():
            gone = sum(sample.time < before for sample in there)
            del there[: max(0, gone - 1)]


class ViewStream:
    """Samples in, views out.

    ``distance`` [m] is the way by odometry from view to view; 0, and without odometry: every moment is a view.
    ``leading`` and ``tolerance`` are those of ``PairingOptions``, the former a topic or a sensor's name.
    """

    def __init__(
        self, topics: StreamTopics, distance: float, *, leading: str | None = None, tolerance: float | None = None
    ) -> None:
        self._topics, self._asked_leading, self._asked_tolerance = topics, leading, tolerance
        self._window = _Window({topic: [] for topic in (*topics.sensors, *filter(None, [topics.odometry]))})
        self._tree, self._base = TransformTree(), topics.base
        self._thinner = Thinner(distance if topics.odometry is not None else 0.0)
        self._pace: _Pace | None = None
        self._before: Pose | None = None
        self._last, self._first, self._newest = -np.inf, np.inf, -np.inf
        self.moments = self.late = self.without_odometry = 0
        self.damaged: dict[str, str] = {}
        """Topics with pictures that cannot be decoded, and why the first one cannot."""
        self.silent: dict[str, float] = {}
        """Topics that are not waited for, as they have sent nothing for so long [s]."""
        self.standing: dict[str, float] = {}
        """Topics of which ``STANDSTILL`` messages in a row had one stamp, and the last such stamp [s]."""
        self._repeats = dict.fromkeys(self._window.samples, 0)

    def take(self, sample: Sample) -> list[View]:
        """Take the next sample; gives the views that are decided by it, their pictures decoded.

        Views are without damaged pictures, of which ``damaged`` tells. Raises ``ClockSetBackError`` where a new drive
        begins, and ``LogError`` for a picture of no kind that is read and where more samples wait than are kept.
        """
        if not np.isfinite(sample.time):
            raise LogError(f"topic {sample.topic}: a stamp is {sample.time} s; valid is a finite number")
        if isinstance(sample.content, tuple):
            self._hang(sample)
        if sample.topic not in self._window.samples:
            return []
        if sample.time < self._window.newest(sample.topic) - BACKWARD:
            raise ClockSetBackError(
                f"topic {sample.topic}: the stamp went back from {self._window.newest(sample.topic):.3f} to "
                f"{sample.time:.3f} s"
            )
        self._note_repeat(sample)
        if sample.time <= self._last and sample.topic != self._topics.odometry:
            self.late += 1
            return []
        self._window.add(sample)
        self._first, self._newest = min(self._first, sample.time), max(self._newest, sample.time)
        if sample.topic == self._topics.odometry and sample.child:
            self._base = sample.child
        self._pace = self._pace or self._paced(at_last=False)
        self._check_waiting()
        if self._pace is None:
            return []
        self._note_silence(sample, self._pace)
        return list(self._views(self._pace, at_last=False))

    def mount_as(self, other: "ViewStream") -> None:
        """Take over where sensors are mounted from the stream of another drive: a robot tells it once."""
        self._tree, self._base = other._tree, other._base

    def end(self) -> list[View]:
        """Views of what is left, when no sample will come any more."""
        self._pace = self._pace or self._paced(at_last=True)
        return [] if self._pace is None else list(self._views(self._pace, at_last=True))

    def _hang(self, sample: Sample) -> None:
        """Keep the first transform of each frame: where a sensor is mounted; of others there is no end."""
        assert isinstance(sample.content, tuple)
        self._tree.add([one for one in sample.content if not self._tree.hangs(one.child)], sample.time)
        self._base = self._base or next((name for name in BASES if name in self._tree.frames), "")

    def _note_repeat(self, sample: Sample) -> None:
        again = sample.time == self._window.newest(sample.topic)
        self._repeats[sample.topic] = self._repeats[sample.topic] + 1 if again else 1
        if self._repeats[sample.topic] == STANDSTILL:
            self.standing[sample.topic] = sample.time

    def _note_silence(self, sample: Sample, pace: _Pace) -> None:
        """Give up sensors that are silent; odometry is waited for, as no view is without it."""
        self.silent.pop(sample.topic, None)
        for topic in self._topics.sensors.keys() - self.silent.keys():
            silence = self._newest - max(self._first, self._window.newest(topic))
            if silence > pace.silence[topic]:
                self.silent[topic] = silence

    def _check_waiting(self) -> None:
        waiting = self._window.samples.values()
        size = sum(_bytes_of(sample) for there in waiting for sample in there)
        count = sum(map(len, waiting))
        if count > MOST_WAITING or size > MOST_BYTES:
            raise LogError(
                f"{count} samples of {size >> 20} MiB wait for their moment; valid are at most {MOST_WAITING} of "
                f"{MOST_BYTES >> 20} MiB: do all stamps go on?"
            )

    def _paced(self, *, at_last: bool) -> _Pace | None:
        """Choose who leads as soon as every topic has a rate, or has had time to have one."""
        slow = [topic for topic, there in self._window.samples.items() if len(there) < FIRST_SAMPLES]
        if slow and not at_last and self._newest - self._first < max(PATIENCE, FIRST_SAMPLES * self._slowest_step()):
            return None
        stamps = {topic: self._window.times(topic) for topic in self._topics.sensors if self._window.samples[topic]}
        if not stamps:
            return None
        asked = [topic for topic in stamps if self._asked_leading in (topic, self._topics.sensors[topic])]
        leading = asked[0] if asked else slowest(stamps)
        tolerance = default_tolerance(stamps[leading]) if self._asked_tolerance is None else self._asked_tolerance
        odometry = self._topics.odometry
        step = period(self._window.times(odometry)) if odometry is not None else 0.0
        patience = max(PATIENCE, 2 * period(stamps[leading]))
        # A sensor whose messages come just within the patience has sent nothing for that and a period of its own.
        periods = {one: period(self._window.times(one)) for one in self._topics.sensors}
        return _Pace(
            leading,
            tolerance,
            apart=max(period(stamps[leading]), 2 * tolerance),
            reach=min(MOST_REACH, max(tolerance, step)),
            patience=patience,
            silence={one: patience + max(patience, 2 * own) for one, own in periods.items()},
        )

    def _slowest_step(self) -> float:
        return max((period(self._window.times(topic)) for topic in self._window.samples), default=0.0)

    def _views(self, pace: _Pace, *, at_last: bool) -> Iterator[View]:
        """Moments that are decided, as views."""
        there = [topic for topic in self._topics.sensors if self._window.samples[topic]]
        if pace.leading not in there or not (at_last or self._reached(pace) > self._last):
            return
        stamps = {topic: self._window.times(topic) for topic in there}
        moments = paired(stamps, pace.leading, pace.tolerance, pace.apart)
        for row, time in enumerate(moments.times.tolist()):
            if time <= self._last:
                continue
            if not (at_last or self._decided(time, stamps, pace)):
                break
            self._last = time
            numbers = {topic: int(found[row]) for topic, found in moments.samples.items() if found[row] != NONE}
            chosen = self._whole(self._window.samples[topic][number] for topic, number in numbers.items())
            view = self._placed(time, pace) if chosen else None
            if view is not None:
                self.moments += 1
                kept = self._thinner.take(view)
                if kept is not None:
                    yield self._filled(kept, chosen)
        self._window.forget(self._last - max(pace.tolerance, pace.patience))

    def _whole(self, samples: Iterable[Sample]) -> list[Sample]:
        """The samples but for damaged pictures, of which it is noted."""
        whole = []
        for sample in samples:
            reason = damage(sample.content) if isinstance(sample.content, CheckedPicture) else ""
            if reason:
                self.damaged.setdefault(sample.topic, reason)
            else:
                whole.append(sample)
        return whole

    def _decided(self, time: float, stamps: Mapping[str, NDArray[np.float64]], pace: _Pace) -> bool:
        """Tell whether no sample to come could change a moment.

        A sample that lies ``behind`` the moment may be nearer to the next one, at most as far behind it again, and that
        one's nearest may lie as far behind once more.
        """
        behind = 0.0
        for times in stamps.values():
            nearest = float(times[np.abs(times - time).argmin()]) - time
            behind = max(behind, nearest if nearest <= pace.tolerance else 0.0)
        return time + 3 * behind <= self._reached(pace)

    def _reached(self, pace: _Pace) -> float:
        """The time that every topic has told of, or has kept silent on for too long [s]."""
        heard = (self._window.newest(topic) for topic in self._window.samples if topic not in self.silent)
        return max(self._newest - pace.patience, min(heard))

    def _placed(self, time: float, pace: _Pace) -> View | None:
        """The moment's motion since the one before; None where the odometry does not reach it."""
        topic = self._topics.odometry
        if topic is None:
            return View(time, has_odometry=False)
        poses = self._window.samples[topic]
        track = Trajectory.of(
            (one.time for one in poses), (one.content for one in poses if isinstance(one.content, Pose))
        )
        row = track.at(time, pace.reach)[0]
        if np.isnan(row[0]):
            self.without_odometry += 1
            return None
        now = Pose(*row.tolist())
        distance, turn = motion_between(self._before, now) if self._before else (0.0, 0.0)
        self._before = now
        return View(time, distance=distance, turn=turn)

    def _filled(self, view: View, samples: Iterable[Sample]) -> View:
        images: dict[str, NDArray[np.uint8]] = {}
        scan: Scan | None = None
        for sample in samples:
            if isinstance(sample.content, Scan):
                mount = self._tree.mount(sample.frame, self._base) if self._base else None
                scan = mounted(sample.content, mount)
            else:
                images[self._topics.sensors[sample.topic]] = _decoded(sample)
        return replace(view, images=MappingProxyType(images), scan=scan)


def _bytes_of(sample: Sample) -> int:
    """Size of what is large in a sample: its picture or its ranges."""
    content = sample.content
    return content.ranges.nbytes if isinstance(content, Scan) else len(getattr(content, "data", b""))


def _decoded(sample: Sample) -> NDArray[np.uint8]:
    picture = sample.content
    assert hasattr(picture, "decode"), "topics of sensors hold pictures and scans"
    try:
        return picture.decode()
    except LogError as error:
        raise LogError(f"topic {sample.topic}: {error}") from error


def topics_for(
    roles: Mapping[str, Role], sensors: Collection[str], named: Mapping[str, str], odometry: str | None = None
) -> StreamTopics:
    """Choose among the topics of a robot, each with its role, those of the ``sensors`` that the map knows.

    A sensor's name is that in ``named`` (topic → sensor), else as a log would have it; ``odometry`` is a topic, by
    default the first. Raises ``LogError`` where no topic is one of the map's sensors, and where two are the same one.
    """
    found: dict[str, str] = {}
    for topic, role in sorted(roles.items()):
        name = named.get(topic) or (LASER if role is Role.LASER else sensor_name(topic))
        if role not in (Role.CAMERA, Role.LASER) or name not in sensors:
            continue
        if name in found.values():
            raise LogError(f"topic {topic}: is sensor {name!r}, as another topic is; valid is one topic a sensor")
        found[topic] = name
    if not found:
        seen = ", ".join(f"{topic} ({role.value})" for topic, role in sorted(roles.items())) or "none"
        raise LogError(
            f"no topic is a sensor of the map (topics: {seen}); valid sensors are {', '.join(sorted(sensors))}"
        )
    poses = sorted(topic for topic, role in roles.items() if role is Role.ODOMETRY)
    if odometry is not None and odometry not in poses:
        raise LogError(f"odometry topic {odometry!r} is not told of; valid are {', '.join(poses) or 'none'}")
    return StreamTopics(found, odometry or (poses[0] if poses else None))
