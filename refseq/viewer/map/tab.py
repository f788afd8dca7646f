"""The tab *Map*: the places of a map, and of several paths what they share."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.belief import Belief
from refseq.errors import RefseqError
from refseq.map.map import Map
from refseq.view import View
from refseq.viewer.map.contents import PlacePanels
from refseq.viewer.map.paths import PathPanels
from refseq.viewer.places import Places


@dataclass(frozen=True)
class MapTab:
    """A map; with the ``views`` that it was learnt from, their frames and scans too.

    Of a map of several paths also what they share and, for a ``drive`` localised in it, P(sequence): ``answers`` holds,
    for each method, one belief a view of the drive, over the map's places; the last method's is drawn in the plan.
    ``decisions`` are the log of the merging: refused joins are drawn as well. ``before`` are maps as they were learnt,
    by the paths' names: with them a table shows what merging or reducing took out. ``outline`` are walls and the like,
    lines (m, 2) [m]. Raises ``RefseqError`` for answers over other places and, on sending, where their number is not
    that of the views.
    """

    map: Map
    views: Sequence[View] = ()
    drive: Iterable[View] = ()
    answers: Mapping[str, Sequence[Belief]] = field(default_factory=dict)
    decisions: Sequence[Decision] = ()
    before: Mapping[str, Map] = field(default_factory=dict)
    outline: Sequence[NDArray[np.float64]] = ()

    def __post_init__(self) -> None:
        for method, beliefs in self.answers.items():
            if wrong := {len(belief.places) for belief in beliefs} - {len(self.map)}:
                raise RefseqError(
                    f"method {str(method)!r}: answers over {min(wrong)} places; valid is over the {len(self.map)} "
                    "places of the map"
                )

    @property
    def name(self) -> str:
        """The tab's title."""
        return "Map"

    @cached_property
    def _places(self) -> PlacePanels:
        names = [name or "map" for name in self.map.names]
        return PlacePanels(Places.of(self.map, self.views), names)

    @cached_property
    def _paths(self) -> PathPanels | None:
        """The panels of the paths; None of a single path that nothing was taken out of."""
        if self.map.has_one_path and not self.before:
            return None
        return PathPanels(self.map, self.drive, self.answers, self.decisions, self.before, self.outline)

    def layout(self) -> rrb.Container:
        """The places; of several paths a tab about the paths before them."""
        places = self._places.layout()
        if self._paths is None:
            return places
        paths = self._paths.layout()
        paths.name, places.name = "paths", "places"
        return rrb.Tabs(paths, places)

    def send(self, stream: rr.RecordingStream) -> None:
        """Log place by place, then the drive view by view."""
        self._places.send(stream)
        if self._paths is not None:
            self._paths.send(stream)
