"""``refseq route``: from one place of an atlas to another, and along which of its paths."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import err, out, say

if TYPE_CHECKING:
    from refseq.atlas.routes import Route
    from scenarios.tables import TextTable

NO_ROUTE = 1
EXAMPLES = """Examples:

* `refseq route atlas.refseq east:3 west:90`"""


def route(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="A map (.refseq).")],
    start: Annotated[
        str, typer.Argument(metavar="START", help="Where from: PATH:VIEW, a path and a view of it, from 0: east:3.")
    ],
    goal: Annotated[str, typer.Argument(metavar="GOAL", help="Where to, named likewise.")],
) -> None:
    """Find the shortest route between two places of an atlas; paths are driven one way only. Exit 1 if none leads."""
    from refseq.atlas.routes import NoRouteError, place_of, shortest_route
    from refseq.map.map import Map

    loaded = Map.load(map_file)
    ends = place_of(loaded, start), place_of(loaded, goal)
    try:
        found = shortest_route(loaded, *ends)
    except NoRouteError:
        # A place has as many names as paths run through it: say those that were asked for.
        say(err, f"no path leads from {start} to {goal}: paths are driven one way only")
        raise typer.Exit(NO_ROUTE) from None
    if found.legs:
        out.print(leg_table(found))
    say(out, f"{found.length:.1f} m from {start} to {goal}, {_counted(found)}")


def leg_table(found: "Route") -> "TextTable":
    """The legs of a route, a row each."""
    from scenarios.tables import TextTable

    table = TextTable("path", ">views", ">length [m]", wraps=("path",))
    for leg in found.legs:
        table.add_row(leg.path, f"{leg.first}-{leg.last}", f"{leg.length:.1f}")
    return table


def _counted(found: "Route") -> str:
    if not found.legs:
        return "the same place"
    legs = "1 leg" if len(found.legs) == 1 else f"{len(found.legs)} legs"
    return f"{len(found.places)} places, {legs}"
