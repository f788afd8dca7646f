"""The command ``refseq map add``: a later drive as further experiences of a map's places."""

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
    grouped,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import MAP_TO_WRITE
from refseq_bench.scenarios.drives.inputs import check_output, load_map, read_drive, replacement
from refseq_bench.scenarios.tables import say

if TYPE_CHECKING:
    from refseq.map.growth.adding import Grown
    from refseq.map.map import Map

ADD_HELP = """Examples:

* `refseq map add map.refseq evening.mcap`
* `refseq map add map.refseq evening.mcap -o larger.refseq`
* `refseq map add whole.refseq evening.mcap --most 2 --well 0.8`

A drive that was added before adds nothing. Exit codes: 0 done; 2 bad input, or another command has changed the map
meanwhile: it stays as it was."""


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
    seed: Seed = 1,
    as_json: Json = False,
    selection: NoisySelection = NoisySelection(),
) -> None:
    """Let a map grow by a later drive along its paths: what was not recognised well is kept of it."""
    from refseq.map.growth.adding import GrowthSettings, add_drive
    from refseq_bench.scenarios.maps.merge_notes import STRETCHED

    target = output or map_file
    check_output(target, of=[drive_file, *selection.chosen().files])
    replacing = replacement(target, [map_file])
    map_ = load_map(map_file)
    drive = read_drive(drive_file, selection.with_noise(seed + 1))
    rules = GrowthSettings(well=well, most=most)
    grown = add_drive(map_, drive.views, name=drive_file.name, metadata=drive.metadata, settings=rules, seed=seed)
    if not grown.known or output is not None:
        with replacing:
            grown.map.save(target)
    if abs(grown.stretch - 1) > STRETCHED:
        told = f"shows {grown.stretch:.2f} m for each metre of the map's: one of them has another scale"
        say(err, f"note: the odometry of {drive_file.name} {told}")
    _tell_grown(grown, map_, drive_file.name, target, as_json=as_json)


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
