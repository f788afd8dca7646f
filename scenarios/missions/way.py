"""The way of a mission between two places of a map, as commands and pages name them."""

from typing import TYPE_CHECKING

from refseq.missions import MissionPath, path_along, path_of

if TYPE_CHECKING:
    from refseq.map.map import Map


def way_between(map_: "Map", start: str | None = None, goal: str | None = None) -> MissionPath:
    """The first path as it was driven, where nothing is said; else the shortest way, by default from and to its ends.

    ``start`` and ``goal`` are called PATH:VIEW. The shortest way leaves out the round of a path that comes back to
    itself. Raises ``MapError`` for a place that there is not, and ``NoRouteError`` where no way leads to it.
    """
    if not (start or goal):
        return path_along(map_)
    from refseq.atlas.routes import place_of, shortest_route  # graphs, which a path as it was driven does not need

    first = map_.paths[0]
    begin = place_of(map_, start or f"{first.name}:0")
    return path_of(map_, shortest_route(map_, begin, place_of(map_, goal or f"{first.name}:{len(first) - 1}")))
