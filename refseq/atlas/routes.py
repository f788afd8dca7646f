"""Shortest routes over a map: along which of its paths a robot comes from one place to another.

Paths are driven one way only. What a camera sees on the way back is another path, which has to be learnt; a robot
cannot be led along one backwards.

A route is planned as a traveller plans a journey by train: on board at a place, along a path from view to view, off
again at a place, and on board of the next path through it.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from refseq.errors import MapError
from refseq.map.map import Map
from refseq.map.paths.path import MapPath

START, END = "start", "end"
"""Names of a path's first and last view."""
CHANGE = 5.0
"""Saving that makes a change of paths worth it [m]; a choice: the length of the shortest stretch that is joined.

Views lie up to half a view's distance from the place that they share. Where changing were free, a route would hop from
path to path and gain that much, on paper, at every hop.
"""


class NoRouteError(MapError):
    """The map is as it should be, but no path leads on from one place to the other."""


@dataclass(frozen=True)
class Leg:
    """A path that is followed, by its name, from view ``first`` to view ``last``: ``length`` [m] by its odometry."""

    path: str
    first: int
    last: int
    length: float


@dataclass(frozen=True)
class Route:
    """The way from a place to another: its ``legs`` one after the other, and the ``places`` that it runs through.

    ``places`` (n,) are counted through all sequences (``Map.numbered``), start and goal among them; each leg begins
    at the place where the last one ended, or at one that is the same by a loop. To where one is already there is one
    place and no leg.
    """

    places: NDArray[np.intp]
    legs: tuple[Leg, ...]

    @property
    def length(self) -> float:
        """Sum of the legs' lengths [m]."""
        return math.fsum(leg.length for leg in self.legs)


def shortest_route(map_: Map, start: int, goal: int, *, change: float = CHANGE) -> Route:
    """The shortest route from a place to another, both counted through all sequences.

    A change of paths counts as much as ``change`` more metres, so that a route stays on a path unless leaving it is
    worth it; the route's own length is without them. Raises ``MapError`` for a place that is not there and a change
    below 0, ``NoRouteError`` where no path leads from the one to the other.
    """
    for place in (start, goal):
        if not 0 <= place < len(map_):
            raise MapError(f"place {place} is unknown; valid is 0 to {len(map_) - 1}")
    if not (math.isfinite(change) and change >= 0):
        raise MapError(f"change is {change} m; valid is 0 or more")
    try:
        nodes = nx.dijkstra_path(_journeys(map_, change), start, goal)
    except nx.NetworkXNoPath:
        names = place_name(map_, start), place_name(map_, goal)
        why = why_none(map_, start, goal)
        raise NoRouteError(f"no path leads from {names[0]} to {names[1]}: {why}") from None
    positions = [n - len(map_) for n in nodes if n >= len(map_)]
    at = np.concatenate([map_.numbered(path) for path in map_.paths])
    places = [place for place, _ in groupby([start, *at[positions].tolist(), goal])]
    return Route(np.array(places, np.intp), _legs(map_, nodes))


def islands(map_: Map) -> tuple[tuple[str, ...], ...]:
    """Paths of a map, by name, in groups between which no place is shared, the largest group first."""
    graph = nx.Graph()
    for number, path in enumerate(map_.paths):
        graph.add_edges_from((number, f"place {place}") for place in map_.numbered(path).tolist())
    parts = [sorted(node for node in part if isinstance(node, int)) for part in nx.connected_components(graph)]
    names = [tuple(map_.paths[number].name for number in part) for part in parts]
    return tuple(sorted(names, key=len, reverse=True))


def why_none(map_: Map, start: int, goal: int) -> str:
    """The reason why no route leads from a place to another."""
    here, there = (next((g for g in islands(map_) if _runs_through(map_, g, at)), ()) for at in (start, goal))
    if here == there:
        return "paths are driven one way only"
    return f"no place is shared by {_names(here)} and {_names(there)}"


def _runs_through(map_: Map, group: Sequence[str], place: int) -> bool:
    return any(place in map_.numbered(path) for path in map_.paths if path.name in group)


def _names(group: Sequence[str]) -> str:
    """Some paths by name, a few of many."""
    return ", ".join(group[:3]) + (f" and {len(group) - 3} more" if len(group) > 3 else "")


def place_of(map_: Map, name: str) -> int:
    """The place that people call PATH:VIEW, as ``east:3``: where view 3 of that path lies, counted through.

    Views are numbered as the path was learnt, from 0; ``east:start`` and ``east:end`` are the first and the last.
    Raises ``MapError`` for what is no such name, a path that the map does not have, and a view that the path does not
    have.
    """
    paths = {path.name: path for path in map_.paths}
    found = re.fullmatch(rf"(.+):({START}|{END}|-?[0-9]{{1,9}})", name, re.DOTALL)
    if found is None:
        known = map_.paths[0].name
        raise MapError(f"place {name!r} is no PATH:VIEW; valid is a path and a view of it: {known}:0, {known}:{END}")
    path = found[1]
    if path not in paths:
        raise MapError(f"place {name!r}: path {path!r} is unknown; valid are {', '.join(paths)}")
    ends = {START: 0, END: len(paths[path]) - 1}
    view = ends[found[2]] if found[2] in ends else int(found[2])
    if not 0 <= view < len(paths[path]):
        raise MapError(
            f"place {name!r}: path {path!r} has {len(paths[path])} views; valid is 0 to {len(paths[path]) - 1}"
        )
    return int(map_.numbered(paths[path])[view])


def place_name(map_: Map, place: int) -> str:
    """A place as people call it: by the first path through it, and its first view there."""
    for path in map_.paths:
        if len(views := np.flatnonzero(map_.numbered(path) == place)):
            return f"{path.name}:{views[0]}"
    return f"place {place}"  # of a map made by hand, where no path runs through it


def _journeys(map_: Map, change: float) -> nx.DiGraph:
    """Next steps of a route, with their costs [m].

    Nodes are the map's places, and after them the positions of all paths, path behind path: a place twice on a path,
    as where a robot dawdled, is two positions. On board is free; off costs a change, for the last leg too, of which
    every route has one. Where a path comes back to itself, its two places there are one.
    """
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(map_)))
    for one, other in map_.loops.tolist():
        graph.add_weighted_edges_from([(one, other, 0.0), (other, one, 0.0)])
    first = len(map_)
    for path in map_.paths:
        positions = range(first, first + len(path))
        places = map_.numbered(path).tolist()
        graph.add_weighted_edges_from(zip(places, positions, [0.0] * len(path), strict=True))
        graph.add_weighted_edges_from(zip(positions, places, [change] * len(path), strict=True))
        steps = zip(pairwise(positions), np.diff(path.along).tolist(), strict=True)
        graph.add_weighted_edges_from((here, there, step) for (here, there), step in steps)
        first += len(path)
    return graph


def _legs(map_: Map, nodes: list[int]) -> tuple[Leg, ...]:
    """The runs of positions between the places of a journey."""
    ends = np.cumsum([len(map_), *map(len, map_.paths)])
    legs = []
    for on_board, run in groupby(nodes, key=lambda node: node >= len(map_)):
        if on_board:
            positions = list(run)
            number = int(np.searchsorted(ends, positions[0], side="right")) - 1
            first, last = positions[0] - int(ends[number]), positions[-1] - int(ends[number])
            legs.append(_leg(map_.paths[number], first, last))
    return tuple(legs)


def _leg(path: MapPath, first: int, last: int) -> Leg:
    return Leg(path.name, first, last, float(path.along[last] - path.along[first]))
