"""The command ``refseq mission lamp``: a LAMP program (Fig. 1.6), run by a robot in a world."""

from pathlib import Path
from typing import Annotated

import typer

from refseq.files import replacing_at
from scenarios.cli.console import out, say
from scenarios.drives.inputs import check_output, writing

BELOW = 1

EXAMPLES = """Examples:

* `refseq mission lamp fig-1.6.lamp`
* `refseq mission lamp mine.lamp --world my.toml --seed 2 -o plan.png`

Exit codes: 0 all stages have finished; 1 one has failed; 2 bad input."""


def lamp(
    program: Annotated[Path, typer.Argument(metavar="PROGRAM", help="A program (.lamp), or fig-1.6.lamp, ours.")],
    world: Annotated[
        str, typer.Option(metavar="WORLD", help="A world of the library, corridor:SEED, or a path ending in .toml.")
    ] = "lamp",
    robot: Annotated[str, typer.Option(metavar="ROBOT", help="A robot with sonars.")] = "robuter",
    route: Annotated[str, typer.Option(metavar="ROUTE", help="Route of the world; the robot starts where it does.")] = (
        "forward"
    ),
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")] = 1,
    timeout: Annotated[float, typer.Option(metavar="SECONDS", help="Longest time for each stage.")] = 900.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Plan to draw (.svg or .png).")
    ] = None,
) -> None:
    """Run a LAMP program, by sonar and odometry alone, until a stage fails, and tell what became of each."""
    from robots.behaviours import BehaviourOutcome
    from scenarios.missions.lamp import LampRun, lamp_plan, read_program, run_in_world
    from scenarios.robot_checks.behaviour_drive import behaviour_table
    from worlds.drawing.draw import check_picture

    if output is not None:
        check_picture(output)
        check_output(output)
    asked = LampRun(read_program(program), world, robot, route, seed, timeout)
    found = run_in_world(asked)
    out.print(behaviour_table(found))
    if output is not None:
        figure = lamp_plan(asked, found)
        with writing(output), replacing_at(output) as temporary:
            figure.savefig(temporary)
        say(out, f"{output}")
    if len(found) < len(asked.stages) or found[-1].outcome is not BehaviourOutcome.FINISHED:
        raise typer.Exit(BELOW)
