"""Matching under guard: sensors that are ill have no part in it, and beliefs tell of them."""

from collections.abc import Sequence
from dataclasses import replace

from refseq.belief import LOST, Belief
from refseq.fault import DeclaredFault, FaultKind
from refseq.health.monitor import HealthMonitor, usable_view
from refseq.map.exchange import ExchangeWatch
from refseq.map.map import Map
from refseq.map.matcher import Matcher, Measurement
from refseq.view import View


class SensorGuard:
    """A matcher behind a monitor of the sensors (docs/sensor-faults.md).

    As long as nothing is declared the matcher gets every view as it is. ``faults`` are those that stand at the last
    view. Takes the same as ``Matcher``, and raises the same.
    """

    def __init__(self, map_: Map, *, sensors: Sequence[str] | None = None, seed: int = 0) -> None:
        self._matcher = Matcher(map_, sensors=sensors, seed=seed)
        self._wanted = map_.sensors if sensors is None else frozenset(sensors)
        self._monitor = HealthMonitor()
        self.reset()

    def reset(self) -> None:
        """Forget all views seen."""
        self._matcher.reset()
        self._monitor.reset()
        self._exchange = ExchangeWatch(self._matcher.extractors)
        self.faults: tuple[DeclaredFault, ...] = ()
        self._sightless = False

    def match(self, view: View) -> list[Measurement]:
        """Compare what can be trusted of a view with the places of every sequence."""
        health = self._monitor.update(view)
        measured = self._matcher.match(health.usable)
        ill = {fault.sensor for fault in health.faults if fault.kind is not FaultKind.EXCHANGED}
        looked_at = replace(view, images={name: image for name, image in view.images.items() if name not in ill})
        ratios = self._exchange.ratios(looked_at, self._matcher.described)
        self.faults = self._monitor.compare(ratios)
        usable = usable_view(view, self.faults)
        if usable.sensors != health.usable.sensors:
            measured = self._matcher.match(usable)
        self._sightless = bool(self.faults) and not usable.sensors & self._wanted
        return measured

    def told(self, belief: Belief) -> Belief:
        """The belief of the last view with the faults that stand; without any sensor left the robot is lost."""
        if not self.faults:
            return belief
        if not self._sightless:
            return replace(belief, faults=self.faults)
        return replace(belief, faults=self.faults, lost=1.0, path=(*belief.path[:-1], LOST))
