"""Similarity of all paths of a map as one square picture, with the joined and the refused stretches."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.map.map import Map
from refseq.viewer.drawing.colours import TEXT, TRUTH, Colour
from refseq.viewer.drawing.pictures import drawing, inferno
from refseq.viewer.map.marks import of_path, send_labels
from refseq.viewer.map.similarity import Mosaic, shared_stretches

JOINED: Colour = TRUTH
REFUSED: Colour = (255, 255, 255)
TICKS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
MOST_TICKS = 16
LIFT = 0.02
"""A label hangs below its point on the screen: beside a row it is lifted by so much of the picture's height."""
LETTER = 0.018
"""About how wide a letter of a label is, in shares of the picture's width."""
ORIGIN = "map/paths/alike"


@dataclass(frozen=True)
class Square:
    """The square of a ``map``; of the ``decisions`` of its merging those that were refused are drawn."""

    map: Map
    decisions: Sequence[Decision] = ()

    @cached_property
    def _mosaic(self) -> Mosaic:
        return Mosaic(self.map)

    def view(self) -> rrb.View:
        """The panel."""
        side = self._mosaic.side
        bounds = rrb.VisualBounds2D(
            x_range=[-(0.07 + self._longest) * side, 1.04 * side],
            y_range=[-0.04 * side, (1.07 + 0.05 * self._levels) * side],
        )
        marks = [text for text, there in (("blue: joined", self._joined), ("white: refused", self._refused)) if there]
        name = "; ".join(["P(place ↑ | view →), one view alone", *marks])
        return rrb.Spatial2DView(origin=ORIGIN, name=name, visual_bounds=bounds)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log all of it; nothing of it changes."""
        stream.log(f"{ORIGIN}/picture", drawing(inferno()[self._mosaic.grey()]), static=True)
        self._send_axes(stream)
        if self._joined:
            stream.log(f"{ORIGIN}/joined", rr.LineStrips2D(self._joined, colors=JOINED, radii=-1.5), static=True)
        if self._refused:
            lines, why = zip(*self._refused, strict=True)
            refused = rr.LineStrips2D(lines, labels=why, show_labels=False, colors=REFUSED, radii=-1.5)
            stream.log(f"{ORIGIN}/refused", refused, static=True)

    def _send_axes(self, stream: rr.RecordingStream) -> None:
        """Borders between the paths, their names, and the numbers of some views."""
        side, unit, paths = self._mosaic.side, self._mosaic.unit, self.map.paths
        edges = [float(edge) / unit for edge in self._mosaic.first]
        lines = [line for e in edges for line in (((e, 0), (e, side)), ((0, side - e), (side, side - e)))]
        stream.log(f"{ORIGIN}/borders", rr.LineStrips2D(lines, colors=TEXT, radii=-0.6), static=True)
        for number, path in enumerate(paths):
            middle = (edges[number] + edges[number + 1]) / 2
            level = 1.06 + 0.05 * (number % self._levels)
            spots = [(middle, level * side), (-(0.06 + self._longest / 2) * side, (1 - LIFT) * side - middle)]
            send_labels(stream, f"{ORIGIN}/names/{number}", spots, [path.name] * 2, of_path(number))
        ticks = [(edges[n] + view / unit, str(view)) for n, path in enumerate(paths) for view in self._ticks(len(path))]
        spots = [spot for at, _ in ticks for spot in ((at, 1.02 * side), (-0.03 * side, (1 - LIFT) * side - at))]
        send_labels(stream, f"{ORIGIN}/ticks", spots, [word for _, word in ticks for _ in range(2)], TEXT)

    @property
    def _longest(self) -> float:
        """About how wide the longest name is, in shares of the picture."""
        return LETTER * max(len(path.name) for path in self.map.paths)

    @property
    def _levels(self) -> int:
        """In how many rows the names stand below the picture, so that they do not cover each other."""
        narrowest = min(len(path) for path in self.map.paths) / self._mosaic.size
        return min(len(self.map.paths), max(1, math.ceil(self._longest / narrowest)))

    def _ticks(self, views: int) -> range:
        """Views of a path that are told by number: a round step apart, those of all paths not too many."""
        step = next((step for step in TICKS if self._mosaic.size / step <= MOST_TICKS), TICKS[-1])
        return range(0, max(1, views - step // 3), step)

    @cached_property
    def _joined(self) -> list[NDArray[np.float64]]:
        """A line for each stretch that two paths share, in both of the fields that are about them."""
        stretches = shared_stretches(self.map)
        return [line for s in stretches for line in self._both(s.one, s.other, s.views[[0, -1]])]

    @cached_property
    def _refused(self) -> list[tuple[NDArray[np.float64], str]]:
        """A line for each stretch that was refused, in both fields, and why."""
        number = {path.name: n for n, path in enumerate(self.map.paths)}
        return [
            (line, decision.why)
            for decision in self.decisions
            if not decision.joined
            for line in self._both(
                number[decision.one], number[decision.other], np.array([decision.first, decision.second]).T
            )
        ]

    def _both(self, one: int, other: int, ends: NDArray[np.intp]) -> list[NDArray[np.float64]]:
        return [self._mosaic.at(one, other, ends), self._mosaic.at(other, one, ends[:, ::-1])]
