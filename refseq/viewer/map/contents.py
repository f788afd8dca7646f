"""Panels about the places of a map: features of each, and the frames and scans that they were learnt from."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from refseq.dead_reckoning import way_along
from refseq.map.sequence import ReferenceSequence
from refseq.planar import in_world
from refseq.viewer.belief_log import entity_part
from refseq.viewer.drawing import colours
from refseq.viewer.drawing.incidence import HEIGHT, WIDTH, bands, features_a_place, incidence_picture
from refseq.viewer.drawing.pictures import drawing, frame
from refseq.viewer.drawing.plane import ROBOT, circle, north_up, returns, robot_up
from refseq.viewer.places import Places
from refseq.viewer.scene import Extent, Scene, scene_of
from refseq.viewer.timelines import TimePoint, set_time_point

LABELS = 150
"""Room for names beside an incidence matrix [pixels]."""


@dataclass(frozen=True)
class PlacePanels:
    """The places of a map; ``names`` are its sequences'. The number of the view is that of the place.

    With the drive's views (``Places.views``) their frames and scans are shown too.
    """

    places: Places
    names: Sequence[str]

    @property
    def scene(self) -> Scene:
        """The scene of the drive."""
        return scene_of(self.places.views)

    # --- layout ---

    def layout(self) -> rrb.Container:
        """Frames, scan and plan on top; below them the matrices, and how many features each place shows."""
        scene = self.scene
        plan = Extent.around(self.places.poses)
        top = [*_frames(scene), *([] if plan is None or plan.wide else [_plan(plan)])]
        rows: list[tuple[rrb.Container | rrb.View, float]] = [(rrb.Horizontal(*top), 2.2)] if top else []
        if plan is not None and plan.wide:
            rows.append((_plan(plan), 1.0))
        if self.places.sequences:
            rows.append((self._matrices(), 3.4))
        return rrb.Vertical(*(row for row, _ in rows), row_shares=[share for _, share in rows])

    def _matrices(self) -> rrb.Container:
        bounds = rrb.VisualBounds2D(x_range=[-LABELS, WIDTH], y_range=[-6, HEIGHT + 10])
        pictures = [
            rrb.Spatial2DView(
                origin=f"map/places/fim/{entity_part(name)}", name=f"{name}: feature ↓ place →", visual_bounds=bounds
            )
            for name in self.names
        ]
        several = rrb.Tabs(*pictures, name="feature incidence matrices") if len(pictures) > 1 else pictures[0]
        lines = rrb.TimeSeriesView(
            origin="map/places/features",
            name="features seen, by sensor",
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )
        bars = rrb.BarChartView(
            origin="map/places/bars", name="features of each place", plot_legend=rrb.PlotLegend(visible=False)
        )
        return rrb.Horizontal(several, rrb.Vertical(lines, bars), column_shares=[1.3, 1.0])

    # --- data ---

    def send(self, stream: rr.RecordingStream) -> None:
        """Log place by place."""
        counts = list(self._counts())
        self._send_matrices(stream, counts)
        self._send_path(stream)
        for place, moment in enumerate(self._moments()):
            set_time_point(stream, moment)
            self._send_view(stream, place)
            self._send_now(stream, place)
            if counts:
                for key, number in counts[place].items():
                    stream.log(f"map/places/features/{entity_part(key)}", rr.Scalars(number))

    def _moments(self) -> Iterator[TimePoint]:
        """Places as moments: by their numbers and distances, and by the drive's time where that is known."""
        views, sequences = self.places.views, self.places.sequences
        along = [along for sequence in sequences for along in sequence.along.tolist()]
        if not along:
            along = way_along(views).tolist()
        for place, distance in enumerate(along):
            yield TimePoint(place, views[place].time if views else None, distance)

    def _counts(self) -> Iterator[dict[str, int]]:
        """Numbers of features of each place, by extractor."""
        for sequence in self.places.sequences:
            by_key = features_a_place(sequence.matrix)
            yield from ({key: int(count[k]) for key, count in by_key.items()} for k in range(len(sequence)))

    def _send_matrices(self, stream: rr.RecordingStream, counts: Sequence[Mapping[str, int]]) -> None:
        for name, sequence in zip(self.names, self.places.sequences, strict=True):
            _send_matrix(stream, f"map/places/fim/{entity_part(name)}", sequence)
        if self.places.sequences:
            totals = np.array([sum(by_key.values()) for by_key in counts], np.float32)
            stream.log("map/places/bars", rr.BarChart(totals, color=colours.REFERENCE), static=True)
            shades = {band.key: band.colour for sequence in self.places.sequences for band in bands(sequence.matrix)}
            for key, shade in shades.items():
                line = rr.SeriesLines(colors=shade, names=key, widths=1.5)
                stream.log(f"map/places/features/{entity_part(key)}", line, static=True)

    def _send_path(self, stream: rr.RecordingStream) -> None:
        if len(self.places.known):
            points = north_up(self.places.table[:, :2])
            stream.log("map/places/plan/places", rr.Points2D(points, colors=colours.REFERENCE, radii=-2.5), static=True)

    def _send_view(self, stream: rr.RecordingStream, place: int) -> None:
        if not self.places.views:
            return
        view = self.places.views[place]
        for camera in view.images:
            stream.log(f"map/places/frames/{camera}", frame(view, camera))
        if view.scan is not None:
            stream.log("map/places/scan", rr.Points2D(robot_up(returns(view)), colors=[colours.SCAN], radii=[-1.5]))

    def _send_now(self, stream: rr.RecordingStream, place: int) -> None:
        """Mark the place in its matrix and in the plan."""
        if self.places.sequences:
            sequence, number = self.places.held(place)
            x = (number + 0.5) * WIDTH / len(sequence)
            name = self.names[self.places.holder(place)]
            line = rr.LineStrips2D([[(x, 0), (x, HEIGHT)]], colors=[colours.TEXT], radii=[-0.7])
            stream.log(f"map/places/fim/{entity_part(name)}/now", line)
        pose = self.places.poses[place]
        strips = [] if pose is None else [north_up(in_world(ROBOT, pose)), north_up(circle(0.6, pose))]
        if len(self.places.known):
            stream.log("map/places/plan/now", rr.LineStrips2D(strips, colors=[colours.BELIEVED], radii=[-1.2]))


def _frames(scene: Scene) -> Iterator[rrb.View]:
    """The frames of the drive, and its scan."""
    for camera in scene.cameras:
        yield rrb.Spatial2DView(origin=f"map/places/frames/{camera}", name=camera)
    if scene.laser:
        name = "laser, forward is up"
        yield rrb.Spatial2DView(origin="map/places/scan", name=name, visual_bounds=scene.scan_bounds)


def _plan(extent: Extent) -> rrb.View:
    return rrb.Spatial2DView(origin="map/places/plan", name="places [m]", visual_bounds=extent.bounds)


def _send_matrix(stream: rr.RecordingStream, path: str, sequence: ReferenceSequence) -> None:
    """The matrix's picture, and the names of its extractors with the numbers of their features."""
    stream.log(f"{path}/ones", drawing(incidence_picture(sequence.matrix)), static=True)
    names = bands(sequence.matrix)
    at = [(-LABELS / 2, (band.top + band.bottom) / 2) for band in names]
    labels = [f"{band.key} · {len(sequence.matrix.blocks[band.key])}" for band in names]
    points = rr.Points2D(at, labels=labels, colors=[band.colour for band in names], radii=-1, show_labels=True)
    stream.log(f"{path}/names", points, static=True)
