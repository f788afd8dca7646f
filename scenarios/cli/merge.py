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
    from refseq.map.sequence import ReferenceSequence

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
    from refseq.atlas.merge import merge as merged
    from refseq.atlas.overlap import OverlapSettings
    from refseq.map.file import load_map
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
    first, second = load_map(one), load_map(other)
    _check_maps(first, [(other, second)])
    decisions = merged([one.stem, other.stem], [first, second], OverlapSettings(least=least)).decisions
    found = similarity_of(one.stem, first, other.stem, second)
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
    from refseq.atlas.file import load_atlas, save_atlas
    from refseq.atlas.merge import added, leave_it
    from refseq.atlas.overlap import OverlapSettings
    from refseq.map.file import load_map
    from scenarios.maps.joins import decision_table, read_decisions, write_decisions

    for path in (output, *([log] if log else [])):
        check_output(path)
    if log is not None and log.resolve() == output.resolve():
        raise ScenarioError(f"{log}: is the atlas and the log at once; valid are two files")
    wishes = read_decisions(decisions) if decisions else []
    settings = OverlapSettings(least=least)
    atlas = load_atlas(maps[0])
    sequences = [(path.stem, load_map(path)) for path in maps[1:]]
    before = len(atlas) + sum(len(sequence) for _, sequence in sequences)
    _check_names([path.name for path in atlas.paths], [name for name, _ in sequences], wishes)
    _check_maps(atlas.sequences[0], list(zip(maps[1:], (sequence for _, sequence in sequences), strict=True)))
    _check_wishes({path.name: len(path) for path in atlas.paths} | {n: len(s) for n, s in sequences}, wishes)
    told: list[Decision] = []
    for name, sequence in sequences:
        merged = added(atlas, name, sequence, settings, ask if confirm else leave_it, wishes)
        atlas = merged.atlas
        told.extend(merged.decisions)
    if log is not None:
        write_decisions(log, told)
    save_atlas(atlas, output)
    if told:
        out.print(decision_table(told))
    say(
        out,
        f"{output}: {len(atlas.paths)} paths, {len(atlas)} places of {before}, {len(atlas.links)} links, "
        f"{sum(decision.joined for decision in told)} of {len(told)} stretches joined",
    )


def _check_names(there: Sequence[str], new: Sequence[str], wishes: "Sequence[Decision]") -> None:
    from refseq.atlas.atlas import check_names

    known = [*there, *new]
    check_names(known)
    for wish in wishes:
        for name in (wish.one, wish.other):
            if name not in known:
                raise ScenarioError(f"decisions: sequence {name!r} is unknown; valid are {', '.join(known)}")


def _check_maps(first: "ReferenceSequence", others: "Sequence[tuple[Path, ReferenceSequence]]") -> None:
    """Tell which file does not go with the first before any is merged."""
    from refseq.atlas.similarity import check_comparable
    from refseq.errors import MapError

    for path, sequence in others:
        try:
            check_comparable(first, sequence)
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
