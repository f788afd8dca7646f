"""Panels about the paths of a map: how alike they are, what they share, what is left, and P(sequence) over time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import tee

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.belief import Belief
from refseq.errors import RefseqError
from refseq.map.map import Map
from refseq.view import View
from refseq.viewer.belief_log import entity_part
from refseq.viewer.drawing.colours import LOST
from refseq.viewer.map.marks import of_path
from refseq.viewer.map.plan import PathsPlan
from refseq.viewer.map.sizes import sizes_table
from refseq.viewer.map.square import Square
from refseq.viewer.map.strips import Strips
from refseq.viewer.timelines import TimePoint, set_time_point, time_points_of

WIDE = 2.5
"""A plan this many times wider than high goes above the others, over their whole width."""


@dataclass(frozen=True)
class PathPanels:
    """Panels about the paths of a ``map``: how alike they are, what they share, and P(sequence) over a ``drive``.

    The fields are those of ``MapTab``. Raises ``RefseqError`` on sending where a method has not one answer a view.
    """

    map: Map
    drive: Iterable[View] = ()
    answers: Mapping[str, Sequence[Belief]] = field(default_factory=dict)
    decisions: Sequence[Decision] = ()
    before: Mapping[str, Map] = field(default_factory=dict)
    outline: Sequence[NDArray[np.float64]] = ()

    @cached_property
    def _square(self) -> Square:
        return Square(self.map, self.decisions)

    @cached_property
    def _plan(self) -> PathsPlan:
        return PathsPlan(self.map, self.outline)

    @cached_property
    def _strips(self) -> Strips:
        return Strips(self.map, self.before)

    # --- layout ---

    def layout(self) -> rrb.Container:
        """On the left how alike the paths are; then the plan, who holds which places, sizes, and P(s) over time."""
        plan = [self._plan.view(moving=bool(self.answers))] if self._plan.known else []
        table = rrb.TextDocumentView(origin="map/paths/sizes", name="what is left")
        strips = [self._strips.view()] if self._strips.telling else []
        rest = [rrb.Horizontal(*strips, table), *self._shares_views()]
        if self._plan.known and self._plan.aspect >= WIDE:
            below = rrb.Horizontal(self._square.view(), rrb.Vertical(*rest), column_shares=[1.0, 1.5])
            return rrb.Vertical(*plan, below, row_shares=[1.0, 2.2])
        return rrb.Horizontal(self._square.view(), rrb.Vertical(*plan, *rest), column_shares=[1.0, 1.3])

    def _shares_views(self) -> list[rrb.Container]:
        views = [
            rrb.TimeSeriesView(
                origin=f"map/paths/share/{entity_part(method)}",
                name=f"P(sequence), {method}",
                axis_y=rrb.ScalarAxis(range=(-0.03, 1.03), zoom_lock=True),
                plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
            )
            for method in self.answers
        ]
        return [rrb.Horizontal(*views)] if views else []

    # --- data ---

    def send(self, stream: rr.RecordingStream) -> None:
        """Log what does not change, then the drive, view by view."""
        self._square.send(stream)
        if self._strips.telling:
            self._strips.send(stream)
        self._plan.send(stream)
        table = rr.TextDocument(sizes_table(self.map, self.before), media_type="text/markdown")
        stream.log("map/paths/sizes", table, static=True)
        for method in self.answers:
            self._send_series(stream, method)
        views = 0
        for view, moment in _with_moments(self.drive):
            self._send_view(stream, view, moment)
            views += 1
        for method, beliefs in self.answers.items():
            if len(beliefs) != views:
                raise RefseqError(f"method {str(method)!r}: {len(beliefs)} answers; valid is one a view, {views}")

    def _send_series(self, stream: rr.RecordingStream, method: str) -> None:
        """Names and colours of the lines of P(sequence)."""
        number = {path.name: n for n, path in enumerate(self.map.paths)}
        for name in self.map.names:
            looks = rr.SeriesLines(colors=of_path(number[name]), names=name, widths=1.5)
            stream.log(_share(method, name), looks, static=True)
        stream.log(_lost(method), rr.SeriesLines(colors=LOST, names="(lost)", widths=1.0), static=True)

    def _send_view(self, stream: rr.RecordingStream, view: View, moment: TimePoint) -> None:
        set_time_point(stream, moment)
        self._plan.send_pose(stream, view.truth)
        for method, beliefs in self.answers.items():
            if moment.view < len(beliefs):  # else it is told when all views are counted
                self._send_shares(stream, method, beliefs[moment.view])
        foremost = [beliefs[moment.view] for beliefs in self.answers.values() if moment.view < len(beliefs)][-1:]
        for belief in foremost:
            self._plan.send_belief(stream, belief)
            if self._strips.telling:
                self._strips.send_belief(stream, belief)

    def _send_shares(self, stream: rr.RecordingStream, method: str, belief: Belief) -> None:
        for name, share in zip(self.map.names, self.map.sequence_probabilities(belief), strict=True):
            stream.log(_share(method, name), rr.Scalars((1 - belief.lost) * share))
        stream.log(_lost(method), rr.Scalars(belief.lost))


def _with_moments(views: Iterable[View]) -> Iterator[tuple[View, TimePoint]]:
    """Each view and its moment, in one pass."""
    one, two = tee(views)
    return zip(one, time_points_of(two), strict=True)


def _share(method: str, name: str) -> str:
    return f"map/paths/share/{entity_part(method)}/of/{entity_part(name)}"


def _lost(method: str) -> str:
    return f"map/paths/share/{entity_part(method)}/lost"
