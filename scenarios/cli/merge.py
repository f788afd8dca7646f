"""``refseq similarity``: two maps beside each other; ``refseq merge``: several maps to one atlas."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import out, say
from scenarios.drives.inputs import check_output, writing
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from refseq.atlas.merge import Decision
    from refseq.map.map import Map

Least = Annotated[float, typer.Option(metavar="M", help="Shortest stretch that is joined [m].")]
SIMILARITY_EXAMPLES = """Examples:

* `refseq similarity east.refseq west.refseq`
* `refseq similarity east.refseq west.refseq -o alike.png --arrays alike.npz`"""
MERGE_EXAMPLES = """Examples:

* `refseq merge east.refseq west.refseq -o atlas.refseq`
* `refseq merge atlas.refseq north.refseq -o larger.refseq --log joins.toml`
* `refseq merge east.refseq west.refseq -o atlas.refseq --decisions joins.toml`"""


def similarity(
    one: Annotated[Path, typer.Argument(help="A map (.refseq).")],
    other: Annotated[Path, typer.Argument(help="Another map.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Picture to draw (.png, .svg or .pdf).")
    ] = None,
    arrays: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Both matrices to write, there and back (.npz).")
    ] = None,
    least: Least = 5.0,
) -> None:
    """Compare the views of two maps, and tell which stretches they share; nothing is merged."""
    from refseq.atlas.merge import merge_maps
    from refseq.atlas.overlap import OverlapSettings
    from scenarios.maps.joins import decision_table
    from scenarios.maps.matrix import check_picture
    from scenarios.maps.similarity import draw, similarity_of, write_arrays

    for path in (output, arrays):
        if path is not None:
            check_output(path)
    if output is not None:
        check_picture(output)
    if arrays is not None and arrays.suffix != ".npz":
        raise ScenarioError(f"{arrays}: is no name for arrays; valid is one that ends in .npz")
    first, second = _of_one_path(one), _of_one_path(other)
    _check_maps(first, {other: second})
    decisions = merge_maps([first, second], OverlapSettings(least=least)).decisions
    found = similarity_of(first, second)
    if decisions:
        out.print(decision_table(decisions))
    else:
        say(out, "no view of one leads to the other and back")
    if arrays is not None:
        with writing(arrays):
            write_arrays(arrays, found)
        say(out, f"{arrays}")
    if output is not None:
        with writing(output):
            draw(output, found, decisions)
        say(out, f"{output}")


def merge(
    maps: Annotated[
        list[Path], typer.Argument(metavar="MAP...", help="Maps (.refseq); the first may be an atlas to add to.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Atlas to write (.refseq).")],
    log: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Decisions to write, and why each was made (.toml).")
    ] = None,
    decisions: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Such a file with a person's decisions, which hold.")
    ] = None,
    confirm: Annotated[bool, typer.Option("--confirm", help="Ask about every join on the terminal.")] = False,
    least: Least = 5.0,
) -> None:
    """Merge maps into an atlas: what two of them share is kept in one of them, and linked."""
    from refseq.atlas.merge import leave_it, merge_maps
    from refseq.atlas.overlap import OverlapSettings
    from refseq.map.map import Map
    from scenarios.maps.joins import decision_table, read_decisions, write_decisions

    for path in (output, *([log] if log else [])):
        check_output(path)
    if log is not None and log.resolve() == output.resolve():
        raise ScenarioError(f"{log}: is the atlas and the log at once; valid are two files")
    wishes = read_decisions(decisions) if decisions else []
    settings = OverlapSettings(least=least)
    first = Map.load(maps[0])
    others = {path: _of_one_path(path) for path in maps[1:]}
    every = [first, *others.values()]
    views = {path.name: len(path) for one in every for path in one.paths}
    _check_names([path.name for one in every for path in one.paths], wishes)
    _check_maps(first, others)
    _check_wishes(views, wishes)
    found = merge_maps(every, settings, ask if confirm else leave_it, wishes)
    told = found.decisions
    if log is not None:
        write_decisions(log, told)
    found.map.save(output)
    if told:
        out.print(decision_table(told))
    say(
        out,
        f"{output}: {len(found.map.paths)} paths, {len(found.map)} places of {sum(map(len, every))}, "
        f"{len(found.map.links)} links, "
        f"{sum(decision.joined for decision in told)} of {len(told)} stretches joined",
    )


def _of_one_path(path: Path) -> "Map":
    from refseq.errors import MapError
    from refseq.map.map import Map

    found = Map.load(path)
    if not found.has_one_path:
        raise MapError(f"{path}: is a map of several paths; valid is a map of one")
    return found


def _check_names(known: Sequence[str], wishes: "Sequence[Decision]") -> None:
    from refseq.map.map import check_names

    check_names(known)
    for wish in wishes:
        for name in (wish.one, wish.other):
            if name not in known:
                raise ScenarioError(f"decisions: sequence {name!r} is unknown; valid are {', '.join(known)}")


def _check_maps(first: "Map", others: "Mapping[Path, Map]") -> None:
    """Tell which file does not go with the first before any is merged."""
    from refseq.errors import MapError
    from refseq.map.sequence import check_comparable

    for path, other in others.items():
        try:
            check_comparable(first.sequences[0], other.sequence)
        except MapError as error:
            raise MapError(f"{path}: {error}") from error


def _check_wishes(views: Mapping[str, int], wishes: "Sequence[Decision]") -> None:
    """Tell of decisions that nothing would ever be decided by; ``views`` are those of each path, in their order."""
    order = list(views)
    for wish in wishes:
        if wish.one == wish.other:
            raise ScenarioError(f"decisions: {wish.one!r} is one and other; valid are two sequences")
        if order.index(wish.one) > order.index(wish.other):
            raise ScenarioError(
                f"decisions: {wish.one!r} comes first in {wish.one!r} and {wish.other!r}; "
                f"valid is {wish.other!r}, which is merged before it"
            )
        for name, (first, last) in ((wish.one, wish.first), (wish.other, wish.second)):
            if last >= views[name]:
                raise ScenarioError(
                    f"decisions: {name!r} has no views {first} to {last}; valid are 0 to {views[name] - 1}"
                )


def ask(decision: "Decision") -> "Decision":
    """Ask on the terminal whether a join is right; an empty answer leaves it as it is."""
    from scenarios.maps.joins import BY_A_PERSON

    say(
        out,
        f"{decision.one} views {decision.first[0]}-{decision.first[1]} and {decision.other} views "
        f"{decision.second[0]}-{decision.second[1]}, {decision.lengths[0]:.1f} and {decision.lengths[1]:.1f} m: "
        f"{decision.why}",
    )
    joined = typer.confirm("join them?", default=decision.joined)
    return decision if joined is decision.joined else replace(decision, joined=joined, why=BY_A_PERSON)
