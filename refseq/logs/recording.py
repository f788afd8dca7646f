"""A recorded drive, and the step from poses at the times of its views to their motion, which all log formats share."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from refseq.logs.findings import Findings
from refseq.planar import Pose, motion_between
from refseq.view import View


@dataclass(frozen=True, slots=True)
class Recording:
    """A drive: its views in order of time, what is known of how it was made, and whether its end is there.

    ``skipped`` counts the lines or messages of kinds that are not read, by kind. ``findings`` tell what reading a log
    has met; None for views that come from elsewhere.
    """

    views: tuple[View, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    complete: bool = True
    skipped: Mapping[str, int] = field(default_factory=dict)
    findings: Findings | None = None

    def __iter__(self) -> Iterator[View]:
        """The views, so that a recording serves wherever views do."""
        return iter(self.views)

    @property
    def has_odometry(self) -> bool:
        """Tell whether the motion of at least one view was measured."""
        return any(view.has_odometry for view in self.views)

    @property
    def sensors(self) -> frozenset[str]:
        """Names of the sensors that at least one view has."""
        return frozenset().union(*(view.sensors for view in self.views))


@dataclass(frozen=True, slots=True)
class TimedData:
    """Poses and behaviour that a log tells of one ``time`` [s]: all of a view but what its sensors see."""

    time: float
    odometry: Pose | None = None
    truth: Pose | None = None
    behaviour: str = ""


def views_of(data: Iterable[TimedData]) -> Iterator[View]:
    """One view for each time stamp; its distance and turn come from the odometer poses of it and the one before."""
    before: Pose | None = None
    for at in data:
        now = at.odometry
        measured = now is not None
        distance, turn = motion_between(before, now) if before and now else (0.0, 0.0)
        before = now or before
        yield View(at.time, distance=distance, turn=turn, truth=at.truth, behaviour=at.behaviour, has_odometry=measured)
