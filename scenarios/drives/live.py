"""Localising while the simulation runs: each view is answered as it is taken, and shown."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import rerun as rr
import rerun.blueprint as rrb

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.map.map import Map
from refseq.map.matcher import check_among
from refseq.planar import Pose
from refseq.view import LASER, View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.live_logger import LiveLogger
from refseq.viewer.localise_tab import localise_layout
from refseq.viewer.places import Places
from refseq.viewer.recording import send_layout
from refseq.viewer.scene import Extent, Scene
from refseq_bench.scenarios.drives.drive import Drive
from refseq_bench.scenarios.drives.record import sensors_of
from refseq_bench.scenarios.drives.route import plan_of
from refseq_bench.sim.cameras.camera import CameraModel
from refseq_bench.sim.cameras.library import load_camera
from refseq_bench.sim.drives.recorder import RecordedView

LIVE = rr.ChunkBatcherConfig(flush_tick=0.2)
"""Time that a viewer waits for what was logged [s]."""

Answer = Callable[[View], Mapping[Stage, Belief]]
"""Answers to a view, at all stages that were asked for, from it and those before."""


@dataclass
class LiveRun:
    """Hears of the views of a drive as they are taken: answers, shows, and keeps what scoring needs.

    ``logger`` shows it, None: nobody looks; ``told`` is called with a line a view. ``layer`` names the localiser there.
    """

    answer: Answer
    places: Places
    logger: LiveLogger | None = None
    layer: str = "map"
    told: Callable[[str], None] | None = None
    views: list[View] = field(default_factory=list)
    beliefs: dict[str, list[Belief]] = field(default_factory=dict)

    def take(self, taken: RecordedView, count: int) -> None:
        """Answer to the next view."""
        view = taken.view
        answers = self.answer(view)
        for stage, belief in answers.items():
            self.beliefs.setdefault(stage, []).append(belief)
        self.views.append(replace(view, images={}, scan=None))
        if self.logger is not None:
            self.logger.update(view, {self.layer: {stage.value: belief for stage, belief in answers.items()}})
        if self.told is not None:
            self.told(status(view, count, answers, self.places))


def status(view: View, count: int, answers: Mapping[Stage, Belief], places: Places) -> str:
    """The belief of the last stage in a line, with its error [m], where that is known."""
    belief = answers[list(answers)[-1]]
    told = f"view {count}: place {belief.best} of {len(places)}, P {belief.places[belief.best]:.2f}, "
    told += f"P(lost) {belief.lost:.2f}"
    others = (mode for mode in belief.modes_in(places.first) if mode.best != belief.best)
    told += "".join(f", or {mode.best} (P {mode.probability:.2f})" for mode in others)
    if belief.last_sure is not None:
        told += f", last sure at place {belief.last_sure}"
    pose = places.poses[belief.best]
    if belief.lost > LOST_ABOVE or pose is None or view.truth is None:
        return told
    return f"{told}, {math.dist((pose.x, pose.y), (view.truth.x, view.truth.y)):.1f} m off"


def sensors_for(map_: Map, asked: Sequence[str] | None) -> tuple[str, ...]:
    """The sensors that a drive needs to be localised: those asked for, or all of the map's. Raises ``MapError``."""
    check_among(asked or (), map_.sensors)
    return tuple(sorted(asked or map_.sensors))


@dataclass(frozen=True)
class LiveTab:
    """The viewer's tab for a drive that is yet to come: its layout; the data come view by view."""

    scene: Scene
    layers: Sequence[LocaliserLayer]

    @property
    def name(self) -> str:
        """Name of the tab."""
        return "Localise"

    def layout(self) -> rrb.Container:
        """Panels of the tab."""
        return localise_layout(self.scene, self.layers)

    def send(self, stream: rr.RecordingStream) -> None:
        """Nothing is known yet."""


def scene_ahead(drive: Drive, places: Places) -> Scene:
    """Panels of a drive: its sensors, and a plan of the map and of the route."""
    sensors = sensors_of(drive)
    named = {name: load_camera(model) for name, model in drive.cameras.items()}
    lenses = {name: named.get(name, CameraModel()).optics().pinhole for name in sensors if name != LASER}
    return Scene(
        cameras=tuple(sorted(lenses)),
        laser=LASER in sensors,
        extent=Extent.around([*places.poses, *_corners(drive)]),
        sizes={name: (lens.width, lens.height) for name, lens in lenses.items()},
    )


def live_logger(stream: rr.RecordingStream, name: str, drive: Drive, layer: LocaliserLayer) -> LiveLogger:
    """A logger that shows a drive to come in a stream; the layout is sent at once."""
    send_layout(stream, [LiveTab(scene_ahead(drive, layer.places), [layer])], name=name)
    return LiveLogger(stream, [layer])


def _corners(drive: Drive) -> list[Pose]:
    """The route's corners."""
    corners = plan_of(drive).routes.get(drive.route_name, ())
    return [Pose(float(x), float(y), 0.0) for x, y in corners]
