"""The command ``refseq localise``: a later drive in a map or an atlas, from a recording or while it is driven."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenarios.cli.console import err, out, print_results, say, share_of
from scenarios.cli.live import LiveAsked, localised_live
from scenarios.cli.options import AtLeast, Chance, MapOrAtlas, Noise, Sensors, Thin, Views
from scenarios.drives.inputs import check_output, read_drive, stages, words

if TYPE_CHECKING:
    from scenarios.drives.evaluate import StageResult
    from scenarios.scoring.comparison import Comparison

BELOW = 1

EXAMPLES = """Examples:

* `refseq localise map.refseq query.mcap -o beliefs.parquet`
* `refseq localise map.refseq query.mcap --stage chain --sensors camera-2 --at-least 80`
* `refseq localise atlas.refseq query.mcap -o beliefs.parquet`
* `refseq localise map.refseq --live hallway --light 18:00`
* `refseq localise map.refseq --live hallway --light 18:00 --serve 9090 --record query.mcap`
* `refseq localise map.refseq --live hallway --script keys.txt --save live.rrd`"""
WITH_LIVE = "With --live: the drive"
SHOWN = "With --live: where it is shown. A viewer is started unless told otherwise"


def _with_live(text: str, metavar: str, **more: Any) -> Any:
    return typer.Option(metavar=metavar, help=text, rich_help_panel=WITH_LIVE, **more)


def localise(
    map_file: MapOrAtlas,
    query: Annotated[
        Path | None, typer.Argument(help="Later drive: an MCAP recording or a CARMEN log; none with --live.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Table of beliefs to write (.parquet).")
    ] = None,
    stage: Annotated[
        list[str] | None,
        typer.Option(metavar="STAGE", help="uniform, prior or chain; may be repeated. [default: all]"),
    ] = None,
    sensors: Sensors = None,
    views: Views = None,
    thin: Thin = None,
    odometry_noise: Noise = False,
    seed: Chance = 1,
    at_least: AtLeast = None,
    live: Annotated[
        str | None, typer.Option(metavar="WORLD", help="Drive in this world now, and show beliefs as they come.")
    ] = None,
    light: Annotated[str | None, _with_live("Light, as for `refseq record`. [default: 18:00]", "LIGHT")] = None,
    change: Annotated[str | None, _with_live("Change, as for `refseq record`. [default: none]", "CHANGE")] = None,
    robot: Annotated[str | None, _with_live("Robot that drives. [default: the map's]", "ROBOT")] = None,
    route: Annotated[str | None, _with_live("Route to follow, or to start on. [default: forward]", "ROUTE")] = None,
    drive_seed: Annotated[int | None, _with_live("Seed of the drive. [default: 2]", "N", min=0)] = None,
    every: Annotated[float | None, _with_live("A view every so many metres. [default: 0.85]", "METRES")] = None,
    script: Annotated[Path | None, _with_live("Led by a script, as for `refseq drive`.", "FILE")] = None,
    keys: Annotated[
        bool,
        typer.Option("--keys", help="Led by keys in the browser, as by `refseq drive`.", rich_help_panel=WITH_LIVE),
    ] = False,
    record: Annotated[Path | None, _with_live("Keep the drive as a recording (.mcap).", "FILE")] = None,
    save: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a file for the Rerun viewer.", rich_help_panel=SHOWN)
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(
            metavar="URL", help="A viewer that runs elsewhere: rerun+http://HOST:9876/proxy.", rich_help_panel=SHOWN
        ),
    ] = None,
    serve: Annotated[
        int | None,
        typer.Option(
            metavar="PORT",
            min=1,
            max=65535,
            help="Browsers of this machine, until Ctrl-C.",
            rich_help_panel=SHOWN,
        ),
    ] = None,
) -> None:
    """Localise a later drive in a map, or in an atlas of several, view by view; with --live while it is driven.

    Places of an atlas are those of all its sequences, one behind the other in the order of the last table: of sequences
    that hold 76 and 51 places, 0 to 75 are the first one's and 76 to 126 the second's.
    """
    from refseq.logs.beliefs import write_beliefs
    from refseq.map.map import Map
    from scenarios.drives.evaluate import compare, results
    from scenarios.scoring.sequence_recall import sequence_recall_table

    if output is not None:
        check_output(output)
    asked = LiveAsked(live, light, change, robot, route, drive_seed, every, script, keys, record, save, connect, serve)
    asked.check(query, {"views": views, "thin": thin, "odometry-noise": odometry_noise or None})
    wanted, chosen = stages(stage), words(sensors, "sensors")
    map_ = Map.load(map_file)
    found: list[StageResult] = []

    def tell(comparison: "Comparison") -> None:
        if output is not None:
            told = {key: str(value) for key, value in comparison.query_metadata.items()}
            write_beliefs(output, comparison.query_views, comparison.beliefs, told)
            say(out, f"{output}: beliefs of {len(comparison.query_views)} views")
        found.extend(results([comparison]))
        print_results(comparison.name, found, [comparison])
        if not map_.has_one_path:
            out.print(sequence_recall_table(map_, comparison.beliefs))

    if query is None:
        localised_live(map_file.name, map_, asked, wanted, chosen, seed, tell)
    else:
        drive = read_drive(query, views, thin, seed + 1 if odometry_noise else None)
        name = f"{map_file.name} ← {query.name}"
        tell(compare(name, map_, drive, stages=wanted, sensors=chosen, seed=seed))
    judge(found, at_least)


def judge(found: "Sequence[StageResult]", at_least: float | None) -> None:
    """Leave with 1 when the last stage is right less often than asked."""
    if at_least is None or not found:
        return
    success = next(iter(found[-1].success.values()))
    if not success.trials or 100 * success.value < at_least:
        say(err, f"below what was asked: {share_of(success)}, at least {at_least:g} %")
        raise typer.Exit(BELOW)
