"""The command ``refseq map add``: a later drive as further experiences of a map's places, or as new paths beside it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import err, out, print_json
from refseq_bench.scenarios.cli.terminal.options import (
    LOG_KINDS,
    Json,
    MapFile,
    NoisySelection,
    Seed,
    defaulting,
    flag,
    grouped,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import MAP_TO_WRITE
from refseq_bench.scenarios.drives.inputs import check_output, load_map, read_drive, replacement
from refseq_bench.scenarios.drives.learnt_views import learnt_notes
from refseq_bench.scenarios.errors import about
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq.atlas.explore import ExploredPath
    from refseq.map.growth.adding import Grown
    from refseq.map.map import Map
    from refseq_bench.scenarios.maps.explored import Extensible

ADD_HELP = """Examples:

* `refseq map add map.refseq evening.mcap`
* `refseq map add map.refseq evening.mcap -o larger.refseq`
* `refseq map add whole.refseq evening.mcap --most 2 --well 0.8`
* `refseq map add whole.refseq detour.mcap --explore`

With --explore stretches of a drive off the map become new paths, detour-1.refseq and so on beside the map that is
written, and are merged with it; no experience of a known place is kept. A drive that was added before adds nothing.
Exit codes: 0 done; 2 bad input, or another command has changed the map meanwhile: it stays as it was."""


@grouped
def add(
    map_file: MapFile,
    drive_file: Annotated[Path, typer.Argument(metavar="DRIVE", help=f"Later drive: {LOG_KINDS}")],
    output: Annotated[Path | None, defaulting(MAP_TO_WRITE, "MAP itself")] = None,
    well: Annotated[
        float,
        option("SHARE", "Keep a view that by itself finds its place with less probability.", min=0, max=1),
    ] = 0.5,
    most: Annotated[int, option("N", "Keep at most so many further experiences of a place.", min=1, max=100)] = 3,
    explore: Annotated[bool, flag("--explore", "Make new paths of what the drive shows off the map, instead.")] = False,
    seed: Seed = 1,
    as_json: Json = False,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """Let a map grow by a later drive along its paths: what was not recognised well is kept of it."""
    target = output or map_file
    check_output(target, of=[drive_file, *selection.chosen().files])
    replacing = replacement(target, [map_file])
    map_ = load_map(map_file)

    from refseq.map.growth.adding import GrowthSettings, add_drive, check_map

    with about(map_file):
        check_map(map_)
    if explore:
        from refseq.atlas.explore import explore as explore_map
        from refseq_bench.scenarios.maps.explored import extensible

        larger = extensible(map_file, target)
    drive = read_drive(drive_file, selection.with_noise(seed + 1))
    if explore:
        notes = learnt_notes(drive_file, drive.metadata, selection.chosen())
        with about(drive_file):
            found = explore_map(map_, drive.views, name=drive_file.stem, metadata=notes, seed=seed)
        with replacing:
            _add_paths(found, larger, drive_file, target, as_json=as_json)
        return

    from refseq_bench.scenarios.maps.merge_notes import STRETCHED

    rules = GrowthSettings(well=well, most=most)
    with about(drive_file):
        grown = add_drive(map_, drive.views, name=drive_file.name, metadata=drive.metadata, settings=rules, seed=seed)
    if not grown.known or output is not None:
        with replacing:
            grown.map.save(target)
    if abs(grown.stretch - 1) > STRETCHED:
        told = f"shows {grown.stretch:.2f} m for each metre of the map's: one of them has another scale"
        say(err, f"note: the odometry of {drive_file.name} {told}")
    for one in grown.astray:
        told = f"views {one.views.start}:{one.views.stop} of {drive_file.name} lead {one.metres:.1f} m off the map"
        say(err, f"note: {told}; --explore makes a path of them")
    _tell_grown(grown, map_, drive_file.name, target, as_json=as_json)


def _add_paths(
    found: Sequence["ExploredPath"], larger: "Extensible", drive_file: Path, target: Path, *, as_json: bool
) -> None:
    """Write what a drive shows off a map as new paths of it, and tell of them and of their joins."""
    from refseq_bench.scenarios.cli.terminal.merged import tell_merged
    from refseq_bench.scenarios.maps.explored import explored_map
    from refseq_bench.scenarios.maps.merge_notes import merge_notes

    made = explored_map(larger, found, target) if found else None
    if as_json:
        print_json({"paths": [_as_record(one) for one in found], "joins": made.merged.decisions if made else []})
    elif made is None:
        say(out, f"{drive_file}: leads nowhere off the map; nothing is written")
    else:
        for one in found:
            file, views = target.with_name(f"{one.map.names[0]}.refseq"), one.astray.path
            stretch = f"views {views.start}:{views.stop} of {drive_file.name}"
            say(out, f"{file}: {stretch}, {one.astray.metres:.1f} m of them off the map")
        tell_merged(made.merged, merge_notes(made.merged, made.read), sum(map(len, made.read)), made.whole, target)


def _as_record(one: "ExploredPath") -> dict[str, object]:
    views = one.astray.path
    return {"path": one.map.names[0], "views": [views.start, views.stop], "metres_off_the_map": one.astray.metres}


def _tell_grown(grown: "Grown", map_: "Map", drive: str, target: Path, *, as_json: bool) -> None:
    """Print how a map grew by a drive, and how large it was before and is now."""
    from refseq_bench.scenarios.maps.sizes import size_of

    before, after = size_of(map_), size_of(grown.map)
    if as_json:
        print_json(
            {"drive": grown.drive, "known": grown.known, "placed": grown.placed, "kept": grown.kept}
            | {"forgotten": grown.forgotten, "before": before, "after": after}
        )
    elif grown.known:
        say(out, f"{target}: {drive} was added before, nothing is new")
    else:
        say(
            out,
            f"{target}: {grown.drive.kept} of {grown.drive.views} views kept, {grown.placed} found on the map, "
            f"{grown.forgotten} older ones forgotten; {before.bytes} bytes before, {after.bytes} now",
        )
