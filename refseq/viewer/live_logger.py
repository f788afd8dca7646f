"""Live log of a localiser at work: each view and the beliefs about it, as they come."""

from collections.abc import Mapping, Sequence

import rerun as rr

from refseq.belief import Belief
from refseq.errors import RefseqError
from refseq.features.doors import DoorSettings
from refseq.features.walls import WallSettings
from refseq.map.profile import Profile
from refseq.view import View
from refseq.viewer.belief_log import BeliefLog, LocaliserLayer
from refseq.viewer.drive_log import DriveLog
from refseq.viewer.timelines import TimePoint, set_time_point


class LiveLogger:
    """Logs a drive and the answers to it, one view after the other: to the end of a file, or live.

    ``layers`` are the localisers that answer, one or several; ``expect`` is the number of views, if known. ``framed``:
    true poses are known, or those of a map (``DriveLog``). Without ``drive`` nothing but the answers is logged. Neither
    pictures nor scans are kept.

    >>> logger = LiveLogger(stream, [LocaliserLayer("thesis", tuple(Stage), Places.of(sequence, reference.views))])
    >>> for view in views:
    ...     logger.update(view, {"thesis": {stage: localiser.update(view) for stage, localiser in localisers.items()}})
    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        layers: Sequence[LocaliserLayer] = (),
        *,
        framed: bool = True,
        drive: bool = True,
        expect: int | None = None,
    ) -> None:
        self._stream = stream
        self._drive = DriveLog(stream, framed, *_settings(layers)) if drive else None
        self._beliefs = {layer.name: BeliefLog(stream, layer, expect=expect) for layer in layers}
        self._view, self._distance = 0, 0.0
        self._begin()

    def _begin(self) -> None:
        if self._drive:
            self._drive.begin()
        for log in self._beliefs.values():
            log.begin()

    def update(self, view: View, beliefs: Mapping[str, Mapping[str, Belief]] | None = None) -> None:
        """Log the next view, and what each localiser believes by each of its methods."""
        self._distance += abs(view.distance) if self._view else 0.0
        set_time_point(self._stream, TimePoint(self._view, view.time, self._distance))
        pose = self._drive.update(view) if self._drive else view.truth
        for name, answers in (beliefs or {}).items():
            self._log_of(name).update(view, answers, pose)
        self._view += 1

    def _log_of(self, name: str) -> BeliefLog:
        if name not in self._beliefs:
            raise RefseqError(f"localiser {name!r} was not told of; valid are {', '.join(self._beliefs) or 'none'}")
        return self._beliefs[name]


def _settings(layers: Sequence[LocaliserLayer]) -> tuple[WallSettings, DoorSettings]:
    """Settings of the detectors of walls and doors: those of the first map."""
    profile = next((sequence.profile for layer in layers for sequence in layer.places.sequences), None) or Profile()
    return profile.walls, profile.doors
