"""The tab *Localise*, the thesis' localisation form: the robot's sensors, its place, its beliefs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TimelineColumn

from refseq.belief import Belief, Stage
from refseq.errors import RefseqError
from refseq.view import View
from refseq.viewer.belief_log import LocaliserLayer
from refseq.viewer.drawing.history import HEIGHT, WIDTH
from refseq.viewer.drawing.keypoints import Keypoints
from refseq.viewer.live_logger import LiveLogger
from refseq.viewer.scene import Scene, scene_of
from refseq.viewer.timelines import VIEW

Answers = Mapping[str, Sequence[Belief]]
"""Beliefs by method: a ``Stage``, which is a word, or any other name."""


@dataclass(frozen=True)
class LocaliseTab:
    """A drive, and what one or several localisers answered to it; without any it shows the drive alone.

    ``views`` are gone through twice and need not be in memory at once: whatever can be iterated again will do.
    ``answers`` are those of each layer by its name, as many as there are views. Raises ``RefseqError`` where they do
    not fit.
    """

    views: Iterable[View]
    layers: Sequence[LocaliserLayer] = ()
    answers: Mapping[str, Answers] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for layer in self.layers:
            for method, beliefs in self.answers[layer.name].items():
                _check(layer, method, beliefs, self.scene.count or 0)

    @property
    def name(self) -> str:
        """The tab's title."""
        return "Localise" if self.layers else "Drive"

    @cached_property
    def scene(self) -> Scene:
        """The drive's scene."""
        return scene_of(self.views, self.layers)

    def layout(self) -> rrb.Container:
        """Panels of the tab."""
        told = any(belief.faults for own in self.answers.values() for beliefs in own.values() for belief in beliefs)
        return localise_layout(self.scene, self.layers, faults=told)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log view by view."""
        self._send(LiveLogger(stream, self.layers, framed=self.scene.framed, expect=self.scene.count), self.layers)

    def send_drive(self, stream: rr.RecordingStream) -> None:
        """Log the drive alone, without any answer to it."""
        self._send(LiveLogger(stream, framed=self.scene.framed), ())

    def send_layer(self, stream: rr.RecordingStream, layer: LocaliserLayer) -> None:
        """Log what one localiser answers, without the drive."""
        self._send(LiveLogger(stream, [layer], drive=False, expect=self.scene.count), [layer])

    def _send(self, logger: LiveLogger, layers: Sequence[LocaliserLayer]) -> None:
        for number, view in enumerate(self.views):
            asked = {layer.name: self.answers[layer.name] for layer in layers}
            logger.update(view, {name: {m: b[number] for m, b in methods.items()} for name, methods in asked.items()})


def _check(layer: LocaliserLayer, method: str, beliefs: Sequence[Belief], count: int) -> None:
    """Raise ``RefseqError`` for answers that do not fit the views or the places."""
    places = len(layer.places)
    sizes = {len(belief.places) for belief in beliefs} | {places}
    if len(beliefs) != count or len(sizes) != 1:
        kind = "stage" if method in set(Stage) else "method"
        raise RefseqError(
            f"{kind} {str(method)!r}: {len(beliefs)} answers over {sorted(sizes)} places; valid is one answer for each "
            f"of {count} views over {places} places"
        )


# --- layout ---

ABREAST = 5
"""Panels side by side at most; more are so narrow on a laptop's screen that their titles are cut."""


def localise_layout(scene: Scene, layers: Sequence[LocaliserLayer], *, faults: bool = True) -> rrb.Container:
    """Cameras and laser on top, the plan as a strip, beliefs below; a plan that is no strip goes on top.

    With ``faults`` there is a panel that tells of sensors that are declared ill.
    """
    plan = list(_plan(scene, layers))
    wide = scene.extent is not None and scene.extent.wide
    beside = [*_laser(scene), *([] if wide else plan)]
    cameras = _camera_rows(scene, layers, ABREAST - len(beside))
    rows: list[tuple[rrb.Container | rrb.View, float]] = []
    if cameras or beside:
        rows.append((_top(cameras, beside), 2.6))
    if wide:
        rows += [(view, 1.2) for view in plan]
    if layers:
        rows.append((_beliefs(layers, faults=faults), 3.6))
    return rrb.Vertical(*(row for row, _ in rows), row_shares=[share for _, share in rows])


CameraRow = list[rrb.Container | rrb.View]
"""Panels side by side: a camera's own, or a column of them."""


def _camera_rows(scene: Scene, layers: Sequence[LocaliserLayer], most: int) -> list[CameraRow]:
    """All camera panels in a row; where those are more than ``most``, a column a camera, in rows of as many."""
    cameras = [list(_camera(scene, layers, camera)) for camera in scene.cameras]
    if sum(map(len, cameras)) <= most:
        return [[panel for panels in cameras for panel in panels]] if cameras else []
    columns: CameraRow = [panels[0] if len(panels) == 1 else rrb.Vertical(*panels) for panels in cameras]
    even = -(-len(columns) // -(-len(columns) // most))  # as many in each row, the last one aside
    return [columns[first : first + even] for first in range(0, len(columns), even)]


def _top(cameras: Sequence[CameraRow], beside: Sequence[rrb.View]) -> rrb.Container:
    """The cameras' rows, and beside them what else the robot senses."""
    if len(cameras) <= 1:
        return rrb.Horizontal(*(panel for row in cameras for panel in row), *beside)
    rows = rrb.Vertical(*(rrb.Horizontal(*row) for row in cameras))
    return rrb.Horizontal(rows, *beside, column_shares=[len(cameras[0]), *(1 for _ in beside)])


def _camera(scene: Scene, layers: Sequence[LocaliserLayer], camera: str) -> Iterator[rrb.View]:
    """A camera with its keys, and the picture of the place that each localiser believes in."""
    first = layers[0] if layers else None
    marked = first is not None and camera in Keypoints(first.places).cameras()
    keys = [f"{first.path('keys', camera)}/**"] if first and marked else []
    bounds = _frame(scene, camera)
    yield rrb.Spatial2DView(
        origin=f"now/{camera}", contents=["$origin/**", *keys], name=f"{camera} now", visual_bounds=bounds
    )
    for layer in layers:
        if any(camera in view.images for view in layer.places.views):
            name = f"{layer.name}: {camera}" if len(layers) > 1 else f"{camera} believed"
            yield rrb.Spatial2DView(origin=layer.path("place", camera), name=name, visual_bounds=bounds)


def _frame(scene: Scene, camera: str) -> rrb.VisualBounds2D | None:
    """The whole picture, and no more, where its size is known."""
    size = scene.sizes.get(camera)
    return rrb.VisualBounds2D(x_range=[0, size[0]], y_range=[0, size[1]]) if size else None


def _laser(scene: Scene) -> Iterator[rrb.View]:
    """The scan as the robot sees it."""
    if scene.laser:
        yield rrb.Spatial2DView(origin="laser", name="laser: walls, doors", visual_bounds=scene.scan_bounds)


def _plan(scene: Scene, layers: Sequence[LocaliserLayer]) -> Iterator[rrb.View]:
    """The plan, as wide as the path; of several localisers the first shows its places, all show where they believe."""
    if scene.extent is None:
        return
    hidden = [f"- {layer.path('plan', 'places')}" for layer in layers[1:]]
    believed = "rings" if len(layers) > 1 else "orange"
    name = f"plan [m]: blue where it is, {believed} where it believes it is" if layers else "plan [m]"
    yield rrb.Spatial2DView(
        origin="plan", contents=["$origin/**", *hidden], name=name, visual_bounds=scene.extent.bounds
    )


def _beliefs(layers: Sequence[LocaliserLayer], *, faults: bool) -> rrb.Container:
    """A row for each localiser, its methods side by side; P(lost), entropy and faults of sensors beside all."""
    rows = [
        rrb.Horizontal(*(_posterior(layer, method, len(layers) > 1) for method in layer.methods)) for layer in layers
    ]
    columns = max(len(layer.methods) for layer in layers)
    lines = rrb.Vertical(_lines("lost", layers), _lines("entropy", layers), *([_faults()] if faults else []))
    return rrb.Horizontal(rrb.Vertical(*rows), lines, column_shares=[columns, 1.2])


def _posterior(layer: LocaliserLayer, method: str, several: bool) -> rrb.Container | rrb.View:
    """All beliefs so far, and below them the belief of now, for which several localisers leave no room."""
    bounds = rrb.VisualBounds2D(x_range=[0, WIDTH], y_range=[0, HEIGHT])
    history = rrb.Spatial2DView(
        origin=layer.path("history", method), name=f"{layer.label(method)}: place ↑ view →", visual_bounds=bounds
    )
    if several:
        return history
    bars = rrb.BarChartView(
        origin=layer.path("posterior", method), name="P(place) now", plot_legend=rrb.PlotLegend(visible=False)
    )
    return rrb.Vertical(history, bars, row_shares=[2.2, 1.0])


def _faults() -> rrb.View:
    """Lines of text at the views at which sensors were declared ill, or were well again."""
    columns = rrb.TextLogColumns(timeline_columns=[TimelineColumn(VIEW)], text_log_columns=["loglevel", "body"])
    return rrb.TextLogView(origin="faults", name="faults of sensors", columns=columns)


def _lines(group: str, layers: Sequence[LocaliserLayer]) -> rrb.View:
    """Lines of all methods; of several localisers only of the method that each of them is shown by."""
    several = len(layers) > 1
    contents = [layer.path(f"/{group}", layer.foremost) for layer in layers] if several else ["$origin/**"]
    lost = group == "lost"
    return rrb.TimeSeriesView(
        origin=group,
        contents=contents,
        name="P(lost)" if lost else "entropy [nats]",
        axis_y=rrb.ScalarAxis(range=(-0.03, 1.03), zoom_lock=True) if lost else None,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop) if lost else rrb.PlotLegend(visible=False),
    )
