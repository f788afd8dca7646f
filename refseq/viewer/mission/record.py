"""Record of a mission for the viewer: its state from moment to moment, its views, its log."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from refseq.belief import Belief, LocaliserProtocol
from refseq.missions import Entry, Executor, Plan, Status
from refseq.planar import Pose
from refseq.view import View
from refseq.viewer.drawing.jpeg import jpeg

EVERY = 0.2
"""Period of the recorded states [s]; less makes files larger, changes are recorded in any case."""


@dataclass(frozen=True, slots=True)
class Instant:
    """State of a mission at a ``time`` [s], when the odometer had gone ``travelled`` [m].

    ``truth`` is where the robot truly was, ``along`` where it believed itself to be [m along its way]. The order in
    force is the one with this number; ``doing`` is the behaviour that ran, empty when the robot stood, and ``tasks``
    are those that it still had to do there.
    """

    time: float
    travelled: float
    truth: Pose | None
    along: float
    status: Status
    order: int
    doing: str
    tasks: tuple[str, ...]

    @classmethod
    def of(cls, executor: Executor, truth: Pose | None) -> "Instant":
        """The executor's state."""
        return cls(
            time=executor.time,
            travelled=executor.travelled,
            truth=truth,
            along=executor.along,
            status=executor.status,
            order=executor.number,
            doing=executor.doing,
            tasks=tuple(map(str, executor.tasks)),
        )

    def unlike(self, other: "Instant") -> bool:
        """True where something else was done."""
        ours, its = ((one.status, one.order, one.doing, one.tasks) for one in (self, other))
        return ours != its


@dataclass(frozen=True)
class LocalisedView:
    """A view on the way, without its images, what was believed of it, and its ``frames`` as JPEG, by camera."""

    instant: Instant
    view: View
    belief: Belief
    frames: Mapping[str, bytes]


@dataclass(frozen=True)
class LogLine:
    """A line of the log, how far the odometer had gone by then [m], and the number of the last view, None without."""

    entry: Entry
    travelled: float
    view: int | None


@dataclass(frozen=True)
class MissionRecord:
    """A mission that was run.

    ``places`` (n, 2) are the true positions of the places of the plan's way [m], or nothing where nobody knows them;
    ``outline`` are walls and the like, lines (m, 2) [m].
    """

    plan: Plan
    instants: Sequence[Instant]
    views: Sequence[LocalisedView]
    log: Sequence[LogLine]
    places: NDArray[np.float64]
    outline: Sequence[NDArray[np.float64]] = ()


class Recorder:
    """Keeps what a mission shows: the ``localiser`` that it is given is heard, and ``note`` is called every period.

    Of images only the small files are kept that are to be shown.
    """

    def __init__(self) -> None:
        self._instants: list[Instant] = []
        self._views: list[LocalisedView] = []
        self._log: list[LogLine] = []
        self._seen: list[tuple[View, Belief, dict[str, bytes]]] = []
        self._began: float | None = None
        self._executor: Executor | None = None

    def heard(self, localiser: LocaliserProtocol) -> LocaliserProtocol:
        """The localiser, of which each answer is heard."""
        return HeardLocaliser(localiser, self.saw)

    def saw(self, view: View, belief: Belief) -> None:
        """A view was taken, and this is believed of it."""
        frames = {name: jpeg(image) for name, image in view.images.items()}
        self._seen.append((replace(view, images={}), belief, frames))

    def note(self, executor: Executor, truth: Pose | None) -> None:
        """A period has gone by; the robot truly is there."""
        self._executor, now = executor, Instant.of(executor, truth)
        if not self._instants or now.time - self._instants[-1].time >= EVERY or now.unlike(self._instants[-1]):
            self._instants.append(now)
        for view, belief, frames in self._seen:
            # The first view is taken before anything moves, when the mission's clock begins.
            self._began = view.time if self._began is None else self._began
            self._views.append(LocalisedView(replace(now, time=view.time - self._began), view, belief, frames))
        self._seen.clear()
        self._hear(executor)

    def record(
        self, plan: Plan, places: NDArray[np.float64], outline: Sequence[NDArray[np.float64]] = ()
    ) -> MissionRecord:
        """All of it. What the log was told after the last period, when it was aborted, is its end.

        The plan is what it has become: a landmark that was sought may have been found.
        """
        plan = plan if self._executor is None else self._executor.plan
        if self._executor is not None and self._instants:
            last = Instant.of(self._executor, self._instants[-1].truth)
            if last.unlike(self._instants[-1]):
                self._instants.append(last)
            self._hear(self._executor)
        return MissionRecord(plan, tuple(self._instants), tuple(self._views), tuple(self._log), places, outline)

    def _hear(self, executor: Executor) -> None:
        view = len(self._views) - 1 if self._views else None
        new = executor.log[len(self._log) :]
        self._log += [LogLine(entry, executor.travelled, view) for entry in new]


class HeardLocaliser:
    """A localiser of which ``hear`` is told each view with its answer."""

    def __init__(self, inner: LocaliserProtocol, hear: Callable[[View, Belief], None]) -> None:
        self._inner, self._hear = inner, hear

    def reset(self) -> None:
        """Forget all views seen."""
        self._inner.reset()

    def update(self, view: View) -> Belief:
        """Take the next view and answer."""
        belief = self._inner.update(view)
        self._hear(view, belief)
        return belief
