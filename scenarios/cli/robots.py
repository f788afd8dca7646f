"""The commands ``refseq robots list | show | strip | check | drive | umbmark | serve``."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from refseq.files import replacing_at
from scenarios.cli.console import err, out, say
from scenarios.drives.inputs import check_output, writing
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BELOW, INTERRUPTED = 1, 130

robots = typer.Typer(
    help="The robots: what there is, what one looks like, how it drives, and whether it does what it should.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)

Robot = Annotated[str, typer.Argument(metavar="ROBOT", help="A robot's name, as `refseq robots list` tells it.")]
World = Annotated[
    str, typer.Option(metavar="WORLD", help="A world of the library, corridor:SEED, or a path ending in .toml.")
]
Route = Annotated[str, typer.Option(metavar="ROUTE", help="Route of the world; its start is where the robot starts.")]
Light = Annotated[str, typer.Option(metavar="LIGHT", help="A preset or any hour, as for `refseq record`.")]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")]
PICTURE_HELP = "Picture to write (.svg or .png)."


class Pictures(StrEnum):
    """What ``--renderer`` takes; those of ``sim.rendering.renderer.RendererKind`` that draw."""

    FILAMENT = "filament"
    CLASSIC = "classic"


Renderer = Annotated[Pictures, typer.Option(metavar="RENDERER", help="filament: photometric. classic: fast.")]


@robots.command("list")
def list_robots() -> None:
    """List the robots."""
    from scenarios.robot_checks.facts import robots_table

    out.print(robots_table())


@robots.command(
    epilog="""Examples:

* `refseq robots show robuter`
* `refseq robots show robuter -o robuter.png`"""
)
def show(
    robot: Robot,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help=PICTURE_HELP)] = None,
    renderer: Renderer = Pictures.FILAMENT,
) -> None:
    """Tell all about one robot, and draw it from three sides to scale."""
    from robots import load
    from scenarios.robot_checks.body import Body
    from scenarios.robot_checks.facts import proportions_table, robot_table

    _check_place(output)
    body = Body(load(robot))
    out.print(robot_table(body))
    table = proportions_table(body)
    if table is not None:
        out.print(table)
    if output is not None:
        from scenarios.robot_checks.picture import picture
        from sim.rendering.renderer import RendererKind

        _save(picture(body, RendererKind(renderer.value)), output)


@robots.command(
    epilog="""Examples:

* `refseq robots strip robuter --world laboratory -o strip.png`
* `refseq robots strip segway_rmp --world car-park --speed 1.2 --seconds 30 --frames 8 -o strip.png`"""
)
def strip(
    robot: Robot,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help=PICTURE_HELP)],
    world: World = "hallway",
    route: Route = "forward",
    light: Light = "16:00",
    seconds: Annotated[float, typer.Option(metavar="SECONDS", help="How long to watch.")] = 60.0,
    frames: Annotated[int, typer.Option(metavar="N", help="Number of frames, at equal times.")] = 12,
    speed: Annotated[float, typer.Option(metavar="M/S", help="Mean speed of the drive.")] = 0.4,
    seed: Seed = 1,
    renderer: Renderer = Pictures.FILAMENT,
) -> None:
    """Show a drive as a strip of frames, as somebody who walks along sees it, with time, speed and pitch."""
    from scenarios.robot_checks.filmstrip import FilmedDrive, film, filmstrip
    from sim.rendering.renderer import RendererKind

    _check_place(output)
    asked = FilmedDrive(robot, world, route, light, seconds, frames, speed, seed, RendererKind(renderer.value))
    found = list(film(asked))
    _save(filmstrip(asked, found), output, f"{len(found)} frames of {found[-1].time:.0f} s")


@robots.command(
    epilog="""Examples:

* `refseq robots check robuter segway_rmp`

Exit codes: 0 all is as it should be; 1 something is not; 2 there is no such robot."""
)
def check(
    names: Annotated[list[str], typer.Argument(metavar="ROBOT...", help="Robots, as `refseq robots list` tells them.")],
) -> None:
    """Drive robots on an empty floor, and tell what they do beside what they should."""
    from robots import load
    from scenarios.robot_checks.check import findings, findings_table

    for name in names:
        load(name)
    good = True
    for name in dict.fromkeys(names):
        found = list(findings(name))
        out.print(findings_table(name, found))
        good &= all(finding.good for finding in found)
    if not good:
        raise typer.Exit(BELOW)


@robots.command(
    epilog="""Examples:

* `refseq robots drive robuter MN:3 MT:90 --world laboratory`
* `refseq robots drive segway_rmp MW:left,0.6 MC --world hallway --at 3,0,0 -o plan.png`

Exit codes: 0 all behaviours have finished; 1 one has failed; 2 bad input."""
)
def drive(
    robot: Robot,
    behaviours: Annotated[
        list[str], typer.Argument(metavar="BEHAVIOUR...", help="MA, MT, MW, MC, MN, stop; see docs.")
    ],
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help=PICTURE_HELP)] = None,
    world: World = "hallway",
    route: Annotated[str | None, typer.Option(metavar="ROUTE", help="Start where it does. [default: forward]")] = None,
    at: Annotated[str | None, typer.Option(metavar="X,Y,HEADING", help="Start there [m, m, degrees].")] = None,
    seed: Seed = 1,
    timeout: Annotated[float, typer.Option(metavar="SECONDS", help="Longest time for each behaviour.")] = 300.0,
) -> None:
    """Let a robot run behaviours one after another, until one fails, and tell what became of each."""
    from robots.behaviours import BehaviourOutcome
    from scenarios.robot_checks.behaviour_drive import (
        BehaviourDrive,
        behaviour_plan,
        behaviour_table,
        drive_behaviours,
        parse_pose,
    )

    _check_place(output)
    if at is not None and route is not None:
        raise ScenarioError(f"at '{at}' and route '{route}' both say where to start; valid is one of them")
    start = parse_pose(at) if at is not None else None
    asked = BehaviourDrive(robot, tuple(behaviours), world, route or "forward", start, seed, timeout)
    found = list(drive_behaviours(asked))
    out.print(behaviour_table(found))
    if output is not None:
        _save(behaviour_plan(asked, found), output)
    if found[-1].outcome is not BehaviourOutcome.FINISHED:
        raise typer.Exit(BELOW)


@robots.command(
    epilog="""Examples:

* `refseq robots umbmark robuter`
* `refseq robots umbmark segway_rmp --runs 3 --side 2 -o squares.png`"""
)
def umbmark(
    robot: Robot,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help=PICTURE_HELP)] = None,
    runs: Annotated[int, typer.Option(metavar="N", help="Squares in each direction.")] = 5,
    side: Annotated[float, typer.Option(metavar="METRES", help="Side of the square.")] = 4.0,
    seed: Seed = 0,
) -> None:
    """Drive squares both ways round by the odometer, and tell its systematic errors apart (UMBmark)."""
    from scenarios.robot_checks.umbmark import umbmark_picture, umbmark_table
    from sim.acceptance.umbmark import umbmark as drive_squares

    _check_place(output)
    found = drive_squares(robot, side=side, runs=runs, seed=seed)
    out.print(umbmark_table(found))
    if output is not None:
        _save(umbmark_picture(found), output)


@robots.command(
    epilog="""Examples:

* `refseq robots serve robuter --tcp 7777`
* `refseq robots serve robuter --world laboratory --pty --seconds 600`

It ends after the seconds with 0, on Ctrl-C with 130."""
)
def serve(
    robot: Robot,
    world: World = "hallway",
    route: Route = "forward",
    tcp: Annotated[
        int | None, typer.Option(metavar="PORT", help="Port on this machine only; 0: any free one. [default: 0]")
    ] = None,
    pty: Annotated[bool, typer.Option("--pty", help="A pseudo-terminal instead.")] = False,
    seconds: Annotated[
        float | None, typer.Option(metavar="SECONDS", help="Simulated time. [default: until Ctrl-C]")
    ] = None,
    rate: Annotated[float, typer.Option(metavar="FACTOR", help="Simulated over real time.")] = 1.0,
    seed: Seed = 1,
) -> None:
    """Let a program outside drive a robot over its serial line, in the robot's own protocol."""
    from scenarios.robot_checks.serve import Service, serving

    if pty and tcp is not None:
        raise ScenarioError(f"tcp {tcp} and pty both say where to connect; valid is one of them")
    asked = Service(robot, world, route, None if pty else tcp or 0, seconds, rate, seed)
    try:
        with serving(asked) as (address, run):
            say(out, f"{robot} in {world} listens at {address}; Ctrl-C ends")
            sys.stdout.flush()
            run()
    except KeyboardInterrupt:
        say(err, "interrupted")
        raise typer.Exit(INTERRUPTED) from None


def _check_place(output: Path | None) -> None:
    """See that a picture can be written, before the work that goes into it."""
    from worlds.drawing.draw import check_picture

    if output is not None:
        check_picture(output)
        check_output(output)


def _save(picture: "Figure", output: Path, about: str = "") -> None:
    """Write a picture, the whole of it or nothing, and say so."""
    with writing(output), replacing_at(output) as temporary:
        picture.savefig(temporary)
    say(out, f"{output}: {about}" if about else f"{output}")
