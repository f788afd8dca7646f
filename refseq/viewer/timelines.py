"""The time lines that all tabs share: number of the view, simulated or logged time, distance travelled."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import rerun as rr

from refseq.view import View

VIEW, TIME, DISTANCE = "view", "time", "distance_cm"
"""Their names. Rerun counts or tells time, it knows no metres: the distance is a count of centimetres."""


@dataclass(frozen=True, slots=True)
class TimePoint:
    """When something was: the ``view``'s number, its ``time`` [s], and the ``distance`` travelled up to it [m].

    A map's places have no time: ``None``.
    """

    view: int
    time: float | None
    distance: float


def time_points_of(views: Iterable[View]) -> Iterator[TimePoint]:
    """The moment of each view of a drive; a robot that reverses travels on."""
    travelled = 0.0
    for number, view in enumerate(views):
        travelled += abs(view.distance) if number else 0.0
        yield TimePoint(number, view.time, travelled)


def set_time_point(stream: rr.RecordingStream, moment: TimePoint) -> None:
    """Set the time point of what is logged next; ``stream.reset_time()`` ends that."""
    stream.reset_time()
    stream.set_time(VIEW, sequence=moment.view)
    if moment.time is not None:
        stream.set_time(TIME, duration=moment.time)
    stream.set_time(DISTANCE, sequence=round(100 * moment.distance))
