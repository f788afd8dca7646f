"""The commands ``refseq mission plan | run | page | lamp``: compile missions, and have robots carry them out.

Those for scenes are in ``scene``.
"""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from refseq_bench.scenarios.cli.terminal.console import err, out, saved
from refseq_bench.scenarios.cli.terminal.options import (
    CHANGE,
    LIGHT,
    RENDERER,
    ROBOT,
    ROUTE,
    SPREAD,
    TIMEOUT,
    WORLD,
    Access,
    MapFile,
    RendererName,
    Seed,
    SpreadName,
    defaulting,
    flag,
    grouped,
    option,
    output,
)
from refseq_bench.scenarios.cli.terminal.outputs import PICTURE
from refseq_bench.scenarios.cli.terminal.usage import BenchCommand, group
from refseq_bench.scenarios.drives.inputs import assignments, check_folder, check_output, load_map, writing
from refseq_bench.scenarios.errors import ScenarioError
from refseq_bench.scenarios.tables import plural, say

if TYPE_CHECKING:
    from refseq.map.map import Map
    from refseq.missions import MissionPath, Plan
    from refseq_bench.scenarios.missions.file import Asked

BELOW = 1
LEARNT = "learnt"

app = group("Plan missions along what a map knows, and run them.")

MissionText = Annotated[
    str,
    typer.Argument(metavar="MISSION", help=f"A string, as [LD_LDMC]; a file (.toml); or {LEARNT}: as it was learnt."),
]
Start = Annotated[
    str | None, option("PATH:VIEW", "Place that the way begins at. [default: the path's first]", "--from")
]
Goal = Annotated[
    str | None, option("PATH:VIEW", "Place to go to, on the shortest way. [default: the path's last]", "--to")
]
Landmark = Annotated[
    list[str] | None,
    option("NAME=METRES", "Place of a landmark on the way: LA3=12.5, LA3=end; may be repeated."),
]
Scenes = Annotated[
    list[str] | None,
    option("NAME=FILE", "Scene that the camera finds on the way: LI1=poster.scene; may be repeated.", "--scene"),
]


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq mission plan reference.refseq "[LD_LDMC]"`
* `refseq mission plan reference.refseq "[LD_LA3]" --landmark LA3=end`
* `refseq mission plan atlas.refseq --from west:0 --to east:40`

Exit codes: 0 it can be done; 2 bad input, also a landmark that is not on the way.""",
)
def plan(
    map_file: MapFile,
    mission_text: MissionText = LEARNT,
    start: Start = None,
    goal: Goal = None,
    landmark: Landmark = None,
    scenes: Scenes = None,
) -> None:
    """Compile a mission for the way that a map knows, and print what the robot is to do from where on."""
    way, compiled = compiled_mission(map_file, mission_text, start, goal, landmark, scenes)[1:]
    for number, door in enumerate(way.doors, 1):
        kind = "open" if door.passable else "closed, or something stands in it"
        say(out, f"door {number}: {door.along:6.1f} m, {door.beside}, {door.width:.2f} m wide, {kind}")
    say(out, f"{mission_text}: {plural(len(compiled.orders), 'order')} over {compiled.goal:.1f} m")
    for line in str(compiled).split("\n"):
        say(out, line)


@dataclass(frozen=True)
class TripOptions:
    """The drive of a mission; world, light and robot are those of the map's own where nothing else is said."""

    panel: ClassVar[str] = "Drive"
    world: Annotated[str | None, defaulting(WORLD, "the map's")] = None
    light: Annotated[str | None, defaulting(LIGHT, "the map's")] = None
    change: Annotated[str, CHANGE] = "none"
    robot: Annotated[str | None, defaulting(ROBOT, "the map's")] = None
    robot_spread: Annotated[SpreadName, SPREAD] = SpreadName.CALIBRATED
    at: Annotated[
        float, option("METRES", "Set the robot down so far along the way, without telling it.", "--start")
    ] = 0.0
    seed: Seed = 1001
    renderer: Annotated[RendererName | None, defaulting(RENDERER, "as the map needs")] = None
    every: Annotated[
        float, option("METRES", "Take a view every so far; best is as the map was learnt.", "--distance", min=0.05)
    ] = 0.6
    odometry: Annotated[bool, flag("--by-odometry", "Go by the odometer alone, without views.")] = False
    filmstrip: Annotated[
        float | None,
        option("SECONDS", "Have a bystander take a picture so often, for a filmstrip.", "--filmstrip", min=0.1),
    ] = None


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq mission run reference.refseq "[LD_LDMC]" --light late-evening -o out/second-door`
* `refseq mission run reference.refseq "[LI1MT180]" --scene LI1=poster.scene`
* `refseq mission run reference.refseq --by-odometry --start 3`
* `refseq mission run atlas.refseq --to east:40 --renderer none`

Exit codes: 0 completed; 1 not; 2 bad input.""",
)
@grouped
def run(
    map_file: MapFile,
    mission_text: MissionText = LEARNT,
    start: Start = None,
    goal: Goal = None,
    landmark: Landmark = None,
    scenes: Scenes = None,
    trip: TripOptions = TripOptions(),
    output: Annotated[Path | None, output("Folder for log, plan, photographs, filmstrip.", "FOLDER")] = None,
) -> None:
    """Run a mission in a world, on what the robot believes of where it is, and print its log.

    World, light and robot are those of the map's own drive where nothing else is said.
    """
    if trip.filmstrip is not None and output is None:
        raise ScenarioError("--filmstrip is left in a folder; valid is to name one as well: --output")
    if output is not None:
        check_folder(output)
    map_, _, compiled = compiled_mission(map_file, mission_text, start, goal, landmark, scenes)
    if output is None and compiled.photographs:
        raise ScenarioError("photographs are left in a folder; valid is to name one: --output")

    from refseq_bench.scenarios.missions.trip import MissionTrip, run_trip, write_trip

    asked = MissionTrip.from_map(map_, **asdict(trip), takes_pictures=compiled.takes_pictures)
    made = run_trip(asked, map_, compiled, tell=lambda entry: say(out, str(entry)))
    if output is not None:
        with writing(output):
            output.mkdir(parents=True, exist_ok=True)
            write_trip(output, asked, made)
        say(out, f"look at {output}")
    apart = math.dist(made.done.run.track[-1, 1:3], made.done.run.goal)
    if math.isfinite(apart):
        say(out, f"{apart:.2f} m from the goal, by the truth")
    if made.done.run.touched:
        say(err, f"the robot touched {', '.join(made.done.run.touched)}")
    if not made.done.run.completed:
        say(err, f"not completed: {made.done.run.why}")
        raise typer.Exit(BELOW)


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq mission page map.refseq`
* `refseq mission page maps -o out`
* `refseq mission page map.refseq --world my.toml`
* `REFSEQ_TOKEN=3f9ab27c0d1e4856 refseq mission page maps --host 192.168.1.5`

The last one is for a phone in the same network. Ctrl-C ends it.""",
)
@grouped
def page(
    maps: Annotated[Path, typer.Argument(metavar="MAPS", help="Map (.refseq), or a folder with some.")],
    world: Annotated[str | None, defaulting(WORLD, "the map's")] = None,
    output: Annotated[Path | None, output("Folder to leave each mission in.", "FOLDER")] = None,
    access: Access = Access(port=8090),
) -> None:
    """Serve a page on which missions are stated, run and watched."""
    from refseq_bench.scenarios.missions.page.maps import MapShelf

    if output is not None:
        check_folder(output)
    shelf = MapShelf(maps)

    from refseq_bench.scenarios.missions.page.desk import MissionDesk

    desk = MissionDesk(shelf, output, lambda line: say(out, line), world)
    count = desk.serve(access.policy, lambda address: say(out, f"{maps}: open {address}; Ctrl-C ends it"))
    say(out, f"{maps}: {plural(count, 'mission')} asked for")


@app.command(
    cls=BenchCommand,
    epilog="""Examples:

* `refseq mission lamp fig-1.6.lamp`
* `refseq mission lamp mine.lamp --world my.toml --seed 2 -o plan.png`

Exit codes: 0 all stages have finished; 1 one has failed; 2 bad input.""",
)
def lamp(
    program: Annotated[Path, typer.Argument(metavar="PROGRAM", help="Program (.lamp), or fig-1.6.lamp, ours.")],
    world: Annotated[str, WORLD] = "lamp",
    robot: Annotated[str, ROBOT] = "robuter",
    route: Annotated[str, ROUTE] = "forward",
    seed: Seed = 1,
    timeout: Annotated[float, TIMEOUT] = 900.0,
    output: Annotated[Path | None, PICTURE] = None,
) -> None:
    """Run a LAMP program, by sonar and odometry alone, until a stage fails, and tell what became of each."""
    from refseq_bench.robots.behaviours import BehaviourOutcome
    from refseq_bench.scenarios.missions.lamp import LampRun, lamp_plan, read_program, run_in_world

    check_output(output)
    asked = LampRun(read_program(program), world, robot, route, seed, timeout)

    from refseq_bench.scenarios.robot_checks.behaviour_drive import behaviour_table

    done = run_in_world(asked)
    out.print(behaviour_table(done))
    if output is not None:
        with saved(output) as temporary:
            lamp_plan(asked, done).savefig(temporary)
    if len(done) < len(asked.stages) or done[-1].outcome is not BehaviourOutcome.FINISHED:
        raise typer.Exit(BELOW)


def compiled_mission(
    map_file: Path,
    text: str,
    start: str | None,
    goal: str | None,
    landmark: list[str] | None,
    scenes: list[str] | None = None,
) -> "tuple[Map, MissionPath, Plan]":
    """The map, the way, and the mission for it; the mission is read before the map."""
    from refseq.missions import as_learnt
    from refseq_bench.scenarios.missions.file import asked_for

    places = {name: _number(value) for name, value in assignments(landmark, "landmark").items()}
    files = {name: Path(file) for name, file in assignments(scenes, "scene").items()}
    asked: Asked | None = None if text == LEARNT else asked_for(text, places, files)
    if asked is None and (landmark or scenes):
        flag_ = "--landmark" if landmark else "--scene"
        raise ScenarioError(f"{flag_} goes with a mission of landmarks; valid is to say which, instead of {LEARNT}")
    map_ = load_map(map_file)
    way = _way(map_, start, goal)
    return map_, way, as_learnt(way) if asked is None else asked.for_way(way)


def _way(map_: "Map", start: str | None, goal: str | None) -> "MissionPath":
    from refseq_bench.scenarios.missions.way import way_between

    if goal is None and not map_.has_one_path:
        names = ", ".join(path.name for path in map_.paths)
        raise ScenarioError(f"nobody says where to; valid is --to PATH:VIEW, a view of {names}")
    return way_between(map_, start, goal)


def _number(text: str) -> float | str:
    """A landmark's place as it is written: a number is in metres."""
    try:
        return float(text)
    except ValueError:
        return text
