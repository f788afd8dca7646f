"""Views of a log, planned by odometry before any picture is decoded, then read."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from refseq.errors import LogError
from refseq.logs.decoding.picture import LazyPicture
from refseq.logs.findings import Findings
from refseq.logs.pairing.images import EncodedPicture, PictureStore, ViewImages
from refseq.logs.pairing.moments import NONE, Moments
from refseq.logs.pairing.options import PairingOptions
from refseq.logs.pairing.schedule import Schedule, schedule
from refseq.logs.pairing.sensors import Choice, choose
from refseq.logs.pairing.survey import Survey, TopicStamps, survey
from refseq.logs.recording import Recording, views_of
from refseq.logs.scans import mounted
from refseq.logs.source import LogSource, Role
from refseq.logs.thin import chosen, thinned, with_odometry_noise
from refseq.logs.trajectory import Trajectory
from refseq.logs.transforms import TransformTree
from refseq.view import LASER, Scan, View

SAME_TIME = 1e-6
"""Times [s] so near to each other are one: files keep whole nanoseconds."""


@dataclass(frozen=True, slots=True)
class ViewPlan:
    """The views that a log will give: all but what their sensors see is known.

    ``views`` have time, motion, truth and behaviour; ``moments`` say which samples each is to be filled with. Choosing
    among them costs nothing; ``read`` passes over the log once and decodes what the plan still holds. ``stamps`` are
    those of the sensors' topics, all samples of the log. ``motion`` are the poses that the views' motion comes from, as
    the log has them; None without any.
    """

    source: LogSource
    findings: Findings
    views: tuple[View, ...]
    moments: Moments
    base: str
    tree: TransformTree
    stamps: Mapping[str, TopicStamps]
    motion: Trajectory | None = None

    def __len__(self) -> int:
        return len(self.views)

    def between(self, wanted: slice) -> "ViewPlan":
        """The plan of a stretch of the views, by their indices; the first one's motion stays as it was.

        Raises ``LogError`` for a step from view to view: what lies between would be left out of their motion.
        """
        if wanted.step not in (None, 1):
            raise LogError(f"views with a step of {wanted.step} are not valid; valid is a stretch, and to thin it")
        return self._of(np.arange(len(self.views))[wanted], self.views[wanted])

    def with_noise(self, rng: np.random.Generator) -> "ViewPlan":
        """The plan with noise on the motion of its views."""
        return replace(self, views=with_odometry_noise(self.views, rng))

    def thinned(self, distance: float, turn: float = np.inf) -> "ViewPlan":
        """The plan of a view whenever ``distance`` [m] or ``turn`` [rad] has been added up.

        Raises ``LogError`` for a log without odometry, which has nothing to add up.
        """
        if not any(view.has_odometry for view in self.views):
            raise LogError(
                f"{self.source.path}: has no odometry to thin by; valid are all its views, or odometry from elsewhere"
            )
        kept, views = thinned(self.views, distance, turn)
        return self._of(np.array(kept, np.intp), views)

    def at(self, times: Sequence[float]) -> "ViewPlan":
        """The plan of the views of some times [s], in order.

        Raises ``LogError`` for a time at which there is none.
        """
        there = [view.time for view in self.views]
        kept: list[int] = []
        for time in times:
            after = kept[-1] + 1 if kept else 0
            found = next((n for n in range(after, len(there)) if abs(there[n] - time) <= SAME_TIME), None)
            if found is None:
                raise LogError(
                    f"{self.source.path}: has no view {len(kept)} at {time:.6f} s; valid are beliefs of views of this "
                    "log, read with the same topics, tolerance and delays"
                )
            kept.append(found)
        return self._of(np.array(kept, np.intp), chosen(self.views, kept))

    def seen_by(self, sensors: Collection[str]) -> "ViewPlan":
        """The same views by some of the sensors: what others saw is not read."""
        topics = {topic for topic, name in self.findings.sensors.items() if name in sensors}
        return replace(self, moments=self.moments.of(topics))

    def _of(self, kept: NDArray[np.intp], views: tuple[View, ...]) -> "ViewPlan":
        return replace(self, views=views, moments=self.moments.chosen(kept))

    def other_sizes(self) -> Mapping[str, str]:
        """A sentence on the pictures of each topic that differ in size, where those of the planned views do."""
        samples = self.moments.samples
        told = {topic: self.stamps[topic].other_sizes(numbers.tolist()) for topic, numbers in samples.items()}
        return {topic: sentence for topic, sentence in told.items() if sentence}

    def read(self) -> Iterator[View]:
        """Read the views, in order. Raises ``LogError`` for a picture that cannot be decoded or is of another size."""
        for topic, sentence in self.other_sizes().items():
            raise LogError(f"{self.source.path}: topic {topic}: {sentence}")
        return _filled(self)

    def recording(self) -> Recording:
        """Read the views and all that is known of the log."""
        views = tuple(self.read())
        source = self.source
        return Recording(views, source.metadata, source.complete, source.skipped, self.findings)


def plan_views(source: LogSource, options: PairingOptions | None = None) -> ViewPlan:
    """Pass over a log and plan its views. Raises ``LogError`` where there is none, and for options that do not fit."""
    asked = options or PairingOptions()
    found = survey(source)
    choice = choose(found, asked)
    if why := _unreadable(source, choice):
        raise LogError(f"{source.path}: {why}")
    if not choice.sensors:
        raise LogError(f"{source.path}: {_nothing(source)}")
    lost = {topic: found.stamps[topic].lost for topic in choice.sensors}
    planned = schedule(found, choice, asked).without(lost)
    if not planned.data:
        raise LogError(f"{source.path}: holds no view: its pictures are damaged; valid is at least one that is whole")
    views = tuple(views_of(planned.data))
    stamps = {topic: found.stamps[topic] for topic in choice.sensors}
    told, track = _findings(found, choice, planned), choice.odometry or choice.truth
    motion = track.poses if track else None
    return ViewPlan(source, told, views, planned.moments, choice.base, found.tree, stamps, motion)


def _unreadable(source: LogSource, choice: Choice) -> str:
    """A sentence on a topic of which no message can be read, and without which views would be others; else empty.

    Without transforms nobody knows where a sensor looks, without odometry how far the robot went. Other sensors, and
    poses from elsewhere, do without it.
    """
    roles = {channel.topic: channel.role for channel in source.channels}
    missing = {Role.TRANSFORMS}
    if choice.odometry is None:
        missing.add(Role.ODOMETRY)
    if not choice.sensors:
        missing |= {Role.CAMERA, Role.LASER}
    told = (
        found.told for topic, found in sorted(source.unreadable.items()) if found.is_all and roles.get(topic) in missing
    )
    return next(told, "")


def _nothing(source: LogSource) -> str:
    """The reason why a log holds no view."""
    if not source.complete:
        return (
            f"is cut off or damaged before its first view: {source.damage}; valid is a recording of at least one view"
        )
    named = [f"{channel.topic} ({channel.count} {channel.schema})" for channel in source.channels]
    more = f", and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
    seen = f"its topics are {', '.join(named[:MOST_NAMED])}{more}" if named else "it has no topic"
    return f"holds no view: {seen}; valid is at least one camera or laser"


MOST_NAMED = 8
"""So many topics are named in a message."""


def _findings(found: Survey, choice: Choice, planned: Schedule) -> Findings:
    taken = {topic: int((numbers != NONE).sum()) for topic, numbers in planned.moments.samples.items()}
    return Findings(
        channels={topic: stamps.findings() for topic, stamps in sorted(found.stamps.items())},
        sensors=choice.sensors,
        leading=planned.leading,
        tolerance=planned.tolerance,
        odometry=choice.odometry.origin if choice.odometry else "",
        truth=choice.truth.origin if choice.truth else "",
        length=choice.odometry.poses.length if choice.odometry else 0.0,
        views=len(planned.data),
        without_odometry=planned.without_odometry,
        without_truth=sum(one.truth is None for one in planned.data),
        unpaired={choice.sensors[topic]: found.stamps[topic].whole - count for topic, count in taken.items()},
        notes=(*found.notes, *_of_names(found.source), *choice.notes),
        damaged={sensor: found.stamps[topic].lost_at() for topic, sensor in choice.sensors.items()},
        deep={sensor: found.stamps[topic].deep_at() for topic, sensor in choice.sensors.items()},
        unreadable=dict(found.source.unreadable),
    )


def _of_names(source: LogSource) -> Iterator[str]:
    """A note on pictures whose names tell no time, where those of others do."""
    if "; " in (times := source.metadata.get("times", "")):
        yield f"times are {times}"


def _filled(plan: ViewPlan) -> Iterator[View]:
    """Views with what their sensors see, each as soon as it and those before are whole."""
    samples = plan.moments.samples
    wanted = {
        (topic, number): row
        for topic, numbers in samples.items()
        for row, number in enumerate(numbers.tolist())
        if number != NONE
    }
    left = [sum(numbers[row] != NONE for numbers in samples.values()) for row in range(len(plan.views))]
    seen: list[dict[str, NDArray[np.uint8] | EncodedPicture | Scan]] = [{} for _ in plan.views]
    counts = dict.fromkeys(samples, 0)
    store = PictureStore(plan.source.path)
    mount = cache(lambda frame: plan.tree.mount(frame, plan.base) if plan.base else None)
    done = 0
    for sample in plan.source.samples(tuple(counts)):
        row = wanted.get((sample.topic, counts[sample.topic]))
        counts[sample.topic] += 1
        if row is None:
            continue
        content, sensor = sample.content, plan.findings.sensors[sample.topic]
        if isinstance(content, Scan):
            seen[row][sensor] = mounted(content, mount(sample.frame))
        else:
            seen[row][sensor] = store.taken(sample.topic, cast(LazyPicture, content))
        left[row] -= 1
        while done < len(left) and not left[done]:
            yield _view(plan, done, seen[done])
            seen[done] = {}
            done += 1
    while done < len(left) and not left[done]:  # of which nothing is asked
        yield _view(plan, done, {})
        done += 1


def _view(plan: ViewPlan, row: int, seen: dict[str, NDArray[np.uint8] | EncodedPicture | Scan]) -> View:
    scan = seen.pop(LASER, None)
    images = {name: picture for name, picture in seen.items() if not isinstance(picture, Scan)}
    return replace(plan.views[row], images=ViewImages(images), scan=scan if isinstance(scan, Scan) else None)
