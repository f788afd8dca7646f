"""Log of one localiser's answers, view by view: posteriors, their history, P(lost), entropy, the believed place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from refseq.belief import Belief, PoseBeside, Stage
from refseq.errors import RefseqError
from refseq.fault import DeclaredFault
from refseq.planar import Pose, in_world
from refseq.view import View
from refseq.viewer.drawing import colours
from refseq.viewer.drawing.colours import Colour
from refseq.viewer.drawing.history import History
from refseq.viewer.drawing.keypoints import Keypoints, MarkedKeypoints
from refseq.viewer.drawing.pictures import drawing, frame
from refseq.viewer.drawing.plane import ROBOT, Points, circle, north_up
from refseq.viewer.places import Places

TRUTH_MARK = 0.15
"""Height of the mark below the bars where the robot truly is, in shares of the highest bar."""
RING = 0.6
"""Radius of the ring around the believed place [m]."""
RINGS = (colours.BELIEVED, colours.MATCHED, colours.UNMATCHED, colours.WALL, colours.LOST)
"""Colours of localisers beside each other."""


def entity_part(name: str) -> str:
    """A name as one part of an entity's path, though there may be strokes and colons in it."""
    return rr.escape_entity_path_part(str(name))


@dataclass(frozen=True)
class LocaliserLayer:
    """A localiser by its ``name``, with the ``methods`` that it answers by: stages, which are words, or others.

    ``shade`` is its own colour where several are shown beside each other (``beside``).
    """

    name: str
    methods: tuple[str, ...]
    places: Places
    shade: Colour | None = None

    def __post_init__(self) -> None:
        if not self.methods:
            raise RefseqError(f"localiser {self.name!r} answers by no method; valid is at least one")

    @property
    def foremost(self) -> str:
        """The method that is shown where there is room for one: the stage that knows most, else the last method."""
        ranked = (*reversed(Stage), *reversed(self.methods))
        return next(method for method in ranked if method in self.methods)

    def path(self, group: str, *parts: str) -> str:
        """An entity of this localiser: ``group/localiser/part/…``."""
        return "/".join([group, *map(entity_part, (self.name, *parts))])

    def label(self, method: str) -> str:
        """A method's name, with the localiser's where there are several."""
        return method if self.shade is None else f"{self.name}, {method}"

    @property
    def ring(self) -> Colour:
        """The colour of the believed place in the plan."""
        return self.shade or colours.BELIEVED

    def colour(self, method: str) -> Colour:
        """The colour of a method's lines."""
        if self.shade is not None and method == self.foremost:
            return self.shade
        own = [name for name in self.methods if name not in colours.STAGES]
        return colours.STAGES[method] if method in colours.STAGES else colours.other(own.index(method))


def beside(layers: Sequence[LocaliserLayer]) -> list[LocaliserLayer]:
    """Localisers with colours of their own, if there are several."""
    if len(layers) < 2:
        return list(layers)
    return [replace(layer, shade=RINGS[number % len(RINGS)]) for number, layer in enumerate(layers)]


class BeliefLog:
    """Logs the answers of one localiser; the caller sets the moment. ``expect`` is the number of views, if known."""

    def __init__(self, stream: rr.RecordingStream, layer: LocaliserLayer, *, expect: int | None = None) -> None:
        self._stream, self._layer, self._places = stream, layer, layer.places
        self._keypoints = Keypoints(layer.places)
        self._worded = self._keypoints.cameras()
        self._cameras: set[str] = set()
        self._histories = {method: History(len(layer.places), expect) for method in layer.methods}
        self._faults: tuple[DeclaredFault, ...] | None = None

    def begin(self) -> None:
        """Log what does not change: names and colours of lines, and where the places are."""
        for method in self._layer.methods:
            line = rr.SeriesLines(colors=self._layer.colour(method), names=self._layer.label(method), widths=1.5)
            for group in ("lost", "entropy"):
                self._stream.log(self._layer.path(group, method), line, static=True)
        if len(self._places.known):
            lines = [north_up(line) for line in self._places.lines]
            path = rr.LineStrips2D(lines, colors=colours.REFERENCE, radii=-0.8)
            self._stream.log(self._layer.path("plan", "path"), path, static=True)

    def update(self, view: View, beliefs: Mapping[str, Belief], pose: Pose | None) -> None:
        """Log the answers to a view, by method; ``pose`` is where the plan shows the robot."""
        self._check(beliefs)
        truth = self._places.nearest(view.truth)
        for method, belief in beliefs.items():
            self._log_posterior(method, belief, truth)
            self._stream.log(self._layer.path("lost", method), rr.Scalars(belief.lost))
            self._stream.log(self._layer.path("entropy", method), rr.Scalars(belief.entropy))
        if self._layer.foremost in beliefs:
            foremost = beliefs[self._layer.foremost]
            self._log_place(view, foremost)
            self._log_plan(foremost, pose)
            self._log_faults(foremost.faults)

    def _check(self, beliefs: Mapping[str, Belief]) -> None:
        for method, belief in beliefs.items():
            if method not in self._layer.methods:
                raise RefseqError(
                    f"localiser {self._layer.name!r}: method {method!r} was not told of; "
                    f"valid are {', '.join(self._layer.methods)}"
                )
            if len(belief.places) != len(self._places):
                raise RefseqError(
                    f"localiser {self._layer.name!r}, {method!r}: an answer over {len(belief.places)} places; "
                    f"valid is one over {len(self._places)}"
                )

    def _log_posterior(self, method: str, belief: Belief, truth: int | None) -> None:
        """The belief of now as bars, a mark below them where the robot is, and all beliefs so far.

        The Lost_Places are bars as well, each at the place that it lies behind.
        """
        bars = self._layer.path("posterior", method)
        if belief.lost_after is not None:
            self._stream.log(f"{bars}/lost_after", rr.BarChart(belief.lost_after, color=colours.LOST))
        at = rr.Clear(recursive=False) if truth is None else _mark(truth, belief)
        self._stream.log(f"{bars}/belief", rr.BarChart(belief.places, color=colours.BELIEVED))
        self._stream.log(f"{bars}/truth", at)
        history = self._histories[method]
        history.add(belief, truth)
        self._stream.log(self._layer.path("history", method), drawing(history.picture()))

    def _log_place(self, view: View, belief: Belief) -> None:
        """Pictures of the believed place, and which keys of now's are words of it."""
        there = self._places.views[belief.best] if self._places.views else None
        self._cameras |= view.images.keys() | (there.images.keys() if there else set())
        for camera in sorted(self._cameras):
            if there is not None:
                self._stream.log(self._layer.path("place", camera), frame(there, camera))
            if camera in self._worded:
                self._log_keys(camera, self._keypoints.marked(view, camera, belief.best))

    def _log_keys(self, camera: str, marked: MarkedKeypoints | None) -> None:
        path = self._layer.path("keys", camera)
        if marked is None:
            self._stream.log(path, rr.Clear(recursive=True))
            return
        self._stream.log(f"{path}/unmatched", _dots(marked.unmatched, colours.UNMATCHED, -1.2))
        self._stream.log(f"{path}/matched", _dots(marked.matched, colours.MATCHED, -2.2))

    def _log_faults(self, faults: tuple[DeclaredFault, ...]) -> None:
        """A line at the view at which a sensor is declared ill, and one where it is well again."""
        before = self._faults or ()
        lines = [(f"{fault}", rr.TextLogLevel.WARN) for fault in faults if fault not in before]
        lines += [
            (f"{fault.sensor} no more {fault.kind}", rr.TextLogLevel.INFO) for fault in before if fault not in faults
        ]
        if self._faults is None and not lines:
            lines = [("sensors are watched: all well", rr.TextLogLevel.INFO)]
        for line, level in lines:
            self._stream.log(self._layer.path("faults"), rr.TextLog(line, level=level))
        self._faults = faults

    def _log_plan(self, belief: Belief, pose: Pose | None) -> None:
        """Places that glow with their probability, a ring at the best one, and a line from there to the robot.

        Where it says lost, a ring of its own and a word are at the place where it was last sure.
        """
        if not len(self._places.known):
            return
        dots = rr.Points2D(
            north_up(self._places.table[:, :2]), colors=glow(belief.places[self._places.known]), radii=[-2.5]
        )
        self._stream.log(self._layer.path("plan", "places"), dots)
        at = self._places.poses[belief.best]
        strips: list[Points] = [] if at is None else [circle(RING, at)]
        if at is not None and pose is not None:
            strips.append(np.array([(at.x, at.y), (pose.x, pose.y)]))
        believed = rr.LineStrips2D([north_up(strip) for strip in strips], colors=[self._layer.ring], radii=[-1.5])
        self._stream.log(self._layer.path("plan", "believed"), believed)
        self._log_pose(belief, at)
        sure = None if belief.last_sure is None else self._places.poses[belief.last_sure]
        ring = [] if sure is None else [north_up(circle(RING, sure))]
        last = rr.LineStrips2D(ring, colors=[colours.LOST], radii=[-2.5], labels=["last sure"] * len(ring))
        self._stream.log(self._layer.path("plan", "last_sure"), last)

    def _log_pose(self, belief: Belief, place: Pose | None) -> None:
        """The robot's outline where its scan puts it beside the place, and an ellipse of two standard deviations."""
        strips = [] if belief.pose is None or place is None else _outline(belief.pose, place)
        found = rr.LineStrips2D([north_up(strip) for strip in strips], colors=[self._layer.ring], radii=[-1.0])
        self._stream.log(self._layer.path("plan", "pose"), found)


def _outline(pose: PoseBeside, place: Pose) -> list[Points]:
    """Outline of the robot at a pose beside a place, and the ellipse that it is in with 86 %, in the world [m]."""
    beside = Pose(pose.along, pose.aside, pose.heading)
    variances, axes = np.linalg.eigh(pose.covariance[:2, :2])
    ellipse = circle(2.0) * np.sqrt(np.maximum(variances, 0.0)) @ axes.T + (pose.along, pose.aside)
    return [in_world(in_world(ROBOT, beside), place), in_world(ellipse, place)]


def _mark(place: int, belief: Belief) -> rr.BarChart:
    """A short bar that hangs below a place, wide enough to be seen among thousands."""
    return rr.BarChart(
        np.full(1, -TRUTH_MARK * belief.places.max(), np.float32),
        abscissa=np.array([place], np.float32),
        widths=np.full(1, max(1.0, len(belief.places) / 60), np.float32),
        color=colours.TRUTH,
    )


def _dots(points: NDArray[np.float32], colour: Colour, radius: float) -> rr.Points2D:
    """Points of one colour; a negative radius is in points of the screen."""
    return rr.Points2D(points, colors=[colour], radii=[radius])


def glow(shares: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Probabilities (n,) as colours (n, 4): dark grey for none, the belief's orange for all."""
    weight = np.sqrt(np.clip(shares, 0, 1))[:, None]
    colour = (1 - weight) * np.array(colours.DIM) + weight * np.array(colours.BELIEVED)
    return np.concatenate([colour, np.full_like(weight, 255)], axis=-1).astype(np.uint8)
