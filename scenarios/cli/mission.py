"""The commands ``refseq mission plan | run | lamp``: what a robot is to do along a way, and doing it in a world."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.console import err, out, say
from scenarios.cli.lamp import EXAMPLES as LAMP_EXAMPLES
from scenarios.cli.lamp import lamp
from scenarios.drives.inputs import assignments, check_folder, writing
from scenarios.errors import ScenarioError

if TYPE_CHECKING:
    from refseq.map.map import Map
    from refseq.missions import MissionPath, Plan
    from scenarios.missions.file import Asked

NOT_COMPLETED = 1
LEARNT = "learnt"

mission = typer.Typer(
    help="Missions: what a robot is to do along a way, by landmarks or as it was learnt.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)
mission.command(epilog=LAMP_EXAMPLES)(lamp)

MapFile = Annotated[Path, typer.Argument(metavar="MAP", help="A map or an atlas (.refseq).")]
MissionText = Annotated[
    str,
    typer.Argument(metavar="MISSION", help=f"A string, as [LD_LDMC]; a file (.toml); or {LEARNT}: as it was learnt."),
]
Start = Annotated[
    str | None,
    typer.Option("--from", metavar="PATH:VIEW", help="Where the way begins. [default: where its path does]"),
]
Goal = Annotated[
    str | None, typer.Option("--to", metavar="PATH:VIEW", help="Where it ends: the shortest way is taken.")
]
Landmark = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=METRES", help="Where a landmark is on the way: LA3=12.5, LA3=end; may be repeated."),
]

PLAN_EXAMPLES = """Examples:

* `refseq mission plan reference.refseq "[LD_LDMC]"`
* `refseq mission plan reference.refseq "[LD_LA3]" --landmark LA3=end`
* `refseq mission plan atlas.refseq --from west:0 --to east:40`

Exit codes: 0 it can be done; 2 bad input, also a landmark that is not on the way."""

RUN_EXAMPLES = """Examples:

* `refseq mission run reference.refseq "[LD_LDMC]" --light late-evening -o out/second-door`
* `refseq mission run reference.refseq --odometry --at 3`
* `refseq mission run atlas.refseq --to east:40 --renderer none`

Exit codes: 0 completed; 1 not; 2 bad input."""


@mission.command(epilog=PLAN_EXAMPLES)
def plan(
    map_file: MapFile,
    mission_text: MissionText = LEARNT,
    start: Start = None,
    goal: Goal = None,
    landmark: Landmark = None,
) -> None:
    """Compile a mission for the way that a map knows, and print what the robot is to do from where on."""
    from refseq.map.map import Map

    way, compiled = _compiled(Map.load(map_file), mission_text, start, goal, landmark)
    print_doors(way)
    say(out, f"{mission_text}: {len(compiled.orders)} orders over {compiled.goal:.1f} m")
    for line in str(compiled).split("\n"):
        say(out, line)


@mission.command(epilog=RUN_EXAMPLES)
def run(
    map_file: MapFile,
    mission_text: MissionText = LEARNT,
    start: Start = None,
    goal: Goal = None,
    landmark: Landmark = None,
    world: Annotated[str | None, typer.Option(metavar="WORLD", help="World. [default: the map's]")] = None,
    light: Annotated[str | None, typer.Option(metavar="LIGHT", help="Light. [default: the map's]")] = None,
    change: Annotated[str, typer.Option(metavar="CHANGE", help="What is not as the plan has it.")] = "none",
    robot: Annotated[str | None, typer.Option(metavar="ROBOT", help="Robot. [default: the map's]")] = None,
    at: Annotated[
        float, typer.Option(metavar="METRES", help="Set the robot down so far along the way; it is not told.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of every random draw.")] = 1001,
    renderer: Annotated[
        str | None, typer.Option(metavar="RENDERER", help="filament, classic, none. [default: what the map needs]")
    ] = None,
    every: Annotated[
        float,
        typer.Option(min=0.05, metavar="METRES", help="A view so often; other than the map's own is better."),
    ] = 0.6,
    odometry: Annotated[bool, typer.Option("--odometry", help="Go by the odometer alone: no view is taken.")] = False,
    strip: Annotated[
        float | None,
        typer.Option(min=0.1, metavar="SECONDS", help="Have a bystander take a picture so often, for a strip of them."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FOLDER", help="Folder for log, plan, photographs, strip.")
    ] = None,
) -> None:
    """Let a robot run a mission in a world, on what it believes of where it is, and tell its log.

    World, light and robot are those of the map's own drive where nothing else is said.
    """
    from refseq.map.map import Map
    from scenarios.missions.trip import MissionTrip, run_trip, write_trip

    if strip is not None and output is None:
        raise ScenarioError("--strip is left in a folder; valid is to name one as well: --output")
    map_ = Map.load(map_file)
    _, compiled = _compiled(map_, mission_text, start, goal, landmark)
    trip = MissionTrip.from_map(
        map_,
        world=world,
        light=light,
        change=change,
        robot=robot,
        at=at,
        seed=seed,
        renderer=renderer,
        odometry=odometry,
        strip=strip,
        every=every,
    )
    if output is not None:
        check_folder(output)
    made = run_trip(trip, map_, compiled, tell=lambda entry: say(out, str(entry)))
    if output is not None:
        with writing(output):
            output.mkdir(parents=True, exist_ok=True)
            write_trip(output, trip, made)
        say(out, f"look at {output}")
    if made.done.run.touched:
        say(err, f"the robot touched {', '.join(made.done.run.touched)}")
    if not made.done.run.completed:
        say(err, f"not completed: {made.done.run.why}")
        raise typer.Exit(NOT_COMPLETED)


def _compiled(
    map_: "Map", text: str, start: str | None, goal: str | None, landmark: list[str] | None
) -> "tuple[MissionPath, Plan]":
    """The way, and the mission for it."""
    from refseq.missions import as_learnt
    from scenarios.missions.file import asked_for

    asked: Asked | None = None if text == LEARNT else asked_for(text, _places(landmark))
    if asked is None and landmark:
        raise ScenarioError(f"--landmark goes with a mission of landmarks; valid is to say which, instead of {LEARNT}")
    way = _way(map_, start, goal)
    return way, as_learnt(way) if asked is None else asked.for_way(way)


def _way(map_: "Map", start: str | None, goal: str | None) -> "MissionPath":
    from refseq.atlas.routes import place_of, shortest_route
    from refseq.missions import path_of

    first = map_.paths[0]
    if goal is None and start is None and map_.has_one_path:
        goal = f"{first.name}:{len(first) - 1}"
    if goal is None:
        names = ", ".join(path.name for path in map_.paths)
        raise ScenarioError(f"nobody says where to; valid is --to PATH:VIEW, a view of {names}")
    begin = place_of(map_, start or f"{first.name}:0")
    return path_of(map_, shortest_route(map_, begin, place_of(map_, goal)))


def _places(texts: list[str] | None) -> dict[str, float | str]:
    """Landmarks as they are written: a number is in metres."""
    return {name: _number(value) for name, value in assignments(texts, "landmark").items()}


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def print_doors(way: "MissionPath") -> None:
    """The doors along a way, which a mission's steps mean in this order."""
    for number, door in enumerate(way.doors, 1):
        kind = "open" if door.passable else "closed, or something stands in it"
        say(out, f"door {number}: {door.along:6.1f} m, {door.beside}, {door.width:.2f} m wide, {kind}")
