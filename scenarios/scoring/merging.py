"""Several drives made one map, as scorers see it: answers and joins by the views that were learnt.

The views of all drives are counted through, one drive behind the other. A place of the map is the view that it was
learnt from; a view that was taken out is where the view is that holds its place now.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from refseq.atlas.decision import Decision
from refseq.belief import LOST, Belief

if TYPE_CHECKING:
    from refseq.map.map import Map


@dataclass(frozen=True, slots=True)
class Merging:
    """Record of a merging: what became of the K views of several drives.

    ``names`` are those of the drives, ``lengths`` their numbers of views; ``held_by`` (K,) is for each view the one
    whose place it is at now, mostly itself. ``size`` are the bytes of all maps before and of the atlas after, and
    ``seconds`` what merging took.
    """

    names: tuple[str, ...]
    lengths: tuple[int, ...]
    held_by: NDArray[np.intp]
    decisions: tuple[Decision, ...]
    size: tuple[int, int]
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and words."""
        return asdict(self) | {"held_by": self.held_by.tolist()}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """The inverse of ``to_dict``."""
        return cls(
            names=tuple(content["names"]),
            lengths=tuple(content["lengths"]),
            held_by=np.array(content["held_by"], np.intp),
            decisions=tuple(_decision(one) for one in content["decisions"]),
            size=(int(content["size"][0]), int(content["size"][1])),
            seconds=float(content["seconds"]),
        )


def _decision(content: Mapping[str, Any]) -> Decision:
    pairs = {name: tuple(content[name]) for name in ("first", "second", "lengths")}
    return Decision(**{**content, **pairs})


def merged_drives(maps: "Sequence[Map]", merging: bool) -> "tuple[Map, Merging]":
    """One map of the maps of several drives, merged or each as it is, and what became of their views."""
    # Slow to import: scenarios are declared and scored without them.
    from refseq.atlas.merge import Merged, merge_maps
    from refseq.map.map import beside

    begin = time.perf_counter()
    found = merge_maps(maps) if merging else Merged(beside(maps), ())
    seconds = time.perf_counter() - begin
    size = sum(len(one.to_bytes()) for one in maps), len(found.map.to_bytes())
    names, lengths = tuple(one.paths[0].name for one in maps), tuple(map(len, maps))
    return found.map, Merging(names, lengths, found.map.held_by, found.decisions, size, seconds)


def by_views(map_: "Map", belief: Belief) -> Belief:
    """A belief about a map's places as one about all views that were learnt: those that were taken out have none."""
    views, count = map_.learnt, sum(map(len, map_.paths))

    def spread(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.zeros(count)
        found[views] = shares
        return found

    path = tuple(place if place == LOST else int(views[place]) for place in belief.path)
    lost_after = None if belief.lost_after is None else spread(belief.lost_after)
    best = int(views[belief.best])
    return replace(belief, places=spread(belief.places), best=best, path=path, lost_after=lost_after)
