"""Routes in maps, as tables and in words."""

from refseq.atlas.routes import Route
from refseq_bench.scenarios.tables import TextTable, plural


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
    return f"{plural(len(found.places), 'place')}, {plural(len(found.legs), 'leg')}"
