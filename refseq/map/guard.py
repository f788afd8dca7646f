"""Matching under guard: sensors that are ill have no part in it, and beliefs tell of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from refseq.belief import LOST, Belief
from refseq.errors import ViewError
from refseq.fault import DeclaredFault, FaultKind
from refseq.features.sift import SiftWords
from refseq.features.word_extractor import PictureKeys
from refseq.health.monitor import HealthMonitor, usable_view
from refseq.health.noise import picture_noise
from refseq.health.standing import Motion, Step
from refseq.intake import usable
from refseq.map.exchange import ExchangeWatch
from refseq.map.following import PictureSteps
from refseq.map.map import Map
from refseq.map.matcher import Matcher, Measurement, wanted_of
from refseq.view import LASER, Scan, View


@dataclass(frozen=True, slots=True)
class ViewFaults:
    """``faults`` that stand at a view; ``sightless`` where, by them, none of the sensors that are asked is left."""

    faults: tuple[DeclaredFault, ...] = ()
    sightless: bool = False

    def added_to(self, belief: Belief) -> Belief:
        """The belief of the view with the faults that stand; without any sensor left the robot is lost."""
        if not self.faults:
            return belief
        if not self.sightless:
            return replace(belief, faults=self.faults)
        return replace(belief, faults=self.faults, lost=1.0, path=(*belief.path[:-1], LOST))


def with_faults(beliefs: Sequence[Belief], stood: Sequence[ViewFaults]) -> list[Belief]:
    """Beliefs of a whole drive with the faults that stood at its views.

    A view without any sensor left is where the views around it put it; one with no view behind it that sees anything is
    lost, as it was on the way.
    """
    seeing = max((k for k, view in enumerate(stood) if not view.sightless), default=-1)
    return [
        (view if k > seeing else replace(view, sightless=False)).added_to(belief)
        for k, (belief, view) in enumerate(zip(beliefs, stood, strict=True))
    ]


class SensorGuard:
    """A matcher behind a monitor of the sensors (docs/sensor-faults.md).

    As long as nothing is declared the matcher gets every view as it is. ``sensors`` are those of the map that are
    asked, ``view_faults`` those that stand at the last view; ``scan`` is what its laser saw, None where that is
    ill, missing or not asked. Takes the same as ``Matcher``, and raises the same.
    """

    def __init__(self, map_: Map, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        self.sensors = wanted_of(map_, sensors)
        self._matcher = Matcher(map_, sensors=sorted(self.sensors), seed=seed)
        self._cameras = map_.sensors - {LASER}
        self._monitor = HealthMonitor()
        self._stands_once = map_.profile.motion.stands_once
        by_ratios = map_.profile.by_log_ratios
        self._asks_noise = by_ratios and map_.profile.log_ratio.usual > 0
        # In clutter scans do not follow each other: a laser alone says too often that the robot was carried (0051).
        self._asks_carried = by_ratios and map_.profile.chain.carried > 0 and bool(self.sensors & self._cameras)
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._matcher.reset()
        self._monitor.reset()
        self._exchange = ExchangeWatch(self._matcher.extractors)
        self._pictures = PictureSteps()
        self.view_faults = ViewFaults()
        self._met = False
        self.scan: Scan | None = None
        self._trusted: View | None = None

    def match(self, view: View) -> list[Measurement]:
        """Compare what can be trusted of a view with the places of every sequence.

        Raises ``ViewError`` for a view that is not ``usable``, and where the map knows none of its cameras.
        """
        view = usable(view)
        self._check_cameras(view)
        health = self._monitor.update(view)
        measured = self._match(health.usable, health.step)
        faults = self._monitor.compare(self._exchanged(view, health.faults))
        trusted = usable_view(view, faults)
        if trusted.sensors != health.usable.sensors:
            measured = self._match(trusted, health.step)
        self._trusted = trusted
        self.scan = trusted.scan if LASER in self.sensors else None
        fallen = self.sensors & {fault.sensor for fault in faults}
        self.view_faults = ViewFaults(faults, bool(fallen) and not trusted.sensors & self.sensors)
        if not self._asks_carried:
            return measured
        by_pictures = self._pictures.update(self.keys(), measured[0].distance, measured[0].turn)
        by_scan = health.carried if self.scan is not None else 0.0
        return [replace(one, log_ratio_carried=by_pictures + by_scan) for one in measured]

    def keys(self) -> Mapping[str, PictureKeys]:
        """Keys of the last view, by camera: of those that are wanted and can be trusted."""
        view = self._trusted
        if view is None:
            return {}
        words = (one for one in self._matcher.extractors[0] if isinstance(one, SiftWords))
        return {one.sensor: one.shown(view) for one in words if one.sensor in view.sensors}

    def _match(self, view: View, step: Step) -> list[Measurement]:
        """Compare a view that came so after the last one that counted."""
        measured = [self._moved(one, step) for one in self._matcher.match(view)]
        if not self._asks_noise:
            return measured
        asked = self.sensors & self._cameras & frozenset(view.images)
        noise = {camera: picture_noise(view.images[camera]) for camera in asked}
        return [replace(one, noise=noise) for one in measured]

    def _moved(self, measured: Measurement, step: Step) -> Measurement:
        """The measurement with the step that pictures, scans and odometer agree on; NaN where they do not."""
        if step.motion is Motion.UNKNOWN:
            return replace(measured, distance=math.nan, turn=math.nan)
        stood = step.motion is Motion.STOOD
        if self._stands_once:
            return replace(measured, distance=step.distance, turn=step.turn, again=stood)
        if stood and math.isnan(measured.distance):  # pictures and scans tell what no odometer does
            return replace(measured, distance=0.0, turn=0.0)
        return measured

    def _exchanged(self, view: View, faults: Sequence[DeclaredFault]) -> Mapping[str, float]:
        """Log-likelihood ratio of each camera's being exchanged; those that are ill in another way are not asked."""
        ill = {fault.sensor for fault in faults if fault.kind is not FaultKind.EXCHANGED}
        images = {name: image for name, image in view.images.items() if name not in ill}
        return self._exchange.ratios(replace(view, images=images), self._matcher.described)

    def _check_cameras(self, view: View) -> None:
        """Raise ``ViewError`` as long as no camera of the map was met: names differ, or the robot does."""
        known = self._cameras & frozenset(view.images)
        self._met = self._met or bool(known)
        if self._cameras and view.images and not self._met:
            raise ViewError(
                f"view at {view.time:g} s: {', '.join(sorted(view.images))}: no camera of the map; "
                f"valid are {', '.join(sorted(self._cameras))}"
            )
