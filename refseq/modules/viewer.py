"""The viewer as a module: views and what is believed of them as they come, and the mission's log."""

from dataclasses import dataclass, replace

import rerun as rr
import rerun.blueprint as rrb

from refseq.belief import Belief, Stage
from refseq.map.map import Map
from refseq.modules.heads import Parts
from refseq.modules.messages import (
    BELIEF,
    ORDERS,
    STEPS,
    VIEWS,
    OrderHead,
    Step,
    ViewHead,
    belief_in,
    head_of,
    view_in,
)
from refseq.modules.process import Role
from refseq.planar import Pose
from refseq.view import LASER, View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.live_logger import LiveLogger
from refseq.viewer.localise_tab import localise_layout
from refseq.viewer.places import Places
from refseq.viewer.recording import send_layout
from refseq.viewer.scene import Extent, Scene

LAYER = "map"
LOG = "mission/log"


@dataclass(frozen=True)
class WatchTab:
    """Panels for the views of modules: the map's places and sensors are known, the rest comes."""

    map_: Map
    layer: LocaliserLayer

    @property
    def name(self) -> str:
        """The tab's title."""
        return "Localise"

    def layout(self) -> rrb.Container:
        """Panels of a localised drive, and below them the mission's log."""
        sensors = self.map_.sensors
        scene = Scene(
            cameras=tuple(sorted(sensors - {LASER})),
            laser=LASER in sensors,
            extent=Extent.around(self.layer.places.poses),
            sizes={},
        )
        log = rrb.TextLogView(origin=LOG, name="the executor's log")
        return rrb.Vertical(localise_layout(scene, [self.layer]), log, row_shares=[5, 1])

    def send(self, stream: rr.RecordingStream) -> None:
        """Nothing is known yet."""


MOST_WAITING = 256
"""So many views wait for their beliefs; of more the oldest are forgotten."""


class ViewerModule:
    """Shows what it hears in a stream; one that is started anew hears the drive from its begin, and shows it again."""

    role, hears, says = Role.VIEWER, (VIEWS, STEPS, ORDERS), ""

    def __init__(self, map_: Map, stream: rr.RecordingStream, name: str) -> None:
        self._stream, self._layer = stream, LocaliserLayer(LAYER, (Stage.CHAIN.value,), Places.of(map_))
        send_layout(stream, [WatchTab(map_, self._layer)], name=name)
        self._drive = ""
        self._begin()

    def _begin(self) -> None:
        self._logger = LiveLogger(self._stream, [self._layer])
        self._views: dict[int, View] = {}
        self._beliefs: dict[int, Belief] = {}
        self._poses: dict[int, Pose] = {}
        self._lines = 0
        self.shown = 0

    def hear(self, topic: str, parts: Parts) -> None:
        """Show a message. Raises ``RefseqError`` for what is none."""
        if topic == ORDERS:
            self._order(head_of(OrderHead, parts))
        elif topic == VIEWS:
            view: ViewHead = head_of(ViewHead, parts)
            self._enter(view.drive)
            self._views[view.number] = view_in(view, parts)
            self._show(view.number)
            if len(self._views) > MOST_WAITING:  # nobody localises, or nobody does so any more
                del self._views[min(self._views)]
        else:
            self._step(head_of(Step, parts), parts)

    def _step(self, step: Step, parts: Parts) -> None:
        self._enter(step.drive)
        if step.view is not None and len(step.truth) == 3:
            self._poses[step.view] = Pose(*step.truth)
        for data in [data for name, data in parts if name == BELIEF]:
            found = belief_in(data)
            self._beliefs[found.view] = found.belief
            self._show(found.view)

    def _enter(self, drive: str) -> None:
        if drive != self._drive:
            self._drive = drive
            self._begin()

    def _show(self, number: int) -> None:
        """Show a view with its belief once both are there: to a viewer that comes late either may come first."""
        if number in self._views and number in self._beliefs:
            view = replace(self._views[number], truth=self._poses.get(number))
            self._logger.update(view, {LAYER: {Stage.CHAIN.value: self._beliefs[number]}})
            self.shown += 1
            for known in (self._views, self._beliefs, self._poses):
                for past in [one for one in known if one <= number]:
                    del known[past]

    def _order(self, order: OrderHead) -> None:
        self._enter(order.drive)
        new = order.log[self._lines :]
        self._lines = max(self._lines, len(order.log))
        for line in new:
            self._stream.log(LOG, rr.TextLog(line))
