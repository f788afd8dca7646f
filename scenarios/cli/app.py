"""The command line: ``refseq record | learn | localise | compare | matrix | report | view | demo``.

``refseq similarity | merge`` are for several maps, ``refseq route`` for what they were merged to, ``refseq doctor``
looks at the machine. ``refseq worlds``, ``refseq robots`` and ``refseq scenario`` have commands of their own, in
``scenarios.cli.worlds``, ``robots_cli`` and ``scenario_cli``.

Exit codes: 0 all went well; 1 it ran, but the result is below what was asked; 2 bad input, in one line. Whatever a
command needs is imported when it runs, so that ``refseq doctor`` answers on a machine where half of it is missing.
"""

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from importlib.metadata import version as package_version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import Notes, err, out, print_results, progress_bar, say, step_bars
from scenarios.cli.drive import EXAMPLES as DRIVE_EXAMPLES
from scenarios.cli.drive import drive
from scenarios.cli.localise import EXAMPLES as LOCALISE_EXAMPLES
from scenarios.cli.localise import judge, localise
from scenarios.cli.merge import MERGE_EXAMPLES, SIMILARITY_EXAMPLES, merge, similarity
from scenarios.cli.mission import mission
from scenarios.cli.options import AtLeast, Chance, MapOrAtlas, Noise, Sensors, Thin, Views
from scenarios.cli.robots import robots
from scenarios.cli.route import EXAMPLES as ROUTE_EXAMPLES
from scenarios.cli.route import route
from scenarios.cli.scenario import scenario
from scenarios.cli.view import EXAMPLES as VIEW_EXAMPLES
from scenarios.cli.view import view
from scenarios.cli.worlds import worlds
from scenarios.drives.inputs import assignments, check_output, read_comparison, read_drive, words, writing
from scenarios.errors import input_errors

if TYPE_CHECKING:
    from scenarios.drives.evaluate import StageResult

OK, BELOW, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    help="Test bench for robots that find their place along a path. All lengths are in metres, times in seconds.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    add_completion=False,
)
app.add_typer(worlds, name="worlds")
app.add_typer(robots, name="robots")
app.add_typer(scenario, name="scenario")
app.add_typer(mission, name="mission")
app.command(epilog=DRIVE_EXAMPLES)(drive)
app.command(epilog=LOCALISE_EXAMPLES)(localise)
app.command(epilog=SIMILARITY_EXAMPLES)(similarity)
app.command(epilog=MERGE_EXAMPLES)(merge)
app.command(epilog=ROUTE_EXAMPLES)(route)
app.command(epilog=VIEW_EXAMPLES)(view)


class LaserRange(StrEnum):
    """What ``--laser-range`` takes; the modes of ``sim.sensors.laser.RangeMode``."""

    NEAR = "8"
    FAR = "80"


class RendererChoice(StrEnum):
    """What ``--renderer`` takes; the same as ``sim.rendering.renderer.RendererKind``, not imported for help."""

    FILAMENT = "filament"
    CLASSIC = "classic"
    NONE = "none"


World = Annotated[
    str, typer.Argument(help="A world of the library, corridor:SEED, or a floor plan: a path ending in .toml.")
]
Light = Annotated[
    str,
    typer.Option(
        metavar="LIGHT",
        help="A preset (morning, noon, 16:00, 18:00, overcast, late-evening) or any hour: 17:45, and after it, commas "
        "between, cloud=0..1, lamps=auto|on|off, date=2008-06-15.",
    ),
]
Change = Annotated[
    str,
    typer.Option(
        metavar="CHANGE",
        help="What is not as the plan has it: none, few, busy, or strengths from 0 to 1, commas between, of people, "
        "walkers, doors, bins, furniture, posters, cars: people=0.5,doors=0.3.",
    ),
]
RobotName = Annotated[str, typer.Option("--robot", metavar="ROBOT", help="Robot that drives.")]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw of the drive.")]
Renderer = Annotated[
    RendererChoice,
    typer.Option(metavar="RENDERER", help="filament: photometric. classic: fast. none: no images, laser only."),
]
Features = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="Only these, commas between, of sift, dense, walls, doors, boundary, hu, sectors. "
        "[default: the profile's]",
    ),
]
Drives = Annotated[
    list[Path],
    typer.Argument(metavar="REFERENCE QUERY...", help="Pairs of drives; pairs in the same lights are pooled."),
]
ProfileName = Annotated[
    str, typer.Option("--profile", metavar="PROFILE", help="thesis: the method of 2008, with its values. best: ours.")
]
Reference = Annotated[Path | None, typer.Option(metavar="FILE", help="First drive, for its pictures.")]


@app.command(
    epilog="""Examples:

* `refseq record hallway --light 16:00 --seed 1 -o reference.mcap`
* `refseq record hallway --light late-evening --seed 2 -o query.mcap`
* `refseq record hallway --light 17:45,cloud=0.6 --change busy --seed 3 -o another-day.mcap`
* `refseq record corridor:7 --camera camera-2=fire-i-wide -o wide.mcap`
* `refseq record hallway --renderer none -o laser-only.mcap`
* `refseq record hallway --behaviours "MN:12 MT:180 MN:10" -o there-and-back.mcap`"""
)
def record(
    world: World,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Recording to write (.mcap).")],
    light: Light = "16:00",
    change: Change = "none",
    change_seed: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Seed of the change.  [default: the drive's]")
    ] = None,
    robot: RobotName = "robuter",
    route: Annotated[str, typer.Option(metavar="ROUTE", help="Route of the world to follow.")] = "forward",
    seed: Seed = 1,
    world_seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the world's textures.")] = 0,
    renderer: Renderer = RendererChoice.FILAMENT,
    sensors: Sensors = None,
    camera: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=MODEL", help="Another model of a camera: fire-i, fire-i-wide, or a path ending in .toml."
        ),
    ] = None,
    laser_range: Annotated[
        LaserRange, typer.Option(metavar="METRES", help="How far the laser reaches: 8 in steps of 1 mm, 80 of 1 cm.")
    ] = LaserRange.FAR,
    every: Annotated[
        float,
        typer.Option(metavar="METRES", help="A view every so many metres by the odometer; 0: not by distance."),
    ] = 0.85,
    turn: Annotated[
        float | None, typer.Option(metavar="RADIANS", help="A view whenever the robot has turned so far.")
    ] = None,
    time: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="A view at least every so many seconds.")
    ] = None,
    behaviours: Annotated[
        str | None,
        typer.Option(metavar="WORDS", help="Run these from the route's start, blanks between; nobody leads then."),
    ] = None,
) -> None:
    """Lead a robot through a world, or let it run behaviours, and record what it senses."""
    from scenarios.drives.record import Drive
    from scenarios.drives.record import record as record_drive
    from sim.drives.recorder import Trigger
    from sim.rendering.renderer import RendererKind
    from sim.sensors.laser import RangeMode

    drive = Drive(
        world=world,
        light=light,
        change=change,
        change_seed=change_seed,
        robot=robot,
        route=route,
        seed=seed,
        world_seed=world_seed,
        renderer=RendererKind(renderer.value),
        trigger=Trigger(distance=every or None, turn=turn, time=time),
        sensors=words(sensors, "sensors"),
        cameras=assignments(camera, "camera"),
        laser=RangeMode[f"METRES_{laser_range.value}"],
        behaviours=tuple((behaviours or "").split()),
    )
    with _interruptible(), progress_bar(f"{world} at {light}") as progress:
        recording = record_drive(drive, output, progress)
    sensed = ", ".join(sorted(recording.sensors))
    say(out, f"{output}: {len(recording.views)} views of {sensed}")


@app.command(
    epilog="""Examples:

* `refseq learn reference.mcap -o map.refseq`
* `refseq learn reference.mcap --sensors camera-1 -o one-camera.refseq`
* `refseq learn robot.log --views 0:160 --thin 0.5 --features walls,boundary,sectors -o laser.refseq`"""
)
def learn(
    recording: Annotated[Path, typer.Argument(help="First drive: an MCAP recording or a CARMEN log.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Map to write (.refseq).")],
    sensors: Sensors = None,
    profile: ProfileName = "thesis",
    features: Features = None,
    views: Views = None,
    thin: Thin = None,
    odometry_noise: Noise = False,
    seed: Chance = 1,
) -> None:
    """Make a reference sequence, the map, of a first drive."""
    from refseq.map.learning import learn as learn_map
    from refseq.map.profile import profile_named

    check_output(output)
    chosen = profile_named(profile)
    drive = read_drive(recording, views, thin, seed if odometry_noise else None)
    map_ = learn_map(
        drive.views,
        sensors=words(sensors, "sensors"),
        features=words(features, "features"),
        profile=chosen,
        metadata={**drive.metadata, "source": recording.name},
    )
    map_.save(output)
    say(
        out,
        f"{output}: {len(map_)} places over {map_.paths[0].length:.1f} m, {map_.sequence.matrix.N} features of "
        f"{', '.join(sorted(map_.sensors))}",
    )


@app.command(
    epilog="""Examples:

* `refseq matrix map.refseq`
* `refseq matrix map.refseq -o matrix.png --top 20`"""
)
def matrix(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help="Map of the first drive (.refseq).")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Picture to draw (.png, .svg or .pdf).")
    ] = None,
    top: Annotated[
        int, typer.Option(min=0, metavar="N", help="How many of the features that tell the most to list.")
    ] = 10,
    seed: Chance = 1,
) -> None:
    """Describe a map's incidence matrix and what it tells about the place, and draw it."""
    import numpy as np

    from refseq.map.map import Map
    from scenarios.maps.matrix import (
        check_picture,
        draw,
        features_table,
        information_table,
        statistics_table,
        summaries,
        top_features,
    )

    if output is not None:
        check_output(output)
        check_picture(output)
    found = Map.load(map_file).sequence.matrix
    title = f"{map_file.name}: {found.N} features at {found.K} places"
    rows = summaries(found, np.random.default_rng(seed))
    out.print(statistics_table(title, rows))
    out.print(information_table(rows))
    if top:
        out.print(features_table(top_features(found, top)))
    if output is not None:
        with writing(output):
            draw(output, found, title)
        say(out, f"{output}")


@app.command(
    epilog="""Examples:

* `refseq compare reference.mcap query.mcap`
* `refseq compare reference.mcap query.mcap --methods best/chain,topometric --start 40% --report report.html`
* `refseq compare reference.mcap query.mcap --places 30:80 --table figures.csv`"""
)
def compare(
    drives: Drives,
    methods: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Only these, commas between: PROFILE/STAGE, a baseline as topometric, or all baselines.",
        ),
    ] = None,
    places: Annotated[
        str | None, typer.Option(metavar="FROM:TO", help="Learn only these views of the reference drive.")
    ] = None,
    start: Annotated[
        str, typer.Option(metavar="VIEW", help="First view of the query drive: a number, or a share as 40%.")
    ] = "0",
    kidnap: Annotated[
        str | None, typer.Option(metavar="FROM:TO", help="Carry the robot from before view FROM to view TO.")
    ] = None,
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="Figures to write (.csv).")] = None,
    report: Annotated[Path | None, typer.Option(metavar="FILE", help="Page to write (.html).")] = None,
    seed: Chance = 1,
) -> None:
    """Ask several methods about the same views: the profiles' stages, and the baselines."""
    from scenarios.cli.compare import run_comparison
    from scenarios.drives.benchmark import Benchmark, pairs_of
    from scenarios.methods.by_name import methods_named

    for path in (table, report):
        if path is not None:
            check_output(path)
    contest = Benchmark(pairs_of(drives), methods_named(words(methods, "methods")), places, start, kidnap, seed)
    with _interruptible(), step_bars() as step:
        run_comparison(contest, out, step, table=table, report=report)


@app.command(
    epilog="Example: `refseq report map.refseq query.mcap beliefs.parquet --reference reference.mcap -o report.html`"
)
def report(
    map_file: MapOrAtlas,
    query: Annotated[Path, typer.Argument(help="Later drive.")],
    beliefs: Annotated[Path, typer.Argument(help="Table of beliefs that `refseq localise` wrote (.parquet).")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Page to write (.html).")],
    reference: Reference = None,
    views: Views = None,
    thin: Thin = None,
) -> None:
    """Write a page with plan, posterior heat maps, frames, success and cost of a localised drive."""
    from scenarios.report.document import write_report
    from worlds.drawing.outline import outline_of
    from worlds.plans.load import load_plan, world_names

    check_output(output)
    comparison = read_comparison(map_file, query, beliefs, reference, views, thin)
    world = str(comparison.reference_metadata.get("world", ""))
    outline = outline_of(load_plan(world)) if world in world_names() else None
    with writing(output):
        write_report(output, [comparison], title=comparison.name, outline=outline)
    say(out, f"{output}")


@app.command(
    epilog="""Examples:

* `refseq demo`
* `refseq demo --to 18:00 --to late-evening --seeds 5 -o out/five`"""
)
def demo(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Folder to fill.")] = Path(
        "out/demo"
    ),
    world: Annotated[str, typer.Option(metavar="WORLD", help="World to drive in.")] = "hallway",
    start: Annotated[str, typer.Option("--from", metavar="LIGHT", help="Light of the reference drive.")] = "16:00",
    to: Annotated[
        list[str] | None,
        typer.Option(metavar="LIGHT", help="Light of the query drive; may be repeated. [default: 18:00]"),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, metavar="N", help="Number of seeds: pairs of drives.")] = 1,
    robot: RobotName = "robuter",
    renderer: Renderer = RendererChoice.FILAMENT,
    profile: ProfileName = "thesis",
    at_least: AtLeast = None,
) -> None:
    """Drive twice, learn, localise, and leave report and recording to look at."""
    from refseq.map.profile import profile_named
    from scenarios.cli.demo import Demo, run_demo
    from scenarios.drives.evaluate import results
    from scenarios.drives.record import Drive
    from sim.rendering.renderer import RendererKind
    from worlds.light import light_named

    lights, chosen = tuple(dict.fromkeys(to or ["18:00"])), profile_named(profile)
    for light in lights:
        light_named(light)  # a name that is wrong is told before the first drive, not after it
    first = Drive(world=world, light=start, robot=robot, renderer=RendererKind(renderer.value))
    with _interruptible(), step_bars() as step:
        comparisons = run_demo(Demo(first, lights, tuple(range(1, seeds + 1)), chosen), output, step)
    found: list[StageResult] = []
    for name in dict.fromkeys(comparison.name for comparison in comparisons):
        same = [comparison for comparison in comparisons if comparison.name == name]
        found = results(same)
        print_results(f"{world}, {name}", found, same)
    say(out, f"look at {output / 'report.html'}, and: rerun {output / 'demo.rrd'}")
    judge(found, at_least)


@app.command()
def doctor() -> None:
    """Say what is there, and what each missing piece costs."""
    from scenarios.cli.doctor import report as report_health

    raise typer.Exit(report_health(out))


@app.callback(invoke_without_command=True)
def version(show: Annotated[bool, typer.Option("--version", help="Print the version.", is_eager=True)] = False) -> None:
    """Test bench for robots that find their place along a path. All lengths are in metres, times in seconds."""
    if show:
        say(out, package_version("refseq-bench"))
        raise typer.Exit


def main() -> None:
    """Run the command line; a known error is one line and exit code 2, an unknown one comes with its trace.

    What a user's own localiser did wrong is one line and exit code 1.
    """
    logging.getLogger("scenarios").handlers = [Notes()]
    try:
        app()
    except Exception as error:
        if _is_own_failure(error):
            say(err, f"failed: {error}")
            sys.exit(BELOW)
        if not isinstance(error, input_errors()):
            raise
        say(err, f"error: {error}")
        sys.exit(BAD_INPUT)


def _is_own_failure(error: Exception) -> bool:
    """Whether a localiser that the user brought did wrong."""
    own = sys.modules.get("scenarios.methods.plugins")
    return own is not None and isinstance(error, own.MisbehavedError)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Say what an interruption leaves behind, where there is something."""
    try:
        yield
    except KeyboardInterrupt as stop:
        say(err, f"interrupted: {stop}" if stop.args else "interrupted")
        raise typer.Exit(INTERRUPTED) from None
