"""A drive, and how it was localised, as a Rerun recording: cameras, laser, plan, belief and lost probability.

Rerun's plane has y downwards; everything is drawn with north up, so the second coordinate shown is −y.
"""

import math
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, cycle, pairwise
from pathlib import Path

import cv2
import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.belief import LOST_ABOVE, Belief, Stage
from refseq.errors import RefseqError
from refseq.files import replacing_at
from refseq.view import Pose, View, after_motion

APPLICATION = "refseq"
JPEG_QUALITY = 75
NEAR = 1.5
"""A drive farther than this from every place [m] is off the path: no place is the true one."""
WIDE_PLAN = 4.0
"""A plan this many times wider than high gets a row of its own."""
BAND = 2
"""Half width [places] of the band that is drawn around the truth in the belief maps."""

Colour = tuple[int, int, int]

# Okabe and Ito's colours: told apart with any colour vision, and on a dark ground.
TRUTH = (86, 180, 233)
BELIEVED = (230, 159, 0)
REFERENCE = (120, 120, 120)
LASER_POINTS = (0, 190, 140)
DIM = (90, 90, 90)
STAGE_COLOURS: Mapping[str, Colour] = {
    Stage.UNIFORM: (204, 121, 167),
    Stage.PRIOR: (86, 180, 233),
    Stage.CHAIN: (230, 159, 0),
}
OTHER_COLOURS: Sequence[Colour] = ((0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0), (220, 220, 220))
"""For methods that are no stage of the thesis, one after the other; when they are used up they come again."""

Answers = Mapping[str, Sequence[Belief]]
"""Beliefs by method: a ``Stage``, which is a word, or any other localiser's name."""


def write_recording(
    path: Path, reference_views: Sequence[View], query_views: Sequence[View], beliefs: Answers, *, name: str
) -> None:
    """Write a ``.rrd`` file that opens with its own layout, replacing ``path`` in one step.

    ``reference_views`` are the K places of the map, ``query_views`` the M views localised in it, ``beliefs`` their M
    answers for each method. Any of the three may be empty: with one drive only, that drive is shown. Raises
    ``RefseqError`` when there is nothing to show, or when the answers do not fit the views.
    """
    show = _Show(reference_views, query_views, beliefs)
    with replacing_at(path) as temporary, rr.RecordingStream(APPLICATION) as stream:
        stream.save(temporary)
        show.send(stream, name)
        stream.flush()
        stream.disconnect()


def show(reference_views: Sequence[View], query_views: Sequence[View], beliefs: Answers, *, name: str) -> None:
    """Open Rerun's viewer with the recording that ``write_recording`` would write; returns once it has all data.

    Raises ``RefseqError`` as ``write_recording`` does, and on a machine without a display.
    """
    recording = _Show(reference_views, query_views, beliefs)
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise RefseqError(
            "no display: DISPLAY and WAYLAND_DISPLAY are unset; valid is a desktop session, or saving a file"
        )
    with rr.RecordingStream(APPLICATION) as stream:
        stream.spawn()
        recording.send(stream, name)
        stream.flush()


@dataclass(frozen=True)
class _Show:
    """What is to be shown, checked, with the entities and the layout that show it."""

    reference: Sequence[View]
    query: Sequence[View]
    beliefs: Answers

    def __post_init__(self) -> None:
        if not (self.reference or self.query):
            raise RefseqError(
                "nothing to show: neither the reference nor the query holds a view; valid is at least one"
            )
        for method, answers in self.beliefs.items():
            sizes = {len(belief.places) for belief in answers} | {len(self.reference)}
            if len(answers) != len(self.query) or len(sizes) != 1:
                kind = "stage" if method in set(Stage) else "method"
                raise RefseqError(
                    f"{kind} {str(method)!r}: {len(answers)} answers over {sorted(sizes)} places; valid is one answer "
                    f"for each of {len(self.query)} views over {len(self.reference)} places"
                )

    @property
    def drive(self) -> Sequence[View]:
        """The views that time runs over."""
        return self.query or self.reference

    @property
    def foremost(self) -> str | None:
        """The method that is shown where there is room for one: the stage that knows most, else the last method."""
        ranked = (*reversed(Stage), *reversed(tuple(self.beliefs)))
        return next((method for method in ranked if self.beliefs.get(method)), None)

    @property
    def cameras(self) -> list[str]:
        """Names of all cameras of the drive."""
        return sorted({camera for view in self.drive for camera in view.images})

    def send(self, stream: rr.RecordingStream, name: str) -> None:
        """Send layout and data."""
        stream.set_log_tick_enabled(False)
        stream.set_log_time_enabled(False)  # when it was written says nothing about the drive
        stream.send_recording_name(name)
        stream.send_blueprint(self.blueprint())
        timeline = _timelines(self.drive)
        self.send_cameras(stream, timeline)
        self.send_laser(stream, timeline)
        self.send_plan(stream, timeline)
        if self.foremost:
            self.send_belief(stream, timeline)
            self.send_lost(stream, timeline)

    # --- cameras ---

    def send_cameras(self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn]) -> None:
        """Both cameras of the drive, and those of the place that is believed in."""
        for camera in self.cameras:
            _send_images(stream, f"now/{camera}", timeline, [_jpeg(view, camera) for view in self.drive])
            if self.foremost:
                pictures = [_jpeg(view, camera) for view in self.reference]
                best = [pictures[belief.best] for belief in self.beliefs[self.foremost]]
                _send_images(stream, f"place/{camera}", timeline, best)

    # --- laser, robot in the middle, forward up ---

    def send_laser(self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn]) -> None:
        """Send the scan as the robot sees it."""
        scans = [_returns(view) for view in self.drive]
        _send_points(stream, "laser/scan", timeline, [_robot_up(scan) for scan in scans], LASER_POINTS, -1.5)
        rings = [_circle(radius) for radius in (2.0, 5.0, 10.0, 20.0)]
        stream.log("laser/rings", rr.LineStrips2D(rings, colors=DIM, radii=-0.5), static=True)
        marks = rr.Points2D(
            [(0, -2), (0, -5), (0, -10), (0, -20)], labels=["2 m", "5 m", "10 m", "20 m"], colors=DIM, radii=-1
        )
        stream.log("laser/metres", marks, static=True)
        stream.log("laser/robot", rr.LineStrips2D([_ROBOT], colors=TRUTH, radii=-1), static=True)

    # --- plan ---

    def send_plan(self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn]) -> None:
        """Paths of both drives, the robot and its scan, and the places coloured by their probability."""
        here = self.drive_poses
        if self.query:
            _send_path(stream, "plan/reference", self.reference_poses, REFERENCE)
        _send_path(stream, "plan/drive", here, TRUTH)
        scans = [
            _in_world(_returns(view), pose) if pose else np.empty((0, 2))
            for view, pose in zip(self.drive, here, strict=True)
        ]
        _send_points(stream, "plan/scan", timeline, [_north_up(scan) for scan in scans], LASER_POINTS, -0.7)
        robots = [_north_up(_in_world(_ROBOT_SHAPE, pose)) if pose else None for pose in here]
        _send_strips(stream, "plan/robot", timeline, robots, TRUTH)
        if self.foremost:
            self.send_places(stream, timeline, self.beliefs[self.foremost])

    def send_places(
        self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn], answers: Sequence[Belief]
    ) -> None:
        """Each place as a dot that glows with its probability, and a ring around the best one."""
        known = [k for k, pose in enumerate(self.reference_poses) if pose]
        if not known:
            return
        dots = _north_up(np.array([(pose.x, pose.y) for pose in self.reference_poses if pose]))
        shares = np.stack([belief.places[known] for belief in answers])
        stream.log("plan/places", rr.Points2D(dots, radii=-3, colors=DIM), static=True)
        colours = rr.Points2D.columns(colors=_glow(shares).reshape(-1, 4)).partition([len(known)] * len(answers))
        stream.send_columns("plan/places", timeline, colours)
        rings = [
            _north_up(_circle(0.6, pose)) if (pose := self.reference_poses[belief.best]) else None for belief in answers
        ]
        _send_strips(stream, "plan/believed", timeline, rings, BELIEVED)

    @property
    def reference_poses(self) -> list[Pose | None]:
        """True poses of the places."""
        return [view.truth for view in self.reference]

    @property
    def drive_poses(self) -> list[Pose | None]:
        """True poses of the drive; from odometry where no truth is known and no map gives the frame."""
        truths = [view.truth for view in self.drive]
        if any(truths) or any(self.reference_poses):
            return truths
        return list(_dead_reckoning(self.drive))

    # --- belief over places ---

    def send_belief(self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn]) -> None:
        """For each method a picture of all answers, place over view, with the truth; and the answer of now as bars."""
        places, nearest = len(self.reference), self.nearest_places
        for method, answers in self.beliefs.items():
            path = f"belief/{_part(method)}"
            picture = _belief_picture(np.stack([belief.places for belief in answers], axis=1))
            stream.log(f"{path}/map", picture, static=True)
            lost = [(t + 0.5, -3.0) for t, belief in enumerate(answers) if belief.lost > LOST_ABOVE]
            stream.log(f"{path}/lost", rr.Points2D(lost, colors=(213, 94, 0), radii=-2), static=True)
        band = [line for sign in (-1, 1) for line in _truth_lines(nearest, places, sign * (BAND + 0.5))]
        stream.log("belief/truth", rr.LineStrips2D(band, colors=TRUTH, radii=-0.6), static=True)
        now = [np.array([(t + 0.5, -5.0), (t + 0.5, places)]) for t in range(len(self.query))]
        _send_strips(stream, "belief/now", timeline, now, (255, 255, 255))
        if self.foremost:
            _send_bars(stream, timeline, self.beliefs[self.foremost], nearest)

    @property
    def nearest_places(self) -> list[int | None]:
        """For each query view the place that its true pose belongs to, ``None`` off the path and without truth."""
        return [_nearest(view.truth, self.reference_poses) for view in self.query]

    # --- lost ---

    def send_lost(self, stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn]) -> None:
        """Lost probability and entropy of each method over time."""
        others = cycle(OTHER_COLOURS)
        for method, answers in self.beliefs.items():
            colour = STAGE_COLOURS[method] if method in STAGE_COLOURS else next(others)
            for group, values in (
                ("lost", [belief.lost for belief in answers]),
                ("entropy", [belief.entropy for belief in answers]),
            ):
                path = f"{group}/{_part(method)}"
                line = rr.SeriesLines(colors=colour, names=str(method), widths=1.5)
                stream.log(path, line, static=True)
                stream.send_columns(path, timeline, rr.Scalars.columns(scalars=values))

    # --- layout ---

    def blueprint(self) -> rrb.Blueprint:
        """Cameras and laser on top, the plan as a strip, belief and lost below; a plan that is no strip goes on top."""
        plan, wide = self.plan_view(), self.aspect >= WIDE_PLAN
        top = [*self.camera_views(), *self.laser_views(), *([plan] if plan and not wide else [])]
        rows: list[tuple[rrb.Container | rrb.View, float]] = []
        if top:
            rows.append((rrb.Horizontal(*top), 3.0))
        if plan and wide:
            rows.append((plan, 1.2))
        if self.foremost:
            rows.append((self.belief_row(), 3.4))
        return rrb.Blueprint(
            rrb.Vertical(*(row for row, _ in rows), row_shares=[share for _, share in rows]),
            rrb.TimePanel(state="collapsed", timeline="view", play_state="following", fps=5),
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
        )

    def camera_views(self) -> Iterable[rrb.View]:
        """Show each camera, and beside it the picture of the believed place."""
        for camera in self.cameras:
            yield rrb.Spatial2DView(origin=f"now/{camera}", name=f"{camera}, now")
            if self.foremost:
                yield rrb.Spatial2DView(origin=f"place/{camera}", name=f"{camera}, best place of the map")

    def laser_views(self) -> Iterable[rrb.View]:
        """Show the scan as the robot sees it."""
        reach = _usual_reach(self.drive)
        if reach:
            bounds = rrb.VisualBounds2D(x_range=[-reach * 0.7, reach * 0.7], y_range=[-reach, reach * 0.15])
            yield rrb.Spatial2DView(origin="laser", name="laser [m], forward is up", visual_bounds=bounds)

    @property
    def extent(self) -> NDArray[np.float64] | None:
        """Corners of the plan that holds all poses, [[x, −y], [x, −y]] [m], if there are any."""
        points = np.array([(pose.x, -pose.y) for pose in [*self.reference_poses, *self.drive_poses] if pose])
        return np.stack([points.min(axis=0) - 2, points.max(axis=0) + 2]) if len(points) else None

    @property
    def aspect(self) -> float:
        """Width of the plan over its height."""
        extent = self.extent
        return 1.0 if extent is None else float(np.divide(*(extent[1] - extent[0])))

    def plan_view(self) -> rrb.View | None:
        """Show the plan, as wide as the path."""
        extent = self.extent
        if extent is None:
            return None
        bounds = rrb.VisualBounds2D(x_range=extent[:, 0], y_range=extent[:, 1])
        name = "plan [m]: grey the map's path, blue the true one, orange the belief" if self.beliefs else "plan [m]"
        return rrb.Spatial2DView(origin="plan", name=name, visual_bounds=bounds)

    def belief_row(self) -> rrb.Horizontal:
        """Show belief maps, bars of now, lost probability and entropy."""
        maps = [self.belief_view(method) for method in self.beliefs]
        bars = rrb.BarChartView(
            origin="bars",
            name="P(place) now; blue: truth",
            plot_legend=rrb.PlotLegend(visible=False),
        )
        lost = rrb.TimeSeriesView(
            origin="lost",
            name="P(lost)",
            axis_y=rrb.ScalarAxis(range=(-0.03, 1.03), zoom_lock=True),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop),
        )
        entropy = rrb.TimeSeriesView(origin="entropy", name="entropy [nats]", plot_legend=rrb.PlotLegend(visible=False))
        return rrb.Horizontal(*maps, bars, rrb.Vertical(lost, entropy), column_shares=[1.0] * len(maps) + [1.0, 1.6])

    def belief_view(self, method: str) -> rrb.View:
        """Place over view for one method."""
        places, views = len(self.reference), len(self.query)
        bounds = rrb.VisualBounds2D(x_range=[-2, views + 2], y_range=[-6, places + 2])
        return rrb.Spatial2DView(
            origin="belief",
            contents=[f"belief/{_part(method)}/**", "belief/truth", "belief/now"],
            name=f"{method}: place ↑ view →",
            visual_bounds=bounds,
        )


# --- sending columns ---


def _part(method: str) -> str:
    """A method's name as one part of an entity's path, though there may be strokes and colons in it."""
    return rr.escape_entity_path_part(str(method))


def _timelines(views: Sequence[View]) -> list[rr.TimeColumn]:
    """Give the same moments as number of the view, simulated or logged time, and distance travelled [cm]."""
    travelled = np.cumsum([0.0] + [abs(view.distance) for view in views[1:]])
    return [
        rr.TimeColumn("view", sequence=range(len(views))),
        rr.TimeColumn("time", duration=[view.time for view in views]),
        rr.TimeColumn("distance_cm", sequence=np.round(100 * travelled).astype(int)),
    ]


def _set_time(stream: rr.RecordingStream, timeline: Sequence[rr.TimeColumn], index: int) -> None:
    """Set the moment of what is logged row by row."""
    number, time, distance = (column.as_arrow_array()[index] for column in timeline)
    stream.set_time("view", sequence=number.as_py())
    stream.set_time("time", duration=np.timedelta64(time.value, "ns"))
    stream.set_time("distance_cm", sequence=distance.as_py())


def _send_images(
    stream: rr.RecordingStream, path: str, timeline: Sequence[rr.TimeColumn], pictures: Sequence[bytes | None]
) -> None:
    """JPEG pictures, one a view; ``None`` leaves the panel empty for that view."""
    there = [picture for picture in pictures if picture is not None]
    lengths = [picture is not None for picture in pictures]
    columns = rr.EncodedImage.columns(blob=there, media_type=["image/jpeg"] * len(there)).partition(lengths)
    stream.send_columns(path, timeline, columns)


def _send_points(
    stream: rr.RecordingStream,
    path: str,
    timeline: Sequence[rr.TimeColumn],
    clouds: Sequence[NDArray[np.float64]],
    colour: Colour,
    radius: float,
) -> None:
    """Points of each view, in one colour; a negative radius is in points of the screen."""
    if not any(len(cloud) for cloud in clouds):
        return
    stream.log(path, rr.Points2D.from_fields(colors=[colour], radii=[radius]), static=True)
    columns = rr.Points2D.columns(positions=np.concatenate(clouds)).partition([len(cloud) for cloud in clouds])
    stream.send_columns(path, timeline, columns)


def _send_strips(
    stream: rr.RecordingStream,
    path: str,
    timeline: Sequence[rr.TimeColumn],
    strips: Sequence[NDArray[np.float64] | None],
    colour: Colour,
) -> None:
    """One line a view, or none."""
    there = [strip for strip in strips if strip is not None]
    if not there:
        return
    stream.log(path, rr.LineStrips2D.from_fields(colors=[colour], radii=[-1.0]), static=True)
    columns = rr.LineStrips2D.columns(strips=there).partition([strip is not None for strip in strips])
    stream.send_columns(path, timeline, columns)


def _send_bars(
    stream: rr.RecordingStream,
    timeline: Sequence[rr.TimeColumn],
    answers: Sequence[Belief],
    nearest: Sequence[int | None],
) -> None:
    """Send the probability of each place, and a bar of height one at the place nearest to the truth."""
    for t, (belief, place) in enumerate(zip(answers, nearest, strict=True)):
        _set_time(stream, timeline, t)
        stream.log("bars/belief", rr.BarChart(belief.places.astype(np.float32), color=BELIEVED))
        truth = rr.Clear(recursive=False) if place is None else _bar_at(place)
        stream.log("bars/truth", truth)
    stream.reset_time()


def _bar_at(place: int) -> rr.BarChart:
    """One bar of height one."""
    return rr.BarChart(np.ones(1, np.float32), abscissa=np.array([place], np.float32), color=(*TRUTH, 160))


def _send_path(stream: rr.RecordingStream, path: str, poses: Sequence[Pose | None], colour: Colour) -> None:
    """Send a path that does not change."""
    points = np.array([(pose.x, pose.y) for pose in poses if pose])
    if len(points):
        stream.log(path, rr.LineStrips2D([_north_up(points)], colors=colour, radii=-0.8), static=True)


# --- pictures ---


def _jpeg(view: View, camera: str) -> bytes | None:
    """Encode the picture of one camera as a JPEG file, if the view has one."""
    image = view.images.get(camera)
    if image is None:
        return None
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


def _belief_picture(shares: NDArray[np.float64]) -> rr.EncodedImage:
    """Probabilities (K, M) as a picture, place 0 at the bottom; brightness is their square root."""
    grey = np.round(255 * np.sqrt(np.clip(shares, 0, 1))).astype(np.uint8)
    _, data = cv2.imencode(".png", cv2.applyColorMap(grey[::-1], cv2.COLORMAP_INFERNO))
    return rr.EncodedImage(contents=data.tobytes(), media_type="image/png")


def _glow(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Probabilities (…,) as colours (…, 4): dark grey for none, the belief's orange for all."""
    weight = np.sqrt(np.clip(shares, 0, 1))[..., None]
    colour = (1 - weight) * np.array(DIM) + weight * np.array(BELIEVED)
    return np.concatenate([colour, np.full_like(weight, 255)], axis=-1).astype(np.uint8)


def _truth_lines(nearest: Sequence[int | None], places: int, offset: float) -> list[NDArray[np.float64]]:
    """Draw the true places as lines in the belief picture, ``offset`` places above; unknown truth leaves a gap."""
    points = [(t + 0.5, places - (k + 0.5 + offset)) if k is not None else None for t, k in enumerate(nearest)]
    return [np.array([a, b]) for a, b in pairwise(points) if a and b]


# --- geometry ---

_ROBOT_SHAPE = np.array([(-0.35, -0.3), (0.3, -0.3), (0.5, 0.0), (0.3, 0.3), (-0.35, 0.3), (-0.35, -0.3)])
"""Outline of a robot that looks along x, (6, 2) [m]: a mark, not a model."""


def _north_up(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """World points (n, 2) as Rerun's plane shows them upright."""
    return np.multiply(points, (1.0, -1.0))


def _robot_up(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points in the robot's frame (n, 2), x forward and y left, turned so that forward is up on the screen."""
    return np.negative(points[:, ::-1])


_ROBOT = _robot_up(_ROBOT_SHAPE)


def _in_world(points: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Points in the robot's frame (n, 2) in the frame of its pose."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    turned: NDArray[np.float64] = points @ np.array([[cos, sin], [-sin, cos]])
    return np.add(turned, (pose.x, pose.y))


def _circle(radius: float, centre: Pose = Pose(0.0, 0.0, 0.0)) -> NDArray[np.float64]:  # noqa: B008 - frozen
    """Draw a circle, (49, 2) [m]."""
    angles = np.linspace(0, 2 * np.pi, 49)
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1) + (centre.x, centre.y)


def _returns(view: View) -> NDArray[np.float64]:
    """End points of the beams that came back, in the scanner's frame, (n, 2) [m]."""
    if view.scan is None:
        return np.empty((0, 2))
    return view.scan.points[view.scan.ranges < view.scan.max_range]


def _usual_reach(views: Sequence[View]) -> float:
    """Find a distance that holds most of what the scanner sees, in [4, 20] m; 0 without scans."""
    ranges = [np.linalg.norm(scan, axis=1) for view in views if len(scan := _returns(view))]
    return float(np.clip(np.quantile(np.concatenate(ranges), 0.95), 4.0, 20.0)) if ranges else 0.0


def _nearest(pose: Pose | None, places: Sequence[Pose | None]) -> int | None:
    """Find the place nearest to a pose that looks the same way within 90°, if there is one within reach."""
    if pose is None:
        return None
    candidates: list[tuple[float, int | None]] = [
        (math.hypot(place.x - pose.x, place.y - pose.y), k)
        for k, place in enumerate(places)
        if place and math.cos(place.heading - pose.heading) > 0
    ]
    distance, place = min(candidates, default=(math.inf, None))
    return place if distance <= NEAR else None


def _dead_reckoning(views: Sequence[View]) -> Iterable[Pose]:
    """Poses from odometry, the first at the origin."""
    return accumulate(
        views[1:], lambda pose, view: after_motion(pose, view.distance, view.turn), initial=Pose(0.0, 0.0, 0.0)
    )
