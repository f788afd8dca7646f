"""The commands ``refseq robot list | show | filmstrip | check | try | umbmark | serve``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from refseq_bench.scenarios.cli.terminal.console import out, print_json, saved
from refseq_bench.scenarios.cli.terminal.options import (
    CAMERA_RENDERER,
    LIGHT,
    RATE,
    ROUTE,
    SECONDS,
    TIMEOUT,
    WORLD,
    CameraRenderer,
    Json,
    RobotName,
    Seed,
    defaulting,
    flag,
    only_one_of,
    option,
)
from refseq_bench.scenarios.cli.terminal.outputs import PICTURE
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import check_output
from refseq_bench.scenarios.tables import plural, say

BELOW = 1

app = group("List, show, try and check the robots.")

World = Annotated[str, WORLD]
Route = Annotated[str, ROUTE]
Picture = Annotated[Path | None, PICTURE]
Renderer = Annotated[CameraRenderer, CAMERA_RENDERER]


@app.command("list", cls=BenchCommand, epilog="Example: `refseq robot list --json`")
def list_robots(as_json: Json = False) -> None:
    """List the robots."""
    from refseq_bench.scenarios.robot_checks.facts import robots_facts, robots_table

    if as_json:
        print_json(robots_facts())
    else:
        out.print(robots_table())


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq robot show robuter`
* `refseq robot show robuter -o robuter.png`""",
)
def show(
    robot: RobotName,
    output: Picture = None,
    renderer: Renderer = CameraRenderer.BAKED,
    as_json: Json = False,
) -> None:
    """Describe one robot, and draw it from three sides to scale."""
    from refseq_bench.robots import load
    from refseq_bench.scenarios.robot_checks.body import Body
    from refseq_bench.scenarios.robot_checks.facts import proportions_table, robot_facts, robot_table

    check_output(output)
    body = Body(load(robot))
    if as_json:
        print_json(robot_facts(body))
    else:
        out.print(robot_table(body))
        if (table := proportions_table(body)) is not None:
            out.print(table)
    if output is not None:
        from refseq_bench.scenarios.robot_checks.picture import picture
        from refseq_bench.sim.rendering.renderer import RendererKind

        with saved(output, quiet=as_json) as temporary:
            picture(body, RendererKind(renderer.value)).savefig(temporary)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq robot filmstrip robuter --world laboratory -o strip.png`
* `refseq robot filmstrip segway_rmp --world car-park --speed 1.2 --seconds 30 --frames 8 -o strip.png`""",
)
def filmstrip(
    robot: RobotName,
    output: Annotated[Path, PICTURE],
    world: World = "hallway",
    route: Route = "forward",
    light: Annotated[str, LIGHT] = "16:00",
    seconds: Annotated[float, SECONDS] = 60.0,
    frames: Annotated[int, option("N", "Number of frames, at equal times.")] = 12,
    speed: Annotated[float, option("M/S", "Mean speed of the drive.")] = 0.4,
    seed: Seed = 1,
    renderer: Renderer = CameraRenderer.BAKED,
) -> None:
    """Show a drive as frames that a bystander takes, with time, speed and pitch."""
    from refseq_bench.scenarios.robot_checks.film import FilmedDrive, film
    from refseq_bench.sim.rendering.renderer import RendererKind

    check_output(output)
    asked = FilmedDrive(robot, world, route, light, seconds, frames, speed, seed, RendererKind(renderer.value))
    pictures = list(film(asked))

    from refseq_bench.scenarios.robot_checks.filmstrip import filmstrip as drawn

    with saved(output, f"{plural(len(pictures), 'frame')} of {pictures[-1].time:.0f} s") as temporary:
        drawn(asked, pictures).savefig(temporary)


@app.command(
    cls=BenchCommand,
    epilog="""Example: `refseq robot check robuter segway_rmp`

Exit codes: 0 all as it should be; 1 something is not; 2 bad input.""",
)
def check(
    names: Annotated[list[str], typer.Argument(metavar="ROBOT", help="Robots, as `refseq robot list` names them.")],
) -> None:
    """Drive robots on an empty floor and compare what they do with what they should."""
    from refseq_bench.robots import load
    from refseq_bench.scenarios.robot_checks.check import findings, findings_table

    for name in names:
        load(name)
    good = True
    for name in dict.fromkeys(names):
        found = list(findings(name))
        out.print(findings_table(name, found))
        good &= all(finding.good for finding in found)
    if not good:
        raise typer.Exit(BELOW)


@app.command(
    "try",
    cls=BenchCommand,
    epilog="""Examples:

* `refseq robot try robuter MN:3 MT:90 --world laboratory`
* `refseq robot try segway_rmp MW:left,0.6 MC --world hallway --pose 3,0,0 -o plan.png`

`refseq record --behaviours` records such a drive. Exit codes: 0 all behaviours have finished; 1 one has failed; 2 bad
input.""",
)
def try_behaviours(
    robot: RobotName,
    behaviours: Annotated[
        list[str], typer.Argument(metavar="BEHAVIOUR", help="MA, MT, MO, MW, MC, MN or stop, as in docs/robots.md.")
    ],
    output: Picture = None,
    world: World = "hallway",
    route: Annotated[str | None, defaulting(ROUTE, "forward")] = None,
    pose: Annotated[str | None, option("X,Y,DEGREES", "Start there, x and y in metres, not on a route.")] = None,
    seed: Seed = 1,
    timeout: Annotated[float, TIMEOUT] = 300.0,
) -> None:
    """Run behaviours one after another until one fails, tell what became of each, and draw the path."""
    from refseq_bench.robots.behaviours import BehaviourOutcome
    from refseq_bench.scenarios.robot_checks.behaviour_drive import (
        BehaviourDrive,
        behaviour_table,
        drive_behaviours,
        parse_pose,
    )

    check_output(output)
    only_one_of(pose=pose, route=route)
    start = parse_pose(pose) if pose is not None else None
    asked = BehaviourDrive(robot, tuple(behaviours), world, route or "forward", start, seed, timeout)
    done = list(drive_behaviours(asked))
    out.print(behaviour_table(done))
    if output is not None:
        from refseq_bench.scenarios.robot_checks.behaviour_picture import behaviour_plan

        with saved(output) as temporary:
            behaviour_plan(asked, done).savefig(temporary)
    if done[-1].outcome is not BehaviourOutcome.FINISHED:
        raise typer.Exit(BELOW)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq robot umbmark robuter`
* `refseq robot umbmark segway_rmp --runs 3 --side 2 -o squares.png`""",
)
def umbmark(
    robot: RobotName,
    output: Picture = None,
    runs: Annotated[int, option("N", "Squares in each direction.")] = 5,
    side: Annotated[float, option("METRES", "Side of the square.")] = 4.0,
    seed: Seed = 0,
) -> None:
    """Drive squares both ways round by the odometer, and tell its systematic errors apart (UMBmark)."""
    from refseq_bench.scenarios.robot_checks.umbmark import umbmark_table
    from refseq_bench.sim.acceptance.umbmark import umbmark as drive_squares

    check_output(output)
    found = drive_squares(robot, side=side, runs=runs, seed=seed)
    out.print(umbmark_table(found))
    if output is not None:
        from refseq_bench.scenarios.robot_checks.umbmark_picture import umbmark_picture

        with saved(output) as temporary:
            umbmark_picture(found).savefig(temporary)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq robot serve robuter --tcp 7777`
* `refseq robot serve robuter --world laboratory --pty --seconds 600`

Exit codes: 0 the seconds are over; 2 bad input; 130 Ctrl-C.""",
)
def serve(
    robot: RobotName,
    world: World = "hallway",
    route: Route = "forward",
    tcp: Annotated[int | None, option("PORT", "Port, of this machine only; 0: any free one. [default: 0]")] = None,
    pty: Annotated[bool, flag("--pty", "Serve a pseudo-terminal instead of a port.")] = False,
    seconds: Annotated[float | None, defaulting(SECONDS, "until Ctrl-C")] = None,
    rate: Annotated[float, RATE] = 1.0,
    seed: Seed = 1,
) -> None:
    """Let a program outside drive a robot over its serial line, in the robot's own protocol."""
    from refseq_bench.scenarios.robot_checks.serve import Service, serving

    only_one_of(tcp=tcp, pty=pty)
    asked = Service(robot, world, route, None if pty else tcp or 0, seconds, rate, seed)
    with serving(asked) as (address, run):
        say(out, f"{robot} in {world} listens at {address}; Ctrl-C ends")
        sys.stdout.flush()
        run()
