"""Routes in maps, as tables and in words."""

from refseq.atlas.routes import Route
from refseq_bench.scenarios.tables import TextTable


def leg_table(found: Route) -> TextTable:
    """The legs of a route, a row each."""
    table = TextTable("path", ">views", ">length [m]", wraps=("path",))
    for leg in found.legs:
        table.add_row(leg.path, f"{leg.first}-{leg.last}", f"{leg.length:.1f}")
    return table


def route_in_words(found: Route) -> str:
    """Numbers of places and legs."""
    if not found.legs:
        return "the same place"
    legs = "1 leg" if len(found.legs) == 1 else f"{len(found.legs)} legs"
    return f"{len(found.places)} places, {legs}"
