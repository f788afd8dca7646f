"""The paths of a map as strips, one above the other: a mark a view, in the colour of who holds its place."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.belief import Belief
from refseq.map.map import Map
from refseq.map.paths.path import MapPath
from refseq.viewer.drawing.colours import BELIEVED, DIM, TEXT
from refseq.viewer.map.marks import of_path, send_labels

HEIGHT = 0.45
"""All strips together are about so many times as high as the longest is wide."""
LETTER = 0.025
"""About how wide a letter of a label is, in shares of the strips' length."""
SAME = 1e-6
"""Views nearer to each other than this are one [m]."""
ORIGIN = "map/paths/strips"


@dataclass(frozen=True)
class Strips:
    """Strips of a ``map``: views lie to the right by their distance along the path [m], the first path on top.

    Views that a map ``before`` had, by its path's name, and the path has no more were taken out: they are dim.
    """

    map: Map
    before: Mapping[str, Map] = field(default_factory=dict)

    @property
    def telling(self) -> bool:
        """True where a strip shows more than places in a row."""
        return len(self.map.paths) > 1 or any(len(self._gone(path)) for path in self.map.paths)

    @property
    def _length(self) -> float:
        return max(float(path.along[-1]) for path in self.map.paths) or 1.0

    @property
    def _longest(self) -> float:
        """About how wide the longest name is, in shares of the strips' length."""
        return LETTER * max(len(path.name) for path in self.map.paths)

    @property
    def _pitch(self) -> float:
        """From one strip to the next."""
        return HEIGHT * self._length / max(len(self.map.paths), 2)

    def view(self) -> rrb.View:
        """The panel."""
        low = self._pitch * (len(self.map.paths) - 0.1)
        bounds = rrb.VisualBounds2D(
            x_range=[-(0.05 + self._longest) * self._length, 1.04 * self._length], y_range=[-0.8 * self._pitch, low]
        )
        name = "who holds each view's place, by colour [m]"
        return rrb.Spatial2DView(origin=ORIGIN, name=name, visual_bounds=bounds)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log what does not change."""
        number = {path.name: n for n, path in enumerate(self.map.paths)}
        holders = [number[name] for name in self.map.names]
        for row, path in enumerate(self.map.paths):
            spots = self._spots(row)
            colours = [of_path(holders[sequence]) for sequence in path.sequences]
            stream.log(f"{ORIGIN}/views/{row}", rr.Points2D(spots, colors=colours, radii=-3.0), static=True)
            if len(gone := self._gone(path)):
                lost = np.stack([gone, np.full(len(gone), row * self._pitch)], axis=1)
                stream.log(f"{ORIGIN}/gone/{row}", rr.Points2D(lost, colors=DIM, radii=-2.0), static=True)
            label = [(-(0.03 + self._longest / 2) * self._length, row * self._pitch - 0.03 * self._length)]
            send_labels(stream, f"{ORIGIN}/names/{row}", label, [path.name], of_path(row))
        metres = _round_metres(self._length)
        low = self._pitch * (len(self.map.paths) - 0.4)
        send_labels(stream, f"{ORIGIN}/metres", [(x, low) for x in metres], [f"{x:g}" for x in metres], TEXT)

    def send_belief(self, stream: rr.RecordingStream, belief: Belief) -> None:
        """A ring around the best place, on each path that runs through it."""
        spots = [self._spots(row)[self.map.numbered(path) == belief.best] for row, path in enumerate(self.map.paths)]
        rings = [spot + 0.15 * self._pitch * _RING for spot in np.concatenate(spots)]
        stream.log(f"{ORIGIN}/best", rr.LineStrips2D(rings, colors=BELIEVED, radii=-1.2))

    def _gone(self, path: MapPath) -> NDArray[np.float64]:
        """Positions of views that a path has lost, from its first one on [m]."""
        if path.name not in self.before or path.name not in self.map.names:
            return np.zeros(0)
        own = self.map.names.index(path.name)
        held = self.map.sequences[own].along
        # A path begins with 0, a map that was reduced where its first place was.
        origin = held[0] - path.along[path.sequences == own][0]
        before = self.before[path.name].sequence.along - origin
        apart = np.abs(before[:, None] - path.along[None, :]).min(axis=1)
        return np.asarray(before[apart > SAME])

    def _spots(self, row: int) -> NDArray[np.float64]:
        along = self.map.paths[row].along
        return np.stack([along, np.full(len(along), row * self._pitch)], axis=1)


_RING = np.stack([np.cos(np.linspace(0, 2 * np.pi, 25)), np.sin(np.linspace(0, 2 * np.pi, 25))], axis=1)


def _round_metres(length: float) -> list[float]:
    """Some round numbers from 0 to a length, both of them at most six apart."""
    step = next(unit * 10**power for power in range(7) for unit in (1, 2, 5) if length / (unit * 10**power) <= 6)
    return [float(x) for x in np.arange(0, length + 1e-9, step)]
